"""Print what fits become with forward-mode Jacobians in place of differences: the case of `fit_peers`.

Also how far the derivatives themselves are apart, at ever finer tolerances, and what those on steps tied to the slips
(`stickslip.slip_derivatives`) cost.

    python -m tests.benchmark.forward_mode [--damping 10] [--seed 10]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.features.curve import StepCurve
from stickslip.fit import problem as fitting
from stickslip.fit.composition import Numbers
from stickslip.fit.problem import Problem

from . import fit_peers
from .measuring import head, row

SHIFT = 1e-5  # on the search scale, of a central difference of the parameters' own (smooth) transformations
FINER = (1.0, 10.0, 100.0, 1000.0)
DIFFERENCES, RISE = Problem.slopes, StepCurve.rise


def differentiable_rise(curve: StepCurve, levels: Any, after: Any) -> Any:
    """`StepCurve.rise`, whose bisection has no derivative, with that of the implicit function theorem."""
    constant = jax.lax.stop_gradient
    levels = jnp.asarray(levels)
    t = constant(RISE(curve, levels, after))
    e = 1e-4 * jnp.maximum(constant(curve.track.arrest - curve.track.t[0]), 1e-9)
    slope = constant((curve.value(t + e) - curve.value(t - e)) / (2.0 * e))
    gap = levels - curve.value(t)
    return t + (gap - constant(gap)) / jnp.where(slope > 0.0, slope, jnp.inf)


@lru_cache(maxsize=16)
def _program(family: Any) -> Any:
    # fresh ones: what was traced before knows nothing of a differentiable rise
    run, features = fitting._tracks.__wrapped__(family).function, fitting.of_tracks.__wrapped__

    def derivatives(numbers, later, moved, moved_later, events, cycles, anchors, times, tolerance):
        def of(numbers, later):
            return features(run(numbers, events, cycles, later, tolerance), anchors, times)

        return jax.vmap(lambda a, b: jax.jvp(of, (numbers, later), (a, b))[1])(moved, moved_later)

    return jax.jit(derivatives)


def forward(
    problem: Problem, z: np.ndarray, events: np.ndarray, directions: np.ndarray, base: np.ndarray, steps: np.ndarray,
    finer: float = 1.0,
) -> np.ndarray:  # fmt: skip
    """`Problem.slopes` in forward mode through the solver; ``finer`` divides the tolerance."""
    made, data = problem.composition, problem.measurement
    times = jnp.asarray([data.layout.settling, data.layout.shortest])
    numbers = made.numbers(z)
    ahead, behind = ([made.numbers(z + s * SHIFT * d) for d in directions.T] for s in (1.0, -1.0))
    moved = Numbers(
        {
            k: np.array([(a.values[k] - b.values[k]) / (2 * SHIFT) for a, b in zip(ahead, behind, strict=True)])
            for k in numbers.values
        },
        jax.tree.map(lambda a: np.zeros((directions.shape[1], *np.shape(a))), numbers.effects),
    )
    tolerance = jax.tree.map(lambda a: a / finer, problem.tolerance)
    out = np.zeros((*base.shape, directions.shape[1]))
    for r in range(data.runs):
        cycles, anchors = problem._data[r]
        later = np.float64(made.later(z, int(cycles.run)))
        still = np.zeros(directions.shape[1])
        found = _program(made.family())(
            numbers, later, moved, still, jnp.asarray(events[r]), cycles, anchors, times, tolerance
        )
        out[r] = np.moveaxis(np.asarray(found), 0, -1)
    problem.runs_done += data.runs * directions.shape[1]
    if not np.isfinite(out).all():
        print(f"{np.count_nonzero(~np.isfinite(out))} of {out.size} derivatives are no numbers; taken as zero")
    return np.where(np.isfinite(out), out, 0.0)


@contextmanager
def slopes_by(function: Any) -> Iterator[None]:
    """Fits take their derivatives from another function."""
    Problem.slopes, StepCurve.rise = function, differentiable_rise
    try:
        yield
    finally:
        Problem.slopes, StepCurve.rise = DIFFERENCES, RISE


def fits(damping: float, seed: int) -> None:
    """The ten starts of `fit_peers`, with either Jacobian."""
    measured = fit_peers.record(seed, damping)
    head("Jacobian", "starts", "within 1 %", "within 5 %", "median error", "processor s")
    for name, function in (("differences", DIFFERENCES), ("forward mode", forward)):
        with slopes_by(function):
            way = fit_peers.Way(name, fit_peers.own(measured, damping))
            began = time.process_time()
            found = fit_peers.outcomes(way, np.inf, seed)
        errors = np.array([o.error for o in found])
        row(name, len(found), int(np.sum(errors < 0.01)), int(np.sum(errors < 0.05)),
            f"{100 * np.median(errors):.2g} %", f"{time.process_time() - began:.0f}")  # fmt: skip


def slopes(damping: float, seed: int) -> None:
    """Recurrence and size of slips: how far forward mode is from differences, in terms of these."""
    kept: list[tuple] = []

    def keep(problem, z, events, directions, base, steps):
        found = DIFFERENCES(problem, z, events, directions, base, steps)
        kept.append((problem, z.copy(), events.copy(), directions, base, steps, found))
        return found

    with slopes_by(keep):
        fit_peers.own(fit_peers.record(seed, damping), damping)
        problem, z, events, directions, base, steps, differences = kept[-1]
        at = problem.measurement.layout.slices()
        used = np.flatnonzero(problem.measurement.cycles.used[0] & problem.measurement.cycles.ends[0])
        began = time.process_time()
        DIFFERENCES(problem, z, events, directions, base, steps)
        spent = time.process_time() - began
        print(f"\nDifferences at a fit's end: {spent:.2f} s of processor time.", end=" ")
        print("How far forward mode is from them, in terms of them:\n")
        head("tolerance", *(f"recurrence {n + 1}, {s}" for n in used[:3] for s in fit_peers.NAMES), "processor s")
        for finer in FINER:
            forward(problem, z, events, directions, base, steps, finer)
            began = time.process_time()
            found = forward(problem, z, events, directions, base, steps, finer)
            spent = time.process_time() - began
            off = [
                np.abs((found - differences)[0, n, at["recurrence"]] / differences[0, n, at["recurrence"]]).ravel()
                for n in used[:3]
            ]
            row(f"of fits/{finer:g}", *(f"{o:.2g}" for o in np.concatenate(off)), f"{spent:.2f}")
        print("\nWhat a difference of a step says, ds per unit of ln, central, recurrences of the same slips:\n")
        head("step", *(f"recurrence {n + 1}, {s}" for n in used[:3] for s in fit_peers.NAMES))
        for step in 10.0 ** np.arange(-10, -1):
            lanes = [(z + sign * step * d, events) for d in directions.T for sign in (1.0, -1.0)]
            seen = np.array(problem._call(lanes))[:, 0, :, at["recurrence"]][..., 0].reshape(-1, 2, base.shape[1])
            change = (seen[:, 0] - seen[:, 1]) / (2.0 * step)
            row(f"{step:.0e}", *(f"{c:.3g}" for c in change[:, used[:3]].T.ravel()))


def tied(damping: float) -> None:
    """What derivatives on steps tied to the slips take in the same case."""
    from stickslip import slip_derivatives
    from stickslip.contact import Bank
    from stickslip.effects.velocity_weakening import VelocityWeakening
    from stickslip.errors import SolveError
    from stickslip.model import Block, LoadPoint, Model, Weakening
    from stickslip.solve import Tolerance

    def build(theta):
        strength, ratio, spring = theta
        drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, fit_peers.VELOCITY]))
        falls = VelocityWeakening(drop=1.0 - ratio, velocity=jnp.asarray(fit_peers.WEAKENING_VELOCITY))
        bank = Bank(jnp.asarray(fit_peers.STIFFNESS), strength * fit_peers.CAP)
        block = Block(mass=fit_peers.MASS, spring_stiffness=spring, damping=damping)
        return Model(block, bank, Weakening(ratio=1.0, slip_distance=1e-6, healing_time=0.01), drive, (falls,))

    for finer in (1.0, 3.0, 10.0, 30.0):
        began = time.process_time()
        tolerance = Tolerance(3e-4 / finer, 3e-13 / finer, 3e-9 / finer)
        words = f"On steps tied to the slips, their default tolerance/{finer:g}"
        try:
            found, _ = slip_derivatives(build, fit_peers.TRUTH, fit_peers.DURATION, tolerance=tolerance)
        except SolveError as error:
            print(f"\n{words}: {error}")
            continue
        spent = time.process_time() - began
        print(f"\n{words}: {spent:.0f} s of processor time, compiling included, for {found.slip.size} slips")
        break


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmark.forward_mode", description=__doc__.splitlines()[0])
    parser.add_argument("--damping", type=float, default=10.0, help="of the block, N s/m")
    parser.add_argument("--seed", type=int, default=10, help="of the noise and the starts")
    arguments = parser.parse_args()
    slopes(arguments.damping, arguments.seed)
    tied(arguments.damping)
    print()
    fits(arguments.damping, arguments.seed)


if __name__ == "__main__":
    main()
