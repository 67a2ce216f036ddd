"""A fitted model that can be simulated: driven as a measured run was, or otherwise."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from ..data.drive import Drive
from ..errors import InputError, RunFolderError, nearest
from ..inference.fit.equations import solved
from ..inference.fit.serialised import Driven, Fitted, constant_drive, pieces_drive
from ..physics.effects.equations import Equations
from ..physics.model import Model
from ..physics.params import specs, variants
from ..simulation.scenario.load import Scenario, make_scenario
from ..simulation.scenario.overrides import parse_assignment
from ..system.runstore import RESULT
from ..system.units import to_si
from .result_base import several

if TYPE_CHECKING:
    import xarray

Moves = float | str | Sequence[tuple[float | str, float | str]]  # a velocity, or until when and how fast
EVENTS = 5  # slips that are simulated unless told otherwise
FRICTION = 0.2  # where neither load nor friction of a contact is known; only their product acts
_OTHERWISE = {  # parameters of a fit that a scenario has in another way -> what to set
    "weakening.drop": "set weakening.ratio, which is 1 - drop",
    "contact.strength": "set contact.friction_coefficient: strength = contacts x normal_force x friction_coefficient",
    "sensor.force_scale": "a scenario gives the motion of the block and the true force",
}
P = ParamSpec("P")
M = TypeVar("M", bound="FittedModel")


def _simulated(scenario: Callable[Concatenate[M, P], Scenario]) -> Callable[Concatenate[M, P], xarray.Dataset]:
    """A method with the arguments of ``scenario`` that simulates what that returns."""

    @wraps(scenario)
    def simulate(self: M, *args: P.args, **kwargs: P.kwargs) -> xarray.Dataset:
        from ..simulation.scenario import simulate

        return simulate(scenario(self, *args, **kwargs))

    simulate.__name__, simulate.__qualname__ = "simulate", "FittedModel.simulate"
    simulate.__annotations__ = {**scenario.__annotations__, "return": "xarray.Dataset"}
    taken = inspect.signature(scenario).replace(return_annotation="xarray.Dataset")
    simulate.__signature__ = taken  # type: ignore[attr-defined]
    simulate.__doc__ = """Run the model freely: ``fit.simulate(drive="800 um/s")``; arguments as of :meth:`scenario`."""
    return simulate


class FittedModel:
    """What a fit and a run folder have in common: ``fitted``, the model, with its ``parts`` and its ``title``."""

    if TYPE_CHECKING:

        @property
        def fitted(self) -> Fitted: ...
        @property
        def parts(self) -> tuple[str, ...]: ...
        @property
        def title(self) -> str: ...

    @property
    def _file(self) -> Path:
        """What messages and scenarios call it."""
        return Path(RESULT)

    @property
    def runs(self) -> tuple[Driven, ...]:
        """How the measured runs were driven."""
        return self.fitted.runs

    @property
    def model(self) -> Model:
        """The model, driven as the first measured run was."""
        return self.model_of(self._first())

    def model_of(self, run: str | Driven) -> Model:
        """The model, driven as a measured run was (from time zero).

        Raises:
            InputError: there is no such run.
        """
        driven = self._run(run)
        drive = pieces_drive(driven.pieces) if driven.pieces else constant_drive(driven.velocity)
        return self.fitted.model(drive, driven.stiffness)

    def equations(self) -> Equations:
        """The equations that are solved, with the fitted values."""
        return solved(self.fitted)

    def scenario(
        self, changes: str | Sequence[str] = (), run: str | None = None, events: int = EVENTS,
        drive: Moves | None = None,
    ) -> Scenario:  # fmt: skip
        """The model as a scenario.

        Args:
            changes: such as ``"drive.velocity=100um/s"``, as after ``--set``; parameters also by the name that the fit
                gives them (``"rig.mass=0.1"``, ``"contact-ageing.rate=0"``).
            run: drive as this measured run was; default at the first run's velocity, for so many ``events``.
            events: slips to simulate where the drive has one velocity.
            drive: another one: a velocity such as ``"800 um/s"`` (a number in m/s), or until when and how fast, piece
                by piece, as of :meth:`stickslip.Trace.from_arrays`: ``[("4 s", "100 um/s"), ("5 s", 0)]``.

        Raises:
            InputError: no such run, a change or a drive that is none.
        """
        driven = self._first() if run is None else self._run(run)
        motion: dict[str, Any] = {"velocity": driven.velocity, "events": events}
        if drive is not None:
            motion = _drive_table(drive, events)
        elif run is not None and driven.pieces:
            motion = {"piece": [{"velocity": v, "duration": dt} for v, dt in driven.pieces]}
        spring = self._spring() if run is None else driven.stiffness
        content = scenario_content(self.fitted, f"{self.title}: {' + '.join(self.parts)}", motion, spring)
        given = [(self.key(name), value) for name, value in map(parse_assignment, several(changes))]
        made = make_scenario(content, self._file.parent).with_changes(given)
        return replace(made, path=self._file)

    simulate = _simulated(scenario)

    def key(self, name: str) -> str:
        """What a scenario calls a parameter of the fit; other names as they are.

        Raises:
            InputError: a scenario has it in another way.
        """
        if name in _OTHERWISE:
            raise InputError("a scenario has this parameter of a fit in another way", key=name, hint=_OTHERWISE[name])
        table, _, rest = name.partition(".")
        tags = [effect.tag for effect in self.fitted.effects()]
        return f"block.{rest}" if table == "rig" else f"effect.{name}" if table in tags else name

    def _first(self) -> Driven:
        if not self.runs:
            raise RunFolderError("the fitted model names no measured run", file=self._file)
        return self.runs[0]

    def _run(self, run: str | Driven) -> Driven:
        if isinstance(run, Driven):
            return run
        found = [driven for driven in self.runs if driven.name in (run, Path(run).stem)]
        if not found:
            names = [driven.name for driven in self.runs]
            raise InputError("no run of that name was fitted", file=self._file, value=run, hint=nearest(run, names))
        return found[0]

    def _spring(self) -> float | None:
        """Of the first run where every run has a spring of its own, else None: the rig's."""
        own = [run.stiffness for run in self.runs]
        return own[0] if own and None not in own else None


def _drive_table(drive: Moves, events: int) -> dict[str, Any]:
    """A drive in Python as the table of a scenario."""
    if isinstance(drive, int | float | str):
        return {"velocity": to_si(drive, "m/s", key="drive"), "events": events}
    try:
        ends, speeds = zip(*drive, strict=True)
    except (TypeError, ValueError):
        raise InputError(
            "no drive", key="drive", value=drive,
            allowed='a velocity ("800 um/s"), or pieces: until when and how fast ([("4 s", "100 um/s"), ("5 s", 0)])',
        ) from None  # fmt: skip
    until = [to_si(end, "s", key="drive") for end in ends]
    moves = Drive.from_pieces(until, [to_si(speed, "m/s", key="drive") for speed in speeds])
    lengths = np.diff(moves.times)
    pieces = zip(np.diff(moves.positions) / lengths, lengths, strict=True)
    return {"piece": [{"velocity": float(v), "duration": float(t)} for v, t in pieces]}


def scenario_content(found: Fitted, title: str, drive: Mapping[str, Any], spring: float | None) -> dict[str, Any]:
    """A fitted model as the tables of a scenario file; ``spring`` in N/m, None for the rig's."""
    c, v = found.composition, found.values
    whole = v["contact.strength"] / c.contacts
    load, friction = found.normal_force, found.friction
    if load is None:
        load = whole / (friction or FRICTION)
    return {
        "schema": 1,
        "title": title,
        "block": {
            "mass": v.get("rig.mass", c.mass),
            "spring_stiffness": v["rig.spring_stiffness"] if spring is None else spring,
            "damping": v["rig.damping"],
        },
        "drive": dict(drive),
        "contact": {
            "kind": "power-law",
            "contacts": c.contacts,
            "normal_force": load,
            "friction_coefficient": whole / load,
            "u_max": v["contact.u_max"],
            "p": v["contact.p"],
            "spread": v["contact.spread"],
            "bins": c.bins,
        },
        "weakening": {
            "ratio": 1.0 - v["weakening.drop"],
            "slip_distance": v["weakening.slip_distance"],
            "healing_time": v["weakening.healing_time"],
        },
        "effect": [
            {"type": e.tag}
            | {name: getattr(e, name) for name in variants(e)}
            | {name: float(getattr(e, name)) for name in specs(e)}
            for e in found.effects()
        ],
    }
