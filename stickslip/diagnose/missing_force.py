"""The force that a model lacks, as smooth functions of displacement, velocity and time in contact.

The weights of the splines are fitted with everything else in the model free, so what its own parameters or the
variation from event to event could do as well is not called missing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..effects.learned import AGES, PLACES, REACH, SPEEDS, LearnedForce
from ..features.layout import LEVELS
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import MODEL_ERROR, Fit, errors, fit
from ..fit.parameters import Free
from ..fit.problem import Problem
from ..params import specs
from .candidate import ease
from .engine import Rung
from .heldout import held_out
from .linear import Linear

UNIT = 0.01  # of the full friction force, in which weights count
WIDTH = 3.0  # prior standard deviation of a weight
DECADES = 2.0  # of speed below the largest that are resolved
BEFORE = 0.2  # of the shortest stick: time in contact from which friction is followed
SCALE = {"x": 20.0, "v": 100.0, "a": 20.0, "f": 20.0}  # of a weight: a hundredth is a good step of a difference
LEAST = 0.02  # a weight that may not be negative and would be smaller is left out
EVALUATIONS = 14
MOST, ARRIVED = 3, 0.9  # the fit goes on until that takes less than a tenth off its cost
POINTS = 121
PARTS = ("displacement", "velocity", "time in contact")


@dataclass(frozen=True)
class Seen:
    """Where the data are: what a force may depend on.

    Attributes:
        position: of the block at both ends of every slip (m).
        speed: within the slips, between the levels at which they are timed (m/s).
        age: time in contact at the slips (s), but the first of a run.
    """

    position: np.ndarray
    speed: np.ndarray
    age: np.ndarray


@dataclass(frozen=True)
class Curve:
    """One part of the missing force.

    Attributes:
        at: displacement (m), speed (m/s) or time in contact (s), shape (m,).
        force: on the block in the direction of the drive (N), shape (m,).
        std: its standard deviation (N), shape (m,).
        seen: where the data are, in the unit of ``at``.
    """

    at: np.ndarray
    force: np.ndarray
    std: np.ndarray
    seen: np.ndarray


@dataclass(frozen=True)
class MissingForce:
    """A model with a learned force on top.

    Attributes:
        composition, fit: of the model with the force.
        before: robust chi-square of the model without it.
        seen: where the data are.
        covariance: of the weights in the order of :func:`names`, shape (k, k).
    """

    composition: Composition
    fit: Fit
    before: float
    seen: Seen
    covariance: np.ndarray

    @property
    def effect(self) -> LearnedForce:
        """The force with its fitted weights."""
        own = {n.split(".", 1)[1]: v for n, v in self.fit.values.items() if n.startswith(f"{LearnedForce.tag}.")}
        without = self.composition.effects[-1]
        return _force(**{name: float(getattr(without, name)) for name in specs(without)} | own)


def _force(**values: float) -> LearnedForce:
    make: Any = LearnedForce  # its fields take numbers
    made: LearnedForce = make(**values)
    return made


def names() -> tuple[str, ...]:
    """The weights that are fitted."""
    return (*PLACES, *SPEEDS, *AGES, "first")


def seen(measurement: Measurement, train: np.ndarray) -> Seen:
    """Where the data are, of the cycles that may be fitted, shape (R, n)."""
    m, s = measurement, measurement.layout.slices()
    used = np.asarray(m.cycles.used) & train
    size = m.values[..., s["size"]][used]
    levels = np.insert(LEVELS, 3, 0.5)
    times = np.insert(m.values[..., s["times"]][used], 3, 0.0, axis=-1)  # counted from half the slip
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.abs(np.diff(levels) * size / np.diff(times, axis=-1))
    speed = speed[np.isfinite(speed) & (np.diff(times, axis=-1) > 0.0)]
    later = used.copy()
    later[:, 0] = False
    stick = np.asarray(m.anchors.creep)[..., -1] + 1.35 * m.layout.settling
    start = np.asarray(m.cycles.position)[used]
    return Seen(np.concatenate([start, start + size[:, 0]]), speed, stick[later if later.any() else used])


def blank(found: Seen, base: Fit) -> LearnedForce:
    """The force with no weights, over the range of the data."""
    fastest = 1.2 * float(found.speed.max())
    return _force(
        size=UNIT * base.values["contact.strength"],
        x_low=float(found.position.min()),
        x_high=float(found.position.max()),
        v_low=fastest * 10.0**-DECADES,
        v_high=fastest,
        age_low=BEFORE * float(found.age.min()),
        age_high=1.05 * float(found.age.max()),
        slip_distance=float(base.values["weakening.slip_distance"]),
    )


def weights() -> list[Free]:
    """The weights as free parameters, of either sign."""
    known = specs(LearnedForce)
    return [
        Free(
            f"{LearnedForce.tag}.{name}", "1", SCALE[name[0]], 0.0, 0.0, WIDTH / SCALE[name[0]],
            -REACH, REACH, known[name].doc,
        )
        for name in names()
    ]  # fmt: skip


def learn(
    base: Composition,
    optimum: Fit,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    *,
    begin: MissingForce | None = None,
    evaluations: int = EVALUATIONS,
    progress: Callable[[str, float], None] | None = None,
) -> MissingForce:
    """Fit a smooth force on top of a model, everything else free.

    As a picture of what is missing its part of the velocity may have either sign, for the model may have too much of
    what it takes back. One for prediction begins at such a picture, and keeps of that part what takes energy out.

    Args:
        base, optimum: the model and its fit.
        measurement, floor: the data.
        train: cycles that may be fitted, shape (R, n).
        begin: the picture of the same model: the force is one for prediction.
        evaluations: of the model, at most, besides Jacobians, at each of at most two widths of the floors.
        progress: told what goes on and the share of the work done.

    Raises:
        FitError: the model gives no finite features.
    """
    free, k = weights(), len(base.free)
    z, events, columns = np.concatenate([optimum.z, np.zeros(len(free))]), optimum.events, None
    wide = ease(optimum, measurement, floor)
    if begin is not None:
        # what would give energy is left out: a search that begins at a bound does not get away from it
        bounded = [replace(f, lower=specs(LearnedForce)[n].lower) for f, n in zip(free, names(), strict=True)]
        kept = [i for i, f in enumerate(bounded) if f.lower < 0.0 or f.outward(begin.fit.z[k + i]) > LEAST]
        free, which = [bounded[i] for i in kept], [*range(k), *(k + i for i in kept)]
        z, events, columns = begin.fit.z[which], begin.fit.events, begin.fit.columns[..., which]
        wide = 1.0
    fine = Problem(base.with_effect(blank(seen(measurement, train), optimum), free), measurement)
    problem = fine.coarser() if begin is None else fine
    stages = ((wide, evaluations // 2), (1.0, evaluations)) if wide > 1.5 else ((1.0, evaluations),)
    done, most = 0, sum(n for _, n in stages) + MOST * evaluations + (evaluations if begin is None else 0)

    def count(text: str) -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(text, min(done / most, 0.99))

    # some thirty weights: derivatives are taken once, and then only carried on
    once = partial(fit, problem, floor, use=train, anew=False, progress=count)
    found = once(z=z, events=events, stages=stages, columns=columns)
    for _ in range(MOST):
        more = once(z=found.z, events=found.events, stages=((1.0, evaluations),), columns=found.columns)
        arrived = more.cost > ARRIVED * found.cost
        found = more if more.cost < found.cost else found
        if arrived:
            break
    if begin is None:
        # derivatives that were carried on so far hold the solver's noise, which looks like knowledge of the weights
        more = fit(fine, floor, z=found.z, events=found.events, stages=((1.0, evaluations),), use=train, progress=count)
        found = more if more.cost < found.cost else replace(found, columns=more.columns)
    return again(base, optimum, measurement, floor, train, found)


def again(
    base: Composition, optimum: Fit, measurement: Measurement, floor: np.ndarray, train: np.ndarray, found: Fit
) -> MissingForce:
    """The force of a fit that was made before; arguments as :func:`learn`."""
    where, k = seen(measurement, train), len(base.free)
    problem = Problem(base.with_effect(blank(where, optimum), found.free[k:]), measurement)
    covariance = _covariance(problem, found, measurement, floor)
    return MissingForce(problem.composition, found, optimum.cost, where, covariance)


def rung(missing: MissingForce, below: Rung, measurement: Measurement, floor: np.ndarray, train: np.ndarray) -> Rung:
    """The model with the force as a step of the ladder above the model it was learned from."""
    tag, found, used = LearnedForce.tag, missing.fit, np.asarray(measurement.cycles.used)
    held = held_out(Problem(missing.composition, measurement), found, floor, used & ~train, found.features)
    train_errors = errors(measurement, found, floor)
    return Rung((*below.model, tag), tag, train_errors, held, missing.composition, found, found.features)


def _covariance(problem: Problem, found: Fit, measurement: Measurement, floor: np.ndarray) -> np.ndarray:
    """Of the weights, everything else marginalised; data widened by what events share, priors not.

    A weight that was left out has none.
    """
    linear = Linear(problem, found, measurement, floor, measurement.valid & found.use[..., None])
    matrix = linear.basis @ linear.triangle * linear.size
    matrix[: linear.rows] /= MODEL_ERROR
    at = {f.name: i for i, f in enumerate(found.free)}
    own = [at.get(f"{LearnedForce.tag}.{name}") for name in names()]
    whole = np.linalg.pinv(matrix.T @ matrix)
    out = np.zeros((len(own), len(own)))
    known = [j for j, i in enumerate(own) if i is not None]
    index = [i for i in own if i is not None]
    scale = np.array([float(found.free[i].scale) for i in index])
    out[np.ix_(known, known)] = whole[np.ix_(index, index)] * np.outer(scale, scale)
    return out


def curves(missing: MissingForce) -> dict[str, Curve]:
    """The parts of the force with their standard deviations: part -> curve.

    That of the displacement is relative to its mean over the data, that of the time in contact to its value at the
    shortest stick: what is the same everywhere is strength.
    """
    e, found = missing.effect, missing.seen
    unit, at = float(e.size), {n: i for i, n in enumerate(names())}
    own = dict(zip(names(), np.array([float(getattr(e, n)) for n in names()]), strict=True))

    def curve(x: np.ndarray, basis: np.ndarray, which: tuple[str, ...], sign: float, data: np.ndarray) -> Curve:
        index = [at[n] for n in which]
        spread = np.einsum("mi,ij,mj->m", basis, missing.covariance[np.ix_(index, index)], basis)
        force = sign * basis @ np.array([own[n] for n in which])
        return Curve(x, unit * force, unit * np.sqrt(np.maximum(spread, 0.0)), np.sort(data))

    def splines(of: Callable[[Array], Array], at: np.ndarray) -> np.ndarray:
        return np.asarray(of(jnp.asarray(at)))

    x = np.linspace(float(e.x_low), float(e.x_high), POINTS)
    along = splines(e.along, x) - np.mean(splines(e.along, found.position), axis=0)
    v = np.geomspace(max(float(e.v_low), 0.3 * float(found.speed.min())), float(e.v_high), POINTS)
    shortest = float(found.age.min())
    age = np.geomspace(shortest, float(e.age_high), POINTS)
    aged = splines(e.aged, age) - splines(e.aged, np.array([shortest]))
    return dict(
        zip(
            PARTS,
            (
                curve(x, along, PLACES, 1.0, found.position),
                curve(v, splines(e.against, v), SPEEDS, -1.0, found.speed),
                curve(age, aged, AGES, -1.0, found.age),
            ),
            strict=True,
        )
    )
