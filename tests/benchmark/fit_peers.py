"""Print what a fit finds of three parameters from ten starts: the own one, and lmfit's and PINTS' where installed.

A block on 64 Jenkins elements whose strength falls with velocity, 5 s of drive from rest, displacement at 1 kHz with
20 nm of noise. Sought: strength, kinetic over static friction, stiffness of the driving spring; the rest is known.
Data are made, and the peers' model is run, by a leapfrog of every element that shares nothing with the solver. The
peers fit the trace point by point, which is what a tool that knows nothing of events can do.

    python -m tests.benchmark.fit_peers [--limit SECONDS] [--damping 10]

lmfit and PINTS are no dependencies of the project: `pip install lmfit pints` in a spare environment.
"""

from __future__ import annotations

import argparse
import functools
import importlib.util
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np

from .measuring import head, row

ELEMENTS, DURATION, DT, EVERY = 64, 5.0, 2e-5, 50  # 1, s, s, steps a sample
MASS, VELOCITY, WEAKENING_VELOCITY = 0.09, 5e-5, 1e-3  # kg, m/s, m/s
STIFFNESS = np.full(ELEMENTS, 7e5 / ELEMENTS)  # N/m
_SPREAD = np.linspace(0.05, 1.0, ELEMENTS)
CAP = _SPREAD / _SPREAD.sum()  # share of the strength
MOST_STEPS = 24576  # without damping the contact rings through every stick
NOISE = 2e-8  # m
NAMES = ("strength", "ratio", "spring_stiffness")
TRUTH = np.array([0.26, 0.70, 3000.0])  # N, 1, N/m
LOWER, UPPER = np.array([0.1, 0.4, 1000.0]), np.array([0.5, 0.99, 6000.0])
STARTS, AWAY = 10, 0.25


@numba.njit(cache=True)
def _march(strength, ratio, c_s, n, dt, every, stiffness, share, mass, damping, drive, falls):
    x = v = 0.0
    held = np.zeros(stiffness.size)
    out = np.empty(n // every)
    for j in range(n):
        g = ratio + (1.0 - ratio) * np.exp(-abs(v) / falls)
        total = 0.0
        for i in range(stiffness.size):
            high = g * share[i] * strength
            held[i] = min(max(held[i] + stiffness[i] * v * dt, -high), high)
            total += held[i]
        v += dt * (c_s * (drive * (j + 1) * dt - x) - total - damping * v) / mass
        x += dt * v
        if (j + 1) % every == 0:
            out[(j + 1) // every - 1] = x
    return out


def displacement(parameters: np.ndarray, damping: float) -> np.ndarray:
    """Displacement (m) at every sample, by leapfrog; ``damping`` in N s/m."""
    f, ratio, c_s = (float(p) for p in parameters)
    return _march(
        f, ratio, c_s, round(DURATION / DT), DT, EVERY, STIFFNESS, CAP, MASS, damping, VELOCITY, WEAKENING_VELOCITY
    )


def times() -> np.ndarray:
    """Times of the samples (s)."""
    return DT * EVERY * (1.0 + np.arange(round(DURATION / DT) // EVERY))


def record(seed: int, damping: float) -> np.ndarray:
    """The measured displacement (m)."""
    clean = displacement(TRUTH, damping)
    return clean + np.random.default_rng(seed).normal(0.0, NOISE, clean.size)


def starts(seed: int = 0) -> np.ndarray:
    """Starts within a quarter of the truth, shape (STARTS, 3)."""
    found = TRUTH * (1.0 + np.random.default_rng(seed + 1).uniform(-AWAY, AWAY, (STARTS, 3)))
    found[:, 1] = np.clip(found[:, 1], 0.5, 0.95)
    return found


@dataclass(frozen=True)
class Outcome:
    """What a way of fitting found from one start: parameters, wall time (s), runs of the model."""

    parameters: np.ndarray
    wall: float
    runs: int

    @property
    def error(self) -> float:
        """Largest relative error of a parameter."""
        return float(np.max(np.abs(self.parameters / TRUTH - 1.0)))


@dataclass(frozen=True)
class Way:
    """A way of fitting: from a start (strength, ratio, stiffness) to the parameters found and the runs of the model."""

    name: str
    fit: Callable[[np.ndarray], tuple[np.ndarray, int]]


def own(measured: np.ndarray, damping: float) -> Callable[[np.ndarray], tuple[np.ndarray, int]]:
    """The project's model and its fit from several starts, the first of them the one given."""
    import jax.numpy as jnp

    from stickslip.contact import Bank
    from stickslip.effects.velocity_weakening import VelocityWeakening
    from stickslip.features.measurement import measure
    from stickslip.fit.common import Common
    from stickslip.fit.composition import Composition, Family
    from stickslip.fit.multistart import best_of
    from stickslip.fit.parameters import Free
    from stickslip.fit.problem import Problem
    from stickslip.floors import floors
    from stickslip.model import Block, LoadPoint, Model, Weakening
    from stickslip.segment import segment
    from stickslip.trace import Drive, Trace

    class KnownContact(Family):
        """The bank's stiffness and the distribution of its caps are known."""

        def model(self, numbers, event, nodes, stiffness, start=None):
            v = numbers.values
            return Model(
                Block(mass=v["rig.mass"], spring_stiffness=v["rig.spring_stiffness"], damping=v["rig.damping"]),
                Bank(jnp.asarray(STIFFNESS), v["contact.strength"] * CAP),
                Weakening(ratio=1.0, slip_distance=1e-6, healing_time=0.01),
                LoadPoint(nodes[0], nodes[1]),
                (VelocityWeakening(drop=v["velocity-weakening.drop"], velocity=jnp.asarray(WEAKENING_VELOCITY)),),
            )

    class Known(Composition):
        """Three unknowns."""

        def family(self):
            return KnownContact(*super().family())

    class Same(Problem):
        """The contact does not vary from event to event."""

        def event_columns(self, columns, z, events):
            return np.zeros((*columns.shape[:-1], 2))

        def common(self, floor, use, factor=1.0):
            none = np.zeros_like(floor)  # the bank is known: there are no rough lines that it only stands for
            return Common(self.measurement, floor, use, factor, (none, none))

    drive = Drive.constant(VELOCITY, 0.0, DURATION)
    trace = Trace(name="benchmark", time=times(), displacement=measured, noise=NOISE, virgin=True, drive=drive)
    period = 2.0 * np.pi * float(np.sqrt(MASS / STIFFNESS.sum()))
    data = measure([trace], [segment(trace)], ring_period=period)
    valid, parts = data.valid.copy(), data.layout.slices()
    for group in ("overshoot", "ring", "frequency"):
        valid[..., parts[group]] = False  # the contact rings at 440 Hz, which 1 kHz does not show
    data = replace(data, valid=valid, new_lines=0.0)
    floor = floors(data)

    def run(start: np.ndarray) -> tuple[np.ndarray, int]:
        first = (start[0], 1.0 - start[1], start[2])
        low, high = (LOWER[0], 1.0 - UPPER[1], LOWER[2]), (UPPER[0], 1.0 - LOWER[1], UPPER[2])
        names = (("contact.strength", "N"), ("velocity-weakening.drop", "1"), ("rig.spring_stiffness", "N/m"))
        free = tuple(
            Free(name, unit, "log", float(v), float(v), np.inf, float(a), float(b))
            for (name, unit), v, a, b in zip(names, first, low, high, strict=True)
        )
        known = Known(MASS, 1, ELEMENTS, free, {"rig.damping": damping}, most_steps=MOST_STEPS)
        problem = Same(known, data)
        found = best_of(problem, floor, np.asarray(data.cycles.used))
        strength, drop, c_s = np.exp(found.z)
        return np.array([strength, 1.0 - drop, c_s]), problem.runs_done

    run(starts()[0])  # compiles
    return run


def lmfit_ways(measured: np.ndarray, damping: float) -> Iterator[Way]:
    """Least squares of the trace, point by point, by lmfit."""
    import lmfit

    def run(start: np.ndarray) -> tuple[np.ndarray, int]:
        sought = lmfit.Parameters()
        for name, value, low, high in zip(NAMES, start, LOWER, UPPER, strict=True):
            sought.add(name, value=float(value), min=float(low), max=float(high))

        def residual(p: Any) -> np.ndarray:
            return (displacement(np.array([p[name].value for name in NAMES]), damping) - measured) / NOISE

        found = lmfit.minimize(residual, sought, epsfcn=1e-6)
        return np.array([found.params[name].value for name in NAMES]), int(found.nfev)

    yield Way(f"lmfit {lmfit.__version__} leastsq, pointwise", run)


def pints_ways(measured: np.ndarray, damping: float) -> Iterator[Way]:
    """The same by PINTS: CMA-ES within bounds, and Nelder-Mead."""
    import pints

    class Forward(pints.ForwardModel):
        def n_parameters(self):
            return 3

        def simulate(self, parameters, times):
            return displacement(parameters, damping)

    error = pints.SumOfSquaresError(pints.SingleOutputProblem(Forward(), times(), measured))

    def run(start: np.ndarray, method: Any, iterations: int, bounds: Any) -> tuple[np.ndarray, int]:
        np.random.seed(0)  # noqa: NPY002  (what PINTS draws from)
        widths = np.array([0.03, 0.1, 300.0])
        search = pints.OptimisationController(error, start, sigma0=widths, boundaries=bounds, method=method)
        search.set_log_to_screen(False)
        search.set_max_iterations(iterations)
        found, _ = search.run()
        return np.asarray(found, float), int(search.evaluations())

    box = pints.RectangularBoundaries(LOWER, UPPER)
    for name, method, iterations, bounds in (
        ("CMA-ES", pints.CMAES, 200, box),
        ("Nelder-Mead", pints.NelderMead, 300, None),
    ):
        yield Way(
            f"PINTS {pints.__version__} {name}, pointwise",
            functools.partial(run, method=method, iterations=iterations, bounds=bounds),
        )


def ways(measured: np.ndarray, damping: float) -> Iterator[Way]:
    """All ways of fitting there are here; says which peers are not installed."""
    yield Way("own fit", own(measured, damping))
    for package, made in (("lmfit", lmfit_ways), ("pints", pints_ways)):
        if importlib.util.find_spec(package) is None:
            row(package, "not installed: pip install " + package, *[""] * 5)
        else:
            yield from made(measured, damping)


def outcomes(way: Way, limit: float, seed: int = 0) -> list[Outcome]:
    """Fits from all starts, or from the first of them if that takes longer than ``limit`` (s)."""
    found: list[Outcome] = []
    began = time.perf_counter()
    for start in starts(seed):
        at = time.perf_counter()
        parameters, runs = way.fit(start)
        found.append(Outcome(parameters, time.perf_counter() - at, runs))
        if time.perf_counter() - began > limit:
            break
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmark.fit_peers", description=__doc__.splitlines()[0])
    parser.add_argument("--limit", type=float, default=60.0, help="seconds after which no further start is begun")
    parser.add_argument("--damping", type=float, default=0.0, help="of the block, N s/m")
    parser.add_argument("--seed", type=int, default=0, help="of the noise and the starts")
    arguments = parser.parse_args()
    measured = record(arguments.seed, arguments.damping)
    print(
        f"Three parameters (strength, kinetic over static friction, spring) from {STARTS} starts within {AWAY:.0%}; "
        f"{measured.size} samples, {NOISE * 1e9:g} nm of noise, damping {arguments.damping:g} N s/m. "
        "Error: the worst of the three parameters."
    )
    head("fit", "starts", "within 1 %", "within 5 %", "median error", "median wall s", "median runs of the model")
    for way in ways(measured, arguments.damping):
        found = outcomes(way, arguments.limit, arguments.seed)
        errors = np.array([o.error for o in found])
        row(
            way.name, len(found), int(np.sum(errors < 0.01)), int(np.sum(errors < 0.05)),
            f"{100 * np.median(errors):.2g} %", f"{np.median([o.wall for o in found]):.2g}",
            f"{np.median([o.runs for o in found]):.0f}",
        )  # fmt: skip


if __name__ == "__main__":
    main()
