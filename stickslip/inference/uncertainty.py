"""What a fit knows about its parameters: directions it cannot tell, in words, and the profile likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FLAT = 0.3  # standard deviation on the search scale (of a logarithm: 30 %) beyond which a direction is not known
TIED = 0.95  # correlation beyond which two parameters act as one
LEVEL = 3.84  # rise of the cost at the ends of a 95 % interval
FIRST, DOUBLINGS = 3.0, 6  # distance of the first value, in standard deviations, and how far a flat profile is followed
AT_BOUND = 0.02  # deviation of a parameter that has none, for it stands at a bound
CLOSER, NEAR = 5, 0.05  # evaluations at most to meet that rise, and how nearly
_PART = 0.3  # share of a direction's largest weight that makes a parameter part of it
_SMALL = 0.1  # power below which a factor is left out of a product
_MEMBER = 0.1  # share of a quantity's axis that is unknown, from which it belongs to what acts together


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


def relative(
    names: Sequence[str], z: Sequence[float], covariance: Array, logs: Sequence[bool]
) -> tuple[list[int], Array, list[str]]:
    """Covariance of the logarithms of all parameters, those among them that are not sought as one carried over.

    Args:
        names, z, covariance: of k parameters, on the search scale.
        logs: whether that scale is the logarithm.

    Returns:
        Which parameters have one (a value that may as well be zero has none), their covariance, and, in words, of the
        others that they may be zero.
    """
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    kept = [i for i in range(len(names)) if logs[i] or abs(z[i]) > 2.0 * sd[i]]
    scale = np.array([1.0 if logs[i] else 1.0 / z[i] for i in kept])
    part = np.asarray(covariance, float)[np.ix_(kept, kept)] * np.outer(scale, scale)
    lost = [
        f"{names[i]} is known to {sd[i] / abs(z[i]):.1g} times its value, so its size alone is not "
        "significantly different from zero (whether the effect exists is decided by its gain)"
        if abs(z[i]) > 0.1 * sd[i]
        else f"{names[i]} is not significantly different from zero"
        for i in range(len(names))
        if i not in kept
    ]
    return kept, part, lost


def flat_directions(
    names: Sequence[str], covariance: Array, *, limit: float = FLAT, widths: Sequence[float] | None = None
) -> list[Direction]:
    """Directions whose standard deviation exceeds ``limit``, the flattest first, then pairs that act as one.

    Args:
        names: of the k parameters.
        covariance: of their logarithms, shape (k, k).
        limit: standard deviation from which a direction counts as not known.
        widths: of the priors on the same scale (inf for none): a direction as wide as its prior is the prior's.
    """
    covariance = np.asarray(covariance, float)
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    found: list[Direction] = []
    for value, vector in sorted(zip(values, vectors.T, strict=True), key=lambda pair: -float(pair[0])):
        std = float(np.sqrt(max(value, 0.0)))
        if std <= limit:
            break
        direction = _direction(names, vector, std, covariance, widths)
        if not any(set(direction.names) <= set(d.names) for d in found):
            found.append(direction)
    flat, told = [set(d.names) for d in found], set[str]()
    for pair in _tied(names, covariance):
        # of three that are all tied to each other, two pairs say it
        if set(pair.names) <= told or any(set(pair.names) <= other for other in flat):
            continue
        found.append(pair)
        told |= set(pair.names)
    return found


def null_directions(
    names: Sequence[str], jacobian: Array, covariance: Array, *, limit: float = FLAT
) -> list[Direction]:
    """Groups of quantities that act only together on what a fit knows, and the combination of each that it does know.

    Args:
        names: of k quantities behind the parameters of the fit.
        jacobian: derivatives of the logarithms of n parameters of the fit in those of the quantities, shape (n, k).
        covariance: of the logarithms of the parameters, shape (n, n).
        limit: standard deviation of the logarithm from which a direction counts as not known.
    """
    jacobian = np.asarray(jacobian, float)
    information = jacobian.T @ np.linalg.pinv(np.asarray(covariance, float), hermitian=True) @ jacobian
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    flat = vectors[:, values < limit**-2]
    shared = flat @ flat.T
    members = [i for i in range(len(names)) if shared[i, i] > _MEMBER]
    found = []
    while members:
        group = [members.pop(0)]
        for i in group:  # grows while it is gone through
            tied = [j for j in members if abs(shared[i, j]) > 0.5 * _MEMBER]
            group += tied
            members = [j for j in members if j not in tied]
        group.sort()
        found.append(_group([names[i] for i in group], _marginal(information, group), limit))
    return found


def _marginal(information: Array, group: list[int]) -> Array:
    """What is known of some quantities when nothing is known of the others."""
    rest = [i for i in range(len(information)) if i not in group]
    across = information[np.ix_(group, rest)]
    inner = np.linalg.pinv(information[np.ix_(rest, rest)], hermitian=True)
    return np.asarray(information[np.ix_(group, group)] - across @ inner @ across.T, float)


def _group(names: list[str], information: Array, limit: float) -> Direction:
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    only = "only" if values[0] < 1e-6 * max(values[-1], 1.0) else "almost only"
    weights = vectors[:, -1] / vectors[int(np.argmax(np.abs(vectors[:, -1]))), -1]
    if len(names) == 1:
        return Direction((names[0],), (1.0,), float("inf"), f"{names[0]} is not determined")
    if values[-1] < limit**-2:
        return Direction(tuple(names), tuple(weights.tolist()), float("inf"), f"{_join(names)} are not determined")
    std = float(np.linalg.norm(weights) / np.sqrt(values[-1]))
    more = int(np.sum(values >= limit**-2)) - 1
    text = f"{_join(names)} act {only} together: {_product(names, weights)} is known {_size(std)}"
    text += f", and {more} more of their combinations, none of them alone" if more else ", none of them alone"
    return Direction(tuple(names), tuple(weights.tolist()), float("inf"), text)


def _direction(
    names: Sequence[str], vector: Array, std: float, covariance: Array, widths: Sequence[float] | None
) -> Direction:
    top = int(np.argmax(np.abs(vector)))
    vector = vector / vector[top]
    parts = [int(i) for i in np.argsort(-np.abs(vector), kind="stable") if abs(vector[i]) >= _PART]
    who = [names[i] for i in parts]
    weights = tuple(float(vector[i]) for i in parts)
    if len(who) == 1:
        text = f"{who[0]} is not determined to a factor {np.exp(min(std, 50.0)):.2g} either way"
        if widths is not None and np.isfinite(widths[parts[0]]) and std > 0.7 * widths[parts[0]]:
            text += " (what is reported is its prior)"
    else:
        own = covariance[np.ix_(parts, parts)]
        known = np.linalg.eigh(own)[1][:, 0]
        known = known / known[int(np.argmax(np.abs(known)))]
        known = np.where(np.abs(known) < _SMALL, 0.0, known)
        best = float(np.sqrt(max(known @ own @ known, 0.0)))
        each = np.sqrt(np.diag(own))
        text = f"{_join(who)} are not determined, neither alone nor together: "
        if best < FLAT:
            text = f"{_join(who)} act almost only together: {_product(who, known)} is known {_size(best)}, "
        text += _each(who, each)
    return Direction(tuple(who), weights, std, text)


def _product(names: Sequence[str], powers: Sequence[float] | Array) -> str:
    """``"a * b^0.3 / c"``; the first factor is one that is not divided by."""
    powers = np.asarray(powers, float)
    powers = powers if powers.max() >= 1.0 - 1e-9 else -powers
    order = sorted(range(len(names)), key=lambda i: powers[i] < 0)
    text = ""
    for i in order:
        size = abs(float(powers[i]))
        if size < _SMALL:
            continue
        factor = names[i] if abs(size - 1.0) < 0.05 else f"{names[i]}^{size:.2g}"
        text += factor if not text else f" {'*' if powers[i] > 0 else '/'} {factor}"
    return text


def _size(std: float) -> str:
    """Standard deviation of a logarithm in words."""
    return f"to {100 * std:.2g} %" if std <= FLAT else f"to a factor {np.exp(min(std, 50.0)):.2g}"


def _each(names: Sequence[str], std: Sequence[float] | Array) -> str:
    if max(std) < 1.5 * min(std):
        return f"each {_size(float(max(std)))}"
    return _join([f"{name} {_size(float(s))}" for name, s in zip(names, std, strict=True)])


def _tied(names: Sequence[str], covariance: Array) -> list[Direction]:
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(sd, sd)
    pairs = [(j, i) for i in range(len(names)) for j in range(i) if abs(correlation[i, j]) > TIED]
    out = []
    for pair in sorted(pairs, key=lambda p: -abs(correlation[p])):
        own = covariance[np.ix_(pair, pair)]
        who = [names[k] for k in pair]
        ratio = sd[pair[0]] / sd[pair[1]]
        ratio = 1.0 if abs(np.log(ratio)) < 0.15 else ratio
        known = np.array([1.0, -np.sign(own[0, 1]) * ratio])
        known /= np.abs(known).max()
        best = float(np.sqrt(max(known @ own @ known, 0.0)))
        text = f"{_join(who)} act almost only together: {_product(who, known)} is known {_size(best)}, "
        text += f"{_each(who, sd[list(pair)])} (correlation {correlation[pair]:.2f})"
        weights = (1.0, float(np.sign(own[0, 1])))
        out.append(Direction(tuple(who), weights, float(sd[list(pair)].max()), text))
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
    progress: Callable[[int], None] = lambda done: None,
) -> Profile:
    """Profile likelihood: everything else refitted at values of one parameter around its best one.

    To each side the distance is doubled until the cost has risen by what 95 % allow; there the profile is evaluated
    again until it is met, and half way.

    Args:
        name: of the parameter.
        best, std, bounds: optimum, standard deviation and bounds on the search scale.
        refit: cost of the best fit with the parameter held at a value.
        progress: told how many values are done.
    """
    cost: dict[float, float] = {}

    def look(value: float) -> float:
        at = float(np.clip(value, *bounds))
        if at not in cost:
            cost[at] = refit(at)
            progress(len(cost))
        return at

    def risen() -> tuple[Array, Array]:
        z = np.array(sorted(cost))
        heights = np.array([cost[at] for at in z])
        return z, heights - heights.min()

    lowest, first = cost[look(best)], FIRST * (std if std > 0.0 else AT_BOUND)
    for side in (-1, 1):
        for k in range(DOUBLINGS):
            end = look(best + side * first * 2**k)
            if cost[end] - lowest >= LEVEL or end in bounds:
                break
        for _ in range(CLOSER):
            crossing = _crossing(*risen(), side)
            if not np.isfinite(crossing):
                break
            end = look(crossing)
            if abs(cost[end] - lowest - LEVEL) < NEAR * LEVEL:
                break
        look(0.5 * (best + end))
    z, rise = risen()
    low, high = _crossing(z, rise, -1), _crossing(z, rise, +1)
    if not np.isfinite(low) and not np.isfinite(high):
        text = f"the profile of {name} is flat as far as it was followed: the data do not determine it"
    elif not np.isfinite(low) or not np.isfinite(high):
        text = f"{name} is bounded on one side only"
    else:
        text = f"{name} is determined on both sides"
    if _ragged(rise):
        text += ", but the refits do not follow one optimum: use more starts or fewer parameters before relying on it"
    return Profile(name, z, rise, (low, high), text)


def _ragged(rise: Array, noise: float = 1.0) -> bool:
    """Whether the profile falls again on its way out, by more than ``noise``."""
    i = int(np.argmin(rise))
    left, right = rise[i::-1], rise[i:]
    return any(bool(np.any(np.maximum.accumulate(side) - side > noise)) for side in (left, right))


def _crossing(z: Array, rise: Array, side: int) -> float:
    """Where the profile passes :data:`LEVEL` on one side of its lowest point; infinite where it never does."""
    i = int(np.argmin(rise))
    while 0 <= i + side < z.size:
        a, b = rise[i], rise[i + side]
        if b >= LEVEL:
            # a parabola is a straight line in the root of the rise
            share = (np.sqrt(LEVEL) - np.sqrt(max(a, 0.0))) / (np.sqrt(b) - np.sqrt(max(a, 0.0)))
            return float(z[i] + share * (z[i + side] - z[i]))
        i += side
    return side * float("inf")
