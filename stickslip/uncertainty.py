"""What a fit knows about its parameters: directions it cannot tell, in words, and the profile likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FLAT = 0.3  # standard deviation on the search scale (of a logarithm: 30 %) beyond which a direction is not known
TIED = 0.95  # correlation beyond which two parameters act as one
_PART = 0.3  # share of a direction's largest weight that makes a parameter part of it


@dataclass(frozen=True)
class Direction:
    """A combination of parameters that the data leave open.

    Attributes:
        names: the parameters that take part.
        weights: of each, on the search scale, the largest 1 in size.
        std: standard deviation along it, on the search scale (inf: nothing limits it).
        text: in words.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    std: float
    text: str


def flat_directions(
    names: Sequence[str], covariance: Array, *, limit: float = FLAT, widths: Sequence[float] | None = None
) -> list[Direction]:
    """Directions whose standard deviation exceeds ``limit``, the flattest first, then pairs that act as one.

    Args:
        names: of the k parameters.
        covariance: on the search scale (of logarithms where a parameter is sought as one), shape (k, k).
        limit: standard deviation from which a direction counts as not known.
        widths: of the priors on the same scale (inf for none): a direction as wide as its prior is the prior's.
    """
    covariance = np.asarray(covariance, float)
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    found = []
    for value, vector in sorted(zip(values, vectors.T, strict=True), key=lambda pair: -float(pair[0])):
        std = float(np.sqrt(max(value, 0.0)))
        if std <= limit:
            break
        found.append(_direction(names, vector, std, widths))
    listed = {frozenset(d.names) for d in found}
    return found + [d for d in _tied(names, covariance) if not any(set(d.names) <= other for other in listed)]


def null_directions(names: Sequence[str], jacobian: Array, tolerance: float = 1e-3) -> list[Direction]:
    """Directions along which the prediction does not change at all: what a model can never tell, whatever the noise.

    Args:
        names: of the k parameters.
        jacobian: derivatives of the prediction in their logarithms, shape (n, k).
        tolerance: singular values below this share of the largest count as none.
    """
    _, s, vt = np.linalg.svd(np.asarray(jacobian, float), full_matrices=True)
    s = np.concatenate([s, np.zeros(vt.shape[0] - s.size)])
    return [
        _direction(names, _sparse(v), float("inf"), None)
        for v, size in zip(vt, s, strict=True)
        if size < tolerance * s[0]
    ]


def _sparse(vector: Array) -> Array:
    return np.where(np.abs(vector) < 0.02 * np.abs(vector).max(), 0.0, vector)


def _direction(names: Sequence[str], vector: Array, std: float, widths: Sequence[float] | None) -> Direction:
    top = int(np.argmax(np.abs(vector)))
    vector = vector / vector[top]
    parts = [int(i) for i in np.argsort(-np.abs(vector), kind="stable") if abs(vector[i]) >= _PART]
    who = [names[i] for i in parts]
    weights = tuple(float(vector[i]) for i in parts)
    if len(who) == 1:
        size = f"to a factor {np.exp(min(std, 50.0)):.2g} either way" if np.isfinite(std) else "at all"
        text = f"{who[0]} is not determined {size}" if np.isfinite(std) else f"{who[0]} has no influence"
        if widths is not None and np.isfinite(widths[parts[0]]) and std > 0.7 * widths[parts[0]]:
            text += " (what is reported is its prior)"
    else:
        held = "not at all" if not np.isfinite(std) else f"to a factor {np.exp(min(std, 50.0)):.2g}"
        text = f"{_join(who)} act only together: {_ratio(who, weights)} matters, each alone {held}"
        if np.isfinite(std):
            text = f"{_join(who)} act together: each alone is known only {held}, {_ratio(who, weights)} much better"
    return Direction(tuple(who), weights, std, text)


def _ratio(names: Sequence[str], weights: Sequence[float]) -> str:
    """A combination of two or more parameters that the direction leaves unchanged."""
    first, second = weights[0], weights[1]
    power = -first / second
    if len(names) > 2:
        return "their combination"
    exponent = "" if abs(abs(power) - 1) < 0.15 else f"^{abs(power):.2g}"
    return f"{names[0]} {'*' if power > 0 else '/'} {names[1]}{exponent}"


def _tied(names: Sequence[str], covariance: Array) -> list[Direction]:
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(sd, sd)
    pairs = [(i, j) for i in range(len(names)) for j in range(i) if abs(correlation[i, j]) > TIED]
    out = []
    for i, j in sorted(pairs, key=lambda p: -abs(correlation[p])):
        way = "the same way" if correlation[i, j] > 0 else "against each other"
        text = f"{names[j]} and {names[i]} move {way} (correlation {correlation[i, j]:.2f}): "
        text += "an error of one is taken up by the other"
        out.append(
            Direction((names[j], names[i]), (1.0, float(np.sign(correlation[i, j]))), float(max(sd[i], sd[j])), text)
        )
    return out


def _join(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


@dataclass(frozen=True)
class Profile:
    """Cost of the best fit against one parameter that is held.

    Attributes:
        name: of the parameter.
        z: values on the search scale, increasing, shape (n,).
        rise: of the cost (chi-square) above the lowest, shape (n,).
        interval: 95 % interval on the search scale; inf where the profile does not rise enough.
        text: in words.
    """

    name: str
    z: Array
    rise: Array
    interval: tuple[float, float]
    text: str


def profile(
    name: str,
    best: float,
    std: float,
    bounds: tuple[float, float],
    refit: Callable[[float], float],
    *,
    points: int = 7,
    reach: float = 2.5,
    least: float = 0.02,
    progress: Callable[[int, int], None] | None = None,
) -> Profile:
    """Profile likelihood: everything else refitted at values of one parameter around its best one.

    Args:
        name: of the parameter.
        best, std, bounds: optimum, standard deviation and bounds on the search scale.
        refit: cost of the best fit with the parameter held at a value.
        points: values, odd.
        reach: in standard deviations, to either side.
        least: smallest standard deviation assumed.
        progress: told how many are done, of how many.
    """
    step = max(std, least) * reach
    z = np.unique(np.clip(best + step * np.linspace(-1.0, 1.0, points), *bounds))
    cost = []
    for i, value in enumerate(z):
        cost.append(refit(float(value)))
        if progress is not None:
            progress(i + 1, z.size)
    rise = np.array(cost) - min(cost)
    low, high = _crossing(z, rise, -1), _crossing(z, rise, +1)
    if not np.isfinite(low) and not np.isfinite(high):
        text = f"the profile of {name} is flat within {reach:g} standard deviations: the data do not determine it"
    elif not np.isfinite(low) or not np.isfinite(high):
        text = f"{name} is bounded on one side only"
    else:
        text = f"{name} is determined on both sides"
    if _ragged(rise):
        text += (
            ", but the refits do not follow one valley: more starts, or fewer free parameters, before this is believed"
        )
    return Profile(name, z, rise, (low, high), text)


def _ragged(rise: Array, noise: float = 1.0) -> bool:
    """Whether the profile falls again on its way out, by more than ``noise``."""
    i = int(np.argmin(rise))
    left, right = rise[i::-1], rise[i:]
    return any(bool(np.any(np.maximum.accumulate(side) - side > noise)) for side in (left, right))


def _crossing(z: Array, rise: Array, side: int, level: float = 3.84) -> float:
    """Where the profile passes ``level`` on one side of its lowest point; infinite where it never does."""
    i = int(np.argmin(rise))
    while 0 <= i + side < z.size:
        a, b = rise[i], rise[i + side]
        if b >= level:
            # a parabola is a straight line in the root of the rise
            share = (np.sqrt(level) - np.sqrt(max(a, 0.0))) / (np.sqrt(b) - np.sqrt(max(a, 0.0)))
            return float(z[i] + share * (z[i + side] - z[i]))
        i += side
    return side * float("inf")
