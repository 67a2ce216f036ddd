"""Experiments that are easily made on a rig."""

from __future__ import annotations

from dataclasses import replace

from .setting import Setting

HOLDS = ("1 s", "10 s", "100 s")


def practicable(setting: Setting, velocity: float, spring: float, mass: float) -> dict[str, Setting]:
    """What is easily done, in words, and as a setting; the rest of it as it is.

    Args:
        setting: what else is asked for.
        velocity, spring, mass: as they are (m/s, N/m, kg).
    """
    plain = replace(setting, velocity=f"{velocity:.6g} m/s", hold="", step="", back=False)

    def at(factor: float) -> str:
        return f"{factor * velocity:.6g} m/s"

    return {
        **{f"a hold of {hold}": replace(plain, hold=hold) for hold in HOLDS},
        "a quarter of the velocity": replace(plain, velocity=at(0.25)),
        "four times the velocity": replace(plain, velocity=at(4.0)),
        "a step to ten times the velocity": replace(plain, step=at(10.0)),
        "a block twice as heavy": replace(plain, mass=f"{2.0 * mass:.6g} kg"),
        "a spring half as stiff": replace(plain, spring=f"{0.5 * spring:.6g} N/m"),
        "half the load": replace(plain, load="0.5"),
        "twice the load": replace(plain, load="2"),
        "back over the same track": replace(plain, back=True),
    }
