"""Derivatives through the solver against finite differences over a ladder of steps, at two tolerances."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..effects.base import Effect
from ..params import Spec, specs
from .rig import AT_ONCE, DRIVE, LOOSE, TIGHT, Rig, feature_scales

LADDER = 10.0 ** np.arange(-7.0, -1.5, 0.5)  # steps as shares of a parameter's range
AGREEMENT = {LOOSE: 0.10, TIGHT: 0.02}  # of the largest change of a feature over the range
NOISE = {LOOSE: 1e-2, TIGHT: 2e-3}  # error of a run's features, as a share of their scales
WIDE = 1e-4  # a plateau must hold a step at least so large: a small one alone sees only its own branch of a switch


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
        places = rig.at(index)
        for where, values in test_points(effect):
            p = rig.defaults.copy()
            for name, value in values.items():
                p[places[name]] = value
            names = [n for n in places if where != "at the null" or n == effect.amplitude]
            for tolerance in (LOOSE, TIGHT):
                _check_point(rig, index, p, {n: places[n] for n in names}, tolerance, where, report)


def _check_point(
    rig: Rig,
    index: int,
    p: np.ndarray,
    places: dict[str, int],
    tolerance: float,
    where: str,
    report: Callable[[int, str], None],
) -> None:
    known = specs(rig.effects[index])
    slopes = _slopes(rig, p, list(places.values()), tolerance)
    for (name, place), slope in zip(places.items(), slopes, strict=True):
        spec = known[name]
        reach = p[place] * np.log(spec.upper / spec.lower) if spec.log else spec.upper - spec.lower
        exact = slope * reach / feature_scales()
        if not np.all(np.isfinite(exact)):
            report(index, f"derivative in {name} {where} is not finite")
            continue
        gaps = []
        for share in LADDER:
            gap = np.abs(_difference(rig, p, place, spec, reach, share, tolerance) / feature_scales() - exact)
            gaps.append(gap - AGREEMENT[tolerance] * np.max(np.abs(exact)) - NOISE[tolerance])
        good = np.max(np.nan_to_num(gaps, nan=np.inf), axis=1) <= 0.0
        pairs = good[:-1] & good[1:] & (LADDER[1:] >= WIDE)
        if not np.any(pairs):
            report(
                index,
                f"derivative in {name} {where} (tolerance {tolerance:g}) agrees with no finite difference: "
                f"per range {np.array2string(exact, precision=3)}, agreeing steps {LADDER[good].tolist()}",
            )


def _slopes(rig: Rig, p: np.ndarray, places: list[int], tolerance: float) -> np.ndarray:
    """Derivatives of the features along the given parameters, shape (parameters, features)."""
    rows = []
    for first in range(0, len(places), AT_ONCE):
        some = places[first : first + AT_ONCE]
        directions = np.zeros((AT_ONCE, p.size))
        directions[np.arange(len(some)), some] = 1.0
        rows.append(np.asarray(rig.run_derivatives(p, directions, DRIVE, tolerance)[1])[: len(some)])
    return np.concatenate(rows)


def _difference(
    rig: Rig, p: np.ndarray, place: int, spec: Spec, reach: float, share: float, tolerance: float
) -> np.ndarray:
    """Finite difference of the features times the range; one-sided, of second order, where a bound is in the way."""
    step = share * reach
    inside = [spec.lower <= p[place] + s * step <= spec.upper for s in (-1, 1)]
    offsets, weights = {
        (True, True): ([-1, 1], [-0.5, 0.5]),
        (False, True): ([0, 1, 2], [-1.5, 2.0, -0.5]),
        (True, False): ([0, -1, -2], [1.5, -2.0, 0.5]),
    }[tuple(inside)]
    total = np.zeros(feature_scales().size)
    for offset, weight in zip(offsets, weights, strict=True):
        q = p.copy()
        q[place] += offset * step
        total = total + weight * np.asarray(rig.run(q, DRIVE, tolerance).features)
    return total / share
