"""A fitted model as plain data, for ``result.json``, and back again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np

from ...physics.effects import catalogue
from ...physics.effects.base import Effect
from ...physics.model import LoadPoint, Model
from ...physics.params import specs, variants
from .composition import Composition, run_of
from .parameters import Free, to_si, vector

KEY = "fitted_model"  # of its section in result.json
MOST_PIECES = 200  # of a drive that is kept; sampled drives have more and are kept as their usual speed


@dataclass(frozen=True)
class Driven:
    """How one measured run was driven.

    Attributes:
        name: of the run.
        velocity: usual speed of its drive (m/s).
        pieces: velocity (m/s) and duration (s) of every piece of the drive; empty where they were too many.
        stiffness: of the spring where this run had another than the rig (N/m), else None.
        virgin: whether it began with a virgin contact.
    """

    name: str
    velocity: float
    pieces: tuple[tuple[float, float], ...] = ()
    stiffness: float | None = None
    virgin: bool = True


@dataclass(frozen=True)
class Fitted:
    """A family of models and the member that a fit chose.

    Attributes:
        composition: the family.
        z: the free parameters on their search scales, shape (k,).
        covariance: of z, shape (k, k); nan where it is not known.
        runs: the measured runs, in order.
        normal_force: of one contact, where it was given (N).
        friction: coefficient of friction that was given.
    """

    composition: Composition
    z: np.ndarray
    covariance: np.ndarray
    runs: tuple[Driven, ...] = ()
    normal_force: float | None = None
    friction: float | None = None

    @property
    def values(self) -> dict[str, float]:
        """Name -> SI value, fixed ones included."""
        return {**self.composition.fixed, **to_si(self.composition.free, self.z)}

    @property
    def std(self) -> dict[str, float]:
        """Name -> standard deviation of the free parameters (SI)."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return {f.name: float(s * f.slope(z)) for f, s, z in zip(self.composition.free, sd, self.z, strict=True)}

    @property
    def parts(self) -> tuple[str, ...]:
        """Tags of what is in the model."""
        return ("static", "inertia", *(e.tag for e in self.composition.effects if e.tag != "inertia"))

    def model(self, load_point: LoadPoint, stiffness: float | None = None) -> Model:
        """The model under a drive, what varies from event to event at its mean.

        Args:
            load_point: the drive.
            stiffness: of the spring (N/m); default the rig's.
        """
        own = jnp.asarray(np.nan if stiffness is None else stiffness)
        nodes = (load_point.times, load_point.positions)
        return self.composition.model(np.asarray(self.z), jnp.zeros(2), nodes, own)

    def effects(self) -> tuple[Effect, ...]:
        """The effects with their fitted parameters."""
        return self.model(constant_drive(1e-4)).effects


def constant_drive(velocity: float) -> LoadPoint:
    """A drive at one velocity (m/s) from time and position zero."""
    return LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, velocity]))


def pieces_drive(pieces: Sequence[tuple[float, float]]) -> LoadPoint:
    """A drive of pieces (velocity in m/s, duration in s) from time and position zero."""
    v, dt = np.array(pieces, float).T
    times, positions = (np.concatenate([[0.0], np.cumsum(part)]) for part in (dt, v * dt))
    return LoadPoint(jnp.asarray(times), jnp.asarray(positions))


def record(found: Fitted) -> dict[str, Any]:
    """The section of ``result.json``: all that is needed to make the model again, in SI."""
    c, values, std = found.composition, found.values, found.std
    return {
        "parts": list(found.parts),
        "mass": c.mass,
        "contacts": c.contacts,
        "bins": c.bins,
        "normal_force": found.normal_force,
        "friction_coefficient": found.friction,
        "fixed": dict(c.fixed),
        "free": [{**asdict(f), "value": values[f.name], "std": std[f.name]} for f in c.free],
        "search": [float(z) for z in found.z],
        "covariance": np.asarray(found.covariance),
        "effects": [_effect_record(e) for e in found.effects()],
        "runs": [asdict(run) for run in found.runs],
    }


def _effect_record(effect: Effect) -> dict[str, Any]:
    return {
        "type": effect.tag,
        "form": {name: getattr(effect, name) for name in variants(effect)},
        "parameters": {name: float(getattr(effect, name)) for name in specs(effect)},
    }


def from_record(section: Mapping[str, Any]) -> Fitted:
    """The inverse of :func:`record`.

    Raises:
        InputError: an effect that is not in the catalogue (one of a user's own file that was not loaded).
        KeyError, TypeError, ValueError: the section is damaged.
    """
    free = tuple(_free(entry) for entry in section["free"])
    covariance = np.array(section["covariance"], float).reshape(len(free), len(free))
    runs = tuple(
        Driven(
            str(r["name"]),
            float(r["velocity"]),
            tuple((float(v), float(dt)) for v, dt in r["pieces"]),
            None if r["stiffness"] is None else float(r["stiffness"]),
            bool(r["virgin"]),
        )
        for r in section["runs"]
    )
    composition = Composition(
        float(section["mass"]),
        int(section["contacts"]),
        int(section["bins"]),
        free,
        {str(name): float(value) for name, value in section["fixed"].items()},
        tuple(_effect(entry) for entry in section["effects"]),
    )
    load, friction = (section.get(key) for key in ("normal_force", "friction_coefficient"))
    # a logarithm and back is another number in its last digit, and another simulation in its seventh
    z = np.array(section["search"], float) if "search" in section else vector(free)
    if z.shape != (len(free),):
        raise ValueError(f"{z.size} values on the search scale of {len(free)} parameters")
    return Fitted(composition, z, covariance, runs, load, friction)


def _free(entry: Mapping[str, Any]) -> Free:
    """A free parameter that starts at its fitted value; no prior is written as no number."""
    known = {name: entry[name] for name in Free.__dataclass_fields__ if name != "usual"}
    usual = entry.get("usual")  # what was written before it was kept has none
    known["width"] = math.inf if known["width"] is None else float(known["width"])
    return Free(**{**known, "start": float(entry["value"]), "usual": None if usual is None else tuple(usual)})


def _effect(entry: Mapping[str, Any]) -> Effect:
    cls = catalogue.get(entry["type"])
    known = specs(cls)
    # the logarithm and back may have left the bounds by a rounding error
    values = {
        name: float(np.clip(value, known[name].lower, known[name].upper)) if name in known else value
        for name, value in entry["parameters"].items()
    }
    return catalogue.make(entry["type"], **entry["form"], **values)


def shared(name: str) -> bool:
    """Whether a parameter belongs to the model, and not to one run of a campaign alone."""
    return run_of(name) is None
