"""Experiments that tell effects apart: those that are easily made on a rig, and those that a diagnosis proposes."""

from __future__ import annotations

import re
from dataclasses import replace

from ...objects import Diagnosis
from .setting import LONGEST_HOLD, Setting

FLYING = "0.002"  # of the load, at which the block swings on its spring as if without contact
SWING, LASTING = "10 mm/s", "2 s"  # velocity from which the load point stops then, and how long the swing is watched
HOLDS = ("1 s", "10 s", "100 s")
# what cannot be simulated, because it needs another instrument than the one that watches the block, or another rig
BEYOND = (
    r"laser|second sensor|reference beam|on the sensor|decoder|hammer|tap the|profilometry|spectrum|humidity|"
    r"temperature|turn the|weights|height at which|measure the load|load one contact"
)
# words of a proposal -> names of the experiments (see `usual`) that it asks for
_ASKED = (
    (r"load series|loads|another load|light loads|load one contact|repeated loading|weights|measure the load", "load"),
    (r"velocity steps|steps in steady", "step"),
    (r"slowest drive|drive velocity|drive velocities|another velocity|holds at one elongation", "velocity"),
    (r"far above|steady sliding at the drive", "sliding"),
    (r"without contact|free vibration|at no load|tap the|hammer|decoder|step test|on the sensor", "flying"),
    (r"ringing|ring-down|rebound|slip duration|slip size against", "load"),
    (r"mass", "mass"),
    (r"back over|way back|first against repeated|start the same track|start the drive|same place|turn the|loops|stroke",
     "back"),
    (r"longer track|longer path|several pitches", "longer"),
    (r"lift the block|virgin", "plain"),
    (r"drive off|drive stopped|half load|slide-hold|holds?\b", "hold"),
    (r"temperature|humidity|laser|beam|second sensor|profilometry", "velocity"),
    (r"height", "load"),
)  # fmt: skip


def families(setting: Setting, velocity: float, spring: float, mass: float) -> dict[str, dict[str, Setting]]:
    """What is easily done on a rig, by what is changed, in words, and as a setting; the rest as it is.

    Args:
        setting: what else is asked for.
        velocity, spring, mass: as they are (m/s, N/m, kg).
    """
    plain = replace(setting, velocity=f"{velocity:.6g} m/s", hold="", step="", back=False)

    def at(factor: float) -> str:
        return f"{factor * velocity:.6g} m/s"

    return {
        "hold": {f"a hold of {hold}": replace(plain, hold=hold) for hold in HOLDS},
        "velocity": {
            "a quarter of the velocity": replace(plain, velocity=at(0.25)),
            "four times the velocity": replace(plain, velocity=at(4.0)),
        },
        "step": {"a step to ten times the velocity": replace(plain, step=at(10.0))},
        "mass": {"a block twice as heavy": replace(plain, mass=f"{2.0 * mass:.6g} kg")},
        "spring": {"a spring half as stiff": replace(plain, spring=f"{0.5 * spring:.6g} N/m")},
        "load": {"half the load": replace(plain, load="0.5"), "twice the load": replace(plain, load="2")},
        "back": {"back over the same track": replace(plain, back=True)},
        "longer": {"four times as many slips": replace(plain, events=4 * plain.events)},
        "plain": {"from a fresh contact": plain},
        "sliding": {"a step to sliding at 0.1 m/s": replace(plain, step="0.1 m/s")},
        "flying": {
            "free vibration, almost without load": replace(plain, velocity=SWING, load=FLYING, hold=LASTING),
        },
    }  # fmt: skip


USUAL = ("hold", "velocity", "step", "mass", "spring", "load", "back")


def usual(setting: Setting, velocity: float, spring: float, mass: float) -> dict[str, Setting]:
    """Experiments that are easily made on a rig, by what is done; arguments as of :func:`families`."""
    found = families(setting, velocity, spring, mass)
    return {words: own for name in USUAL for words, own in found[name].items()}


def proposed(text: str, setting: Setting, velocity: float, spring: float, mass: float) -> dict[str, Setting]:
    """What a proposal in words asks for, as experiments that can be simulated; where it needs what no model of the
    block holds (see :func:`beyond`), those that come nearest to it.

    Args:
        text: such as "holds of 1 s and 25 s: only ageing remembers them"; what comes after the colon tells why.
        setting, velocity, spring, mass: as of :func:`families`.
    """
    known = families(setting, velocity, spring, mass)
    return _named(text.partition(":")[0].lower(), known) or _named(text.lower(), known)


def _named(what: str, known: dict[str, dict[str, Setting]]) -> dict[str, Setting]:
    out: dict[str, Setting] = {}
    for words, name in _ASKED:
        if not re.search(words, what):
            continue
        own = known[name]
        lengths = re.findall(r"(\d+(?:\.\d+)?) s\b", what) if name == "hold" else []
        if lengths:
            first = next(iter(own.values()))
            held = [f"{min(float(each), LONGEST_HOLD):g} s" for each in lengths]
            own = {f"a hold of {hold}": replace(first, hold=hold) for hold in held}
        out.update(own)
    return out


def beyond(text: str) -> bool:
    """Whether a proposal asks for another instrument or another rig than a simulation of the block has."""
    return bool(re.search(BEYOND, text.partition(":")[0].lower()))


def undecided(diagnosis: Diagnosis | None) -> list[tuple[tuple[str, ...], str]]:
    """Sets of effects that the data cannot tell apart, each with the experiment that would."""
    found = None if diagnosis is None else diagnosis.next_experiment
    if not found:
        return []
    every = [found, *found.get("others", ())]
    return [(tuple(e["separates"]), str(e["text"])) for e in every if len(e.get("separates", ())) > 1]
