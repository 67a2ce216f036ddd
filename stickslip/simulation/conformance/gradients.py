"""Derivatives through the solver against finite differences over a ladder of steps, at two tolerances."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...physics.effects.base import Effect
from ...physics.params import Spec, specs
from .rig import AT_ONCE, DRIVE, LOOSE, TIGHT, Rig, directions, feature_scales

LADDER = 10.0 ** np.arange(-7.0, -1.0)  # steps as shares of a parameter's range
AGREEMENT = 0.02  # on a plateau, of the largest change of a feature over the range
ROUGH = 0.15  # the same where some steps of the run did not end their Newton iteration
SECANT = 0.25  # at the step WIDE; elements that begin to slide in between bend the true curve by some per cent
NOISE = 1e-5  # change of a feature over the range, as a share of its scale, that is as good as none
JUMP = 0.01  # of a scale: the least difference that a switch hidden between two steps of the ladder must make
BETWEEN = 0.5  # difference between the tolerances, as a share of the largest change, plus
COARSE = 0.5  # of a scale: just before a slip elements let go one by one, and the derivative jumps with the steps
CENTRAL = ([-1, 0, 1], [-0.5, 0.0, 0.5])
WIDE = 1e-3  # a step so large must roughly agree too: a small one alone sees only its own branch of a switch


def test_points(effect: Effect) -> Iterator[tuple[str, dict[str, float]]]:
    """Where derivatives are tried: at the null and with the effect present, the rest at the defaults."""
    spec = specs(effect)[effect.amplitude]
    assert spec.null is not None
    yield "at the null", {effect.amplitude: spec.null}
    yield "with the effect", {effect.amplitude: present(spec, 0.1)}


def present(spec: Spec, share: float) -> float:
    """An amplitude at a share of the way from the null to the farther bound."""
    assert spec.null is not None
    bound = spec.upper if spec.upper - spec.null >= spec.null - spec.lower else spec.lower
    return spec.null + share * (bound - spec.null)


def check_gradients(rig: Rig, report: Callable[[int, str], None]) -> None:
    """Try every parameter of every effect of the rig; ``report(index of the effect, text)`` takes the faults."""
    for index, effect in enumerate(rig.effects):
        for where, values in test_points(effect):
            p = rig.with_values(index, values)
            names = [n for n in rig.at(index) if where != "at the null" or n == effect.amplitude]
            exact = []
            for tolerance in (LOOSE, TIGHT):
                run = rig.run(p, DRIVE, tolerance)
                steps = np.append(0.0, np.asarray(run.steps.t)), int(run.accepted), tolerance  # the solver's own
                exact.append(_check_point(rig, index, p, names, steps, where, report))
            apart = np.abs(exact[0] - exact[1]) - COARSE
            for row, name in enumerate(names):
                if np.any(apart[row] > BETWEEN * np.max(np.abs(exact[1][row]))):
                    seen = ", ".join(_short(slopes[row]) for slopes in exact)
                    report(index, f"derivative in {name} {where} does not settle as the tolerance is lowered: {seen}")


def _check_point(
    rig: Rig,
    index: int,
    p: np.ndarray,
    names: list[str],
    steps: tuple[np.ndarray, int, float],
    where: str,
    report: Callable[[int, str], None],
) -> np.ndarray:
    """Compare at one point; the derivatives per range in units of the scales, shape (names, features).

    ``steps`` are their times (s), padded, how many there are, and their tolerance.
    """
    known, places = specs(rig.effects[index]), rig.at(index)
    slopes, agreement = _slopes(rig, p, [places[n] for n in names], steps)
    all_exact = []
    for name, slope in zip(names, slopes, strict=True):
        spec, place = known[name], places[name]
        reach = p[place] * np.log(spec.upper / spec.lower) if spec.log else spec.upper - spec.lower
        exact = slope * reach / feature_scales()
        all_exact.append(exact)
        if not np.all(np.isfinite(exact)):
            report(index, f"derivative in {name} {where} is not finite: {exact}")
            continue
        gaps = np.abs(_differences(rig, p, place, spec, reach, steps) - exact)
        size = np.max(np.abs(exact))
        worst = np.max(np.nan_to_num(gaps, nan=np.inf), axis=1)
        good = worst <= agreement * size + NOISE
        jumps = worst[-1] > SECANT * size + JUMP and worst[-2] < 1e-3 * worst[-1]  # curvature alone: a tenth or less
        if not np.any(good[:-1] & good[1:]) or worst[LADDER >= WIDE].min() > SECANT * size + NOISE or jumps:
            text = f"derivative in {name} {where} (tolerance {steps[2]:g}) agrees with no finite difference: per range "
            text += f"{_short(exact)}, gaps {_short(worst)} for steps of 1e-7 ... 1e-2 of the range"
            report(index, text)
    return np.array(all_exact)


def _slopes(rig: Rig, p: np.ndarray, places: list[int], steps: tuple) -> tuple[np.ndarray, float]:
    """Derivatives of the features, shape (parameters, features), and the agreement to expect."""
    rows, failed = [], 0.0
    for first in range(0, len(places), AT_ONCE):
        some = places[first : first + AT_ONCE]
        (_, failed), (slopes, _) = rig.replay_derivatives(p, directions(some, p.size), *steps)
        rows.append(np.asarray(slopes)[: len(some)])
    return np.concatenate(rows), ROUGH if failed else AGREEMENT


def _differences(rig: Rig, p: np.ndarray, place: int, spec: Spec, reach: float, steps: tuple) -> np.ndarray:
    """Finite differences over the LADDER per range, in units of the scales, shape (steps, features).

    Central; one-sided, of second order as well, where a bound is in the way.
    """
    largest = LADDER[-1] * reach
    low, high = p[place] - largest < spec.lower, p[place] + largest > spec.upper
    offsets, weights = ([0, 1, 2], [-1.5, 2.0, -0.5]) if low else ([0, -1, -2], [1.5, -2.0, 0.5]) if high else CENTRAL
    points = np.repeat(p[None], LADDER.size * len(offsets), axis=0)
    points[:, place] += np.outer(LADDER * reach, offsets).ravel()
    padding = np.repeat(p[None], 3 * LADDER.size - len(points), axis=0)  # one shape, one compilation
    values = np.asarray(rig.replay(np.concatenate([points, padding]), *steps)[0])[: len(points)]
    values = values.reshape(LADDER.size, len(offsets), -1) / feature_scales()
    return np.einsum("sof,o->sf", values, weights) / LADDER[:, None]


def _short(numbers: np.ndarray) -> str:
    return "[" + " ".join(f"{x:.2g}" for x in numbers) + "]"
