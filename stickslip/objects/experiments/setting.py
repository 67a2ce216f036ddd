"""What is simulated: a drive, a rig and a load as they were written, and the scenario of a model under them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...inference.diagnose.expected_information import Changed
from ...simulation.scenario import Scenario
from ...system.units import to_si
from ..fit import Fit

LONGEST_HOLD = 300.0  # s; a record of one takes a gigabyte of memory
STICKS = (1.6, 2.6)  # mean recurrences of drive before and after a hold, so that it begins and ends between slips
HOLDS = ("1 s", "10 s", "100 s")  # that are easily made
SHORTEST = 0.1  # of the drive after a step, in those recurrences, however fast it is


@dataclass(frozen=True)
class Setting:
    """What is simulated, as it was written; "" leaves it as in the measured run.

    Attributes:
        run: the measured run that it is beside.
        velocity: of the load point, such as "100 um/s".
        hold: how long the load point halts once, such as "10 s".
        spring: stiffness of the spring, such as "500 N/m".
        mass: of the block, such as "100 g".
        events: slips after which it ends, where a velocity is given; else it is as long as the measured run.
        step: velocity that the load point goes on with from a stick on, such as "1 mm/s".
        load: normal load in that of the measured run, such as "2".
        back: whether the load point goes back the way it came.
        pieces: velocities (m/s) and durations (s) of the load point, in place of all that else moves it.
    """

    run: str
    velocity: str = ""
    hold: str = ""
    spring: str = ""
    mass: str = ""
    events: int = 5
    step: str = ""
    load: str = ""
    back: bool = False
    pieces: tuple[tuple[float, float], ...] = ()

    @property
    def as_measured(self) -> bool:
        """Whether the load point moves as in the measured run."""
        return (
            not self.back
            and not self.pieces
            and not any(text.strip() for text in (self.velocity, self.hold, self.step))
        )


def changes(fit: Fit, setting: Setting) -> list[tuple[str, Any]]:
    """What a setting changes in the scenario of its measured run: keys and values (SI).

    Raises:
        InputError: a quantity that cannot be read or is out of range.
    """
    base: Scenario = fit.scenario(run=setting.run, events=setting.events)
    out: list[tuple[str, Any]] = []
    for key, text, unit, words in (
        ("block.spring_stiffness", setting.spring, "N/m", "spring"), ("block.mass", setting.mass, "kg", "mass"),
    ):  # fmt: skip
        if text.strip():
            out.append((key, _positive(text, unit, words)))
    if setting.load.strip():
        times, contact = _positive(setting.load, "1", "load"), base.file.contact
        # a contact of exponent p slides at the displacement of its indentation, which grows as load^(1/p)
        out.append(("contact.normal_force", times * contact.of(0, "normal_force")))
        out.append(("contact.u_max", times ** (1.0 / contact.of(0, "p")) * contact.of(0, "u_max")))
    if setting.as_measured:
        return [*out, *([] if base.file.drive.velocity is None else [("drive.events", setting.events)])]
    if setting.pieces:
        return [*out, ("drive", {"piece": [{"velocity": v, "duration": t} for v, t in setting.pieces]})]
    own = next(run for run in fit.fitted.runs if run.name == setting.run).velocity
    velocity = to_si(setting.velocity, "m/s", key="velocity") if setting.velocity.strip() else own
    if velocity == 0.0:
        raise InputError("without drive motion there is no slip", key="velocity", value=setting.velocity)
    hold = _positive(setting.hold, "s", "hold") if setting.hold.strip() else 0.0
    if hold > LONGEST_HOLD:
        raise InputError(
            "too long to be shown here", key="hold", value=setting.hold, allowed=f"up to {LONGEST_HOLD:g} s",
            hint="write it into a scenario for stickslip simulate",
        )  # fmt: skip
    if not hold and not setting.step.strip() and not setting.back:
        return [*out, ("drive", {"velocity": velocity, "events": setting.events})]
    later = to_si(setting.step, "m/s", key="velocity after the step") if setting.step.strip() else velocity
    return [*out, ("drive", {"piece": _pieces(base.with_changes(out), velocity, hold, later, setting.back)})]


def scenario(fit: Fit, setting: Setting) -> Scenario:
    """The model as a scenario of a setting.

    Raises:
        InputError: a quantity that cannot be read or is out of range.
    """
    made: Scenario = fit.scenario(run=setting.run, events=setting.events)
    return made.with_changes(changes(fit, setting))


def changed(fit: Fit, setting: Setting) -> Changed:
    """What a setting changes of the rig of its measured run, as factors."""
    base, file = fit.scenario(run=setting.run, events=setting.events).file, scenario(fit, setting).file
    load, stretch = (
        float(file.contact.of(0, key) / base.contact.of(0, key)) for key in ("normal_force", "u_max")
    )  # fmt: skip
    spring = file.block.spring_stiffness / base.block.spring_stiffness
    return Changed(file.block.mass / base.block.mass, load, spring, stretch)


def settled(fit: Fit, setting: Setting) -> Setting:
    """The same with the times of its drive as they are for a model, so that others are put to the very same."""
    drive = dict(changes(fit, setting)).get("drive", {})
    return replace(setting, pieces=tuple((p["velocity"], p["duration"]) for p in drive.get("piece", ())))


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


def _positive(text: str, unit: str, key: str) -> float:
    found = to_si(text, unit, key=key)
    if not found > 0.0:
        raise InputError("out of range", key=key, value=text, allowed=f"more than 0 {unit}")
    return found


def _pieces(made: Scenario, velocity: float, hold: float, later: float, back: bool) -> list[dict[str, float]]:
    """Drive, a hold amid a stick where one is asked for, drive again at ``later``, and back where that is asked for."""
    file = made.file
    block, contact = file.block, file.contact
    strength = contact.contacts * contact.of(0, "normal_force") * contact.of(0, "friction_coefficient")
    rate = block.spring_stiffness * abs(velocity)
    period = 2.0 * (1.0 - file.weakening.ratio) * strength / rate + np.pi * np.sqrt(block.mass / block.spring_stiffness)
    longer = max(abs(velocity / later), SHORTEST) if later else 1.0
    after = STICKS[1] * period * longer
    turned = 2.0 * strength / (block.spring_stiffness * abs(later)) if later else 0.0  # until it slides the other way
    return [
        {"velocity": velocity, "duration": float(strength / rate + STICKS[0] * period)},
        *([{"velocity": 0.0, "duration": hold}] if hold else []),
        {"velocity": later, "duration": float(after)},
        *([{"velocity": -later, "duration": float(turned + after)}] if back else []),
    ]
