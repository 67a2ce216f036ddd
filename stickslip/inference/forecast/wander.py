"""Levels that wander: strength at onset and level at arrest as one Gaussian process, each with a scatter of its own.

    y_i = mu_k + sum_c a_ck w_c(s_ci) + e_i,    e_i ~ N(0, sigma_k^2),    k = onset or arrest of slip i,

with every w_c of unit variance along a coordinate s_c (time, slip path or place): an Ornstein-Uhlenbeck process or
Matern-3/2. These are Markov, so that the likelihood is a Kalman filter's (Hartikainen & Sarkka 2010), linear in the
number of slips. The means mu_k have a flat prior and are integrated out (restricted likelihood): the filter runs over
the data and the two columns of the means at once, for its gains do not depend on the data (Rosenberg 1973, de Jong
1991).
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

from ...system import jax_settings  # noqa: F401  (before the first array)

# isort: split
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from ...errors import FitError, InputError

Array = NDArray[np.float64]
Kernel = Literal["ornstein-uhlenbeck", "matern-3/2"]
Coordinate = Literal["time", "slip path", "place"]
KEYS: dict[Coordinate, str] = {"time": "time", "slip path": "path", "place": "place"}
FEWEST = 12  # slips: two means and up to eight sizes and lengths are estimated from two levels each
ONSET, ARREST = 0, 1
NUGGET = 1e-9  # of a wander's variance, at which its covariance is positive definite in double precision
_LENGTHS = (1.0, 4.0, 16.0, 64.0)  # in mean distances of slips, where the search begins
_WIDEST = 12.0  # e-folds of sizes and length around where the search begins


@dataclass(frozen=True)
class Component:
    """One wander.

    Attributes:
        kernel: "ornstein-uhlenbeck" or "matern-3/2".
        coordinate: "time", "slip path" or "place".
        size: standard deviation at onset, and that at arrest with its sign relative to it, shape (2,).
        length: correlation length, in the coordinate's unit.
    """

    kernel: Kernel
    coordinate: Coordinate
    size: tuple[float, float] = (1.0, 1.0)
    length: float = 1.0


@dataclass(frozen=True)
class Wander:
    """Law of wandering levels.

    Attributes:
        components: wanders that add up; none: scatter alone.
        scatter: standard deviation of the scatter at onset and at arrest, shape (2,).
        std: standard deviations of what was fitted, in the order of :func:`packed`, from the curvature of the
            likelihood; empty where nothing was fitted.
        log_likelihood: restricted, natural logarithm; NaN where it was not fitted.
        aic: Akaike's criterion, corrected for few data (Hurvich & Tsai 1989); NaN where it was not fitted.
    """

    components: tuple[Component, ...]
    scatter: tuple[float, float] = (1.0, 1.0)
    std: tuple[float, ...] = field(default=())
    log_likelihood: float = math.nan
    aic: float = math.nan

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Coordinates of the components, each once."""
        return tuple(dict.fromkeys(c.coordinate for c in self.components))

    def __str__(self) -> str:
        return " + ".join(f"{c.kernel} in {c.coordinate}" for c in self.components) or "scatter alone"


@dataclass(frozen=True)
class Series:
    """Levels of n slips, onsets and arrests together, shape (2 n,) each.

    Args:
        coordinate: by name; none of them decreases.
        kind: ONSET or ARREST.
        value: levels, in any unit.
    """

    coordinate: dict[Coordinate, Array]
    kind: NDArray[np.intp]
    value: Array

    @classmethod
    def of(cls, arrays: Mapping[str, Array], coordinates: tuple[Coordinate, ...], number: int | None = None) -> Series:
        """The first slips of :func:`stickslip.inference.forecast.levels.level_arrays`, in the order of the coordinates.

        Raises:
            InputError: place together with another coordinate, which have no order in common.
        """
        if "place" in coordinates and len(coordinates) > 1:
            raise InputError("levels along place have another order than along time or slip path")

        def both(key: str) -> Array:
            name = ("{}_onset", "{}_arrest") if key else ("onset", "arrest")
            return np.stack([np.asarray(arrays[n.format(key)])[:number] for n in name], axis=1).ravel()

        value = both("")
        kind = np.arange(value.size) % 2
        along = {c: both(KEYS[c]) for c in coordinates or ("time",)}
        order = np.argsort(next(iter(along.values())), kind="stable")
        return cls({c: v[order] for c, v in along.items()}, kind[order], value[order])


def covariance(kernel: Kernel, distance: ArrayLike, length: float) -> Array:
    """Covariance of a wander of unit variance at distances not below zero (dense, for checks and few points)."""
    r = np.asarray(distance, float) / length
    if kernel == "ornstein-uhlenbeck":
        return np.exp(-r)
    return (1.0 + math.sqrt(3.0) * r) * np.exp(-math.sqrt(3.0) * r)


def _states(kernel: Kernel) -> int:
    return 2 if kernel == "matern-3/2" else 1


def _transition(kernels: tuple[Kernel, ...], r: Any, xp: Any) -> Any:
    """Matrix that carries the state over distances of ``r`` lengths; states are scaled to unit covariance at rest."""
    total = sum(map(_states, kernels))
    rows, before = [], 0
    for c, kernel in enumerate(kernels):
        if kernel == "matern-3/2":
            q = math.sqrt(3.0) * r[c]
            block = xp.exp(-q) * xp.stack([xp.stack([1.0 + q, q]), xp.stack([-q, 1.0 - q])])
        else:
            block = xp.exp(-r[c]) * xp.ones((1, 1))
        d = _states(kernel)
        rows.append(xp.concatenate([xp.zeros((d, before)), block, xp.zeros((d, total - before - d))], axis=1))
        before += d
    return xp.concatenate(rows) if rows else xp.zeros((0, 0))


def _row(kernels: tuple[Kernel, ...], sizes: Any, xp: Any) -> Any:
    """What of the state a level shows; sizes of every component, shape (components,)."""
    parts = []
    for c, kernel in enumerate(kernels):
        parts += [sizes[c], 0.0 * sizes[c]] if kernel == "matern-3/2" else [sizes[c]]
    return xp.stack(parts) if parts else xp.zeros(0)


def _ahead(step: Any, mean: Any, cov: Any, xp: Any) -> tuple[Any, Any]:
    """State (d, columns) and covariance (d, d) after a transition."""
    rest = xp.eye(cov.shape[0])
    return step @ mean, step @ (cov - rest) @ step.T + rest


def _take(mean: Any, cov: Any, seen: Any, row: Any, noise: Any) -> tuple[Any, Any, Any, Any]:
    """State after a level (and the columns of the means), its innovation and its variance."""
    to = cov @ seen
    variance = seen @ to + noise
    innovation = row - seen @ mean
    gain = to / variance
    return mean + gain[:, None] * innovation, cov - gain[:, None] * to, innovation, variance


def _sizes(theta: Any, number: int, xp: Any) -> tuple[Any, Any, Any]:
    """Sizes (components, 2), lengths (components,) and variances of the scatter (2,) of what the search moves."""
    own = theta[: 3 * number].reshape(number, 3)
    first = xp.exp(own[:, 0])
    return xp.stack([first, first * own[:, 1]], axis=1), xp.exp(own[:, 2]), xp.exp(2.0 * theta[3 * number :])


def packed(law: Wander) -> Array:
    """What a fit moves: of every component log size at onset, ratio of sizes, log length; then log scatter (2)."""
    own = [v for c in law.components for v in (math.log(c.size[0]), c.size[1] / c.size[0], math.log(c.length))]
    return np.array([*own, *np.log(law.scatter)])


@partial(jax.jit, static_argnames="kernels")
def _likelihood(theta: Any, kernels: tuple[Kernel, ...], gaps: Any, kind: Any, value: Any) -> Any:
    """Restricted log-likelihood; gaps of shape (n, components)."""
    size, length, noise = _sizes(theta, len(kernels), jnp)
    rows = jnp.concatenate([value[:, None], jax.nn.one_hot(kind, 2)], axis=1)
    d = sum(map(_states, kernels))
    seen = jnp.stack([_row(kernels, size[:, k], jnp) for k in (ONSET, ARREST)])

    def step(state: Any, now: Any) -> Any:
        mean, cov, products, logs = state
        gap, k, row = now
        mean, cov = _ahead(_transition(kernels, gap / length, jnp), mean, cov, jnp)
        mean, cov, innovation, variance = _take(mean, cov, seen[k], row, noise[k])
        products = products + jnp.outer(innovation, innovation) / variance
        return (mean, cov, products, logs + jnp.log(variance)), None

    start = (jnp.zeros((d, 3)), jnp.eye(d), jnp.zeros((3, 3)), 0.0)
    (_, _, products, logs), _ = jax.lax.scan(step, start, (gaps, kind, rows))
    normal, right = products[1:, 1:], products[1:, 0]
    rest = products[0, 0] - right @ jnp.linalg.solve(normal, right)
    free = value.size - 2
    return -0.5 * (logs + rest + jnp.linalg.slogdet(normal)[1] + free * jnp.log(2.0 * jnp.pi))


_gradient = jax.jit(jax.value_and_grad(_likelihood), static_argnames="kernels")


def _gaps(components: tuple[Component, ...], series: Series) -> Array:
    along = [np.diff(series.coordinate[c.coordinate], prepend=series.coordinate[c.coordinate][0]) for c in components]
    return np.stack(along, axis=1) if along else np.zeros((series.value.size, 0))


def log_likelihood(law: Wander, series: Series) -> float:
    """Restricted log-likelihood of a law, by a Kalman filter."""
    kernels = tuple(c.kernel for c in law.components)
    return float(_likelihood(packed(law), kernels, _gaps(law.components, series), series.kind, series.value))


def fit(arrays: Mapping[str, Array], components: tuple[Component, ...], number: int | None = None) -> Wander:
    """Sizes and lengths by maximum of the restricted likelihood.

    Args:
        arrays: levels of slips, as of :func:`stickslip.inference.forecast.levels.level_arrays`.
        components: kernel and coordinate of each wander; where there are two of one coordinate, the longer first.
        number: of slips that are fitted; default all.

    Raises:
        InputError: too few slips, or levels or coordinates that do not differ.
        FitError: the likelihood has no finite maximum.
    """
    series = Series.of(arrays, tuple(dict.fromkeys(c.coordinate for c in components)), number)
    slips = series.value.size // 2
    if slips < FEWEST:
        raise InputError(f"{slips} slips are too few for a wandering level", allowed=f"{FEWEST} slips or more",
                         hint="a longer record, or a smaller 'minimum_slip'")  # fmt: skip
    spread = np.array([series.value[series.kind == k].std() for k in (ONSET, ARREST)])
    raw = _gaps(components, series)
    distance = raw.sum(axis=0) / slips
    if not (spread > 0).all() or not (distance > 0).all():
        raise InputError("levels of all slips are the same, or all slips are at one place")
    unit, m = float(spread.max()), len(components)
    gaps, value, kernels = raw / distance, series.value / unit, tuple(c.kernel for c in components)
    scatter, first = np.log(0.5 * spread / unit), math.log(spread[0] / unit)

    def cost(theta: Array) -> tuple[float, Array]:
        v, g = _gradient(theta, kernels, gaps, series.kind, value)
        v, g = float(v), np.asarray(g)
        return (-v, -g) if math.isfinite(v) and np.isfinite(g).all() else (1e30, np.zeros_like(theta))

    begun = sorted((np.array([*s, *scatter]) for s in _starts(m, first)), key=lambda theta: cost(theta)[0])[:2]
    found = [
        minimize(cost, s, jac=True, method="L-BFGS-B", bounds=[(x - _WIDEST, x + _WIDEST) for x in s]) for s in begun
    ]
    best = min(found, key=lambda f: f.fun)
    if best.fun >= 1e30:
        raise FitError("no law of wandering levels has a finite likelihood here")
    size, length, noise = _sizes(best.x, m, np)
    made = tuple(
        Component(c.kernel, c.coordinate, (float(unit * s[0]), float(unit * s[1])), float(d * x))
        for c, s, x, d in zip(components, size, length, distance, strict=True)
    )
    top = float(-best.fun - (value.size - 2) * math.log(unit))
    k, n = best.x.size, value.size - 2
    aic = 2.0 * k - 2.0 * top + 2.0 * k * (k + 1) / max(n - k - 1, 1)
    deviation = unit * np.sqrt(noise)
    return Wander(made, (float(deviation[0]), float(deviation[1])), _errors(cost, best.x), top, aic)


def _starts(number: int, first: float) -> list[list[float]]:
    """Where searches begin: lengths, and signs of the wander at arrest."""
    if number == 0:
        return [[]]
    one = [[first, s, math.log(x)] for x in _LENGTHS for s in (1.0, -1.0)]
    if number == 1:
        return one
    return [[*a, first - 1.0, *b[1:]] for a in one for b in one if a[2] > b[2]]


def _errors(cost: Any, theta: Array) -> tuple[float, ...]:
    """Standard deviations from the curvature, by differences of the gradient; infinite where it is flat."""
    step = 1e-4
    curvature = np.array(
        [(cost(theta + step * e)[1] - cost(theta - step * e)[1]) / (2 * step) for e in np.eye(theta.size)]
    )
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    flat = values <= 1e-6
    own = vectors[:, ~flat] ** 2 @ (1.0 / values[~flat])
    own[(vectors[:, flat] ** 2 > 1e-6).any(axis=1)] = np.inf
    return tuple(np.sqrt(own).tolist())


Coordinates = Mapping[Coordinate, Any]


class Filter:
    """A law that takes up levels one after the other and predicts the next; for coordinates that never go back.

    Args:
        law: sizes and lengths.
    """

    def __init__(self, law: Wander) -> None:
        self._law, self._kernels = law, tuple(c.kernel for c in law.components)
        self._lengths = np.array([c.length for c in law.components])
        self._at: Array | None = None
        d = sum(map(_states, self._kernels))
        self._mean, self._cov, self._products = np.zeros((d, 3)), np.eye(d), np.zeros((3, 3))
        sizes = np.array([c.size for c in law.components]).reshape(-1, 2)
        self._seen = [_row(self._kernels, sizes[:, k], np) for k in (ONSET, ARREST)]

    def _where(self, at: Coordinates, points: int = 1) -> Array:
        """Distances from the last level in lengths, shape (components, points)."""
        out = np.zeros((len(self._kernels), points))
        for c, component in enumerate(self._law.components):
            if self._at is not None:
                out[c] = np.ravel(at[component.coordinate]) - self._at[c]
        if (out < 0).any():
            raise ValueError("a coordinate goes back")
        return out / self._lengths[:, None]

    def add(self, at: Coordinates, kind: int, value: float) -> None:
        """Take up a level at its coordinates."""
        mean, cov = _ahead(_transition(self._kernels, self._where(at)[:, 0], np), self._mean, self._cov, np)
        row = np.array([value, kind == ONSET, kind == ARREST], float)
        noise = self._law.scatter[kind] ** 2
        self._mean, self._cov, innovation, variance = _take(mean, cov, self._seen[kind], row, noise)
        self._products = self._products + np.outer(innovation, innovation) / variance
        self._at = np.array([float(at[c.coordinate]) for c in self._law.components])

    def predict(self, at: Coordinates, kind: int) -> tuple[Array, Array]:
        """Means and standard deviations of a level at coordinates (arrays of one shape), the means' errors included.

        Raises:
            ValueError: too few levels were taken up to know the means.
        """
        inverse, right = _means(self._products)
        shape = np.broadcast_shapes(*(np.shape(v) for v in at.values()))
        n = int(np.prod(shape))
        r = self._where(at, n)
        # what the state as it is now shows there, point by point: first rows of the transitions
        shown = np.zeros((n, self._mean.shape[0]))
        place, variance = 0, np.full(n, self._law.scatter[kind] ** 2)
        for c, component in enumerate(self._law.components):
            size = component.size[kind]
            if component.kernel == "matern-3/2":
                q = math.sqrt(3.0) * r[c]
                shown[:, place] = size * np.exp(-q) * (1.0 + q)
                shown[:, place + 1] = size * np.exp(-q) * q
            else:
                shown[:, place] = size * np.exp(-r[c])
            variance += size**2
            place += _states(component.kernel)
        variance += np.einsum("ni,ij,nj->n", shown, self._cov - np.eye(place), shown)
        known = shown @ self._mean
        column = np.eye(2)[kind] - known[:, 1:]
        middle = known[:, 0] + column @ (inverse @ right)
        variance += np.einsum("ni,ij,nj->n", column, inverse, column)
        return middle.reshape(shape), np.sqrt(variance).reshape(shape)


def _means(products: Array) -> tuple[Array, Array]:
    """Covariance of the means, and what it is multiplied with to give them."""
    if not (np.diag(products)[1:] > 0).all():
        raise ValueError("no level of each kind yet")
    return np.asarray(np.linalg.inv(products[1:, 1:])), products[1:, 0]


class Nearby:
    """As :class:`Filter`, for places that are passed again: from the nearest levels, by the dense formula.

    Args:
        law: sizes and lengths, along place alone.
        most: levels that are taken into account (Vecchia 1988).
    """

    def __init__(self, law: Wander, most: int = 200) -> None:
        self._law, self._most = law, most
        # of either kind, in the order of their places
        self._places: tuple[list[float], list[float]] = [], []
        self._values: tuple[list[float], list[float]] = [], []

    def add(self, at: Coordinates, kind: int, value: float) -> None:
        """Take up a level at its coordinates."""
        place = float(at["place"])
        i = bisect_right(self._places[kind], place)
        self._places[kind].insert(i, place)
        self._values[kind].insert(i, value)

    def predict(self, at: Coordinates, kind: int) -> tuple[Array, Array]:
        """Means and standard deviations of a level at coordinates (arrays of one shape), the means' errors included.

        Raises:
            ValueError: too few levels were taken up to know the means.
        """
        if not all(self._places):
            raise ValueError("no level of each kind yet")
        asked = np.asarray(at["place"], float)
        distinct, back = np.unique(asked, return_inverse=True)
        found = np.array([self._one(float(place), kind) for place in distinct])
        return found[:, 0][back].reshape(asked.shape), found[:, 1][back].reshape(asked.shape)

    def _one(self, coordinate: float, kind: int) -> tuple[float, float]:
        parts = [self._nearest(k, coordinate) for k in (ONSET, ARREST)]
        at, value = np.concatenate(parts, axis=1)
        of = np.repeat([ONSET, ARREST], [part.shape[1] for part in parts])
        law = self._law
        whole, to = np.diag(np.array(law.scatter)[of] ** 2), np.zeros(at.size)
        own = law.scatter[kind] ** 2
        for c in law.components:
            size = np.array(c.size)[of]
            whole += size[:, None] * covariance(c.kernel, np.abs(at[:, None] - at), c.length) * size
            whole += np.diag(NUGGET * size**2)  # places are passed again, and a fitted scatter may be next to nothing
            to += c.size[kind] * size * covariance(c.kernel, np.abs(at - coordinate), c.length)
            own += c.size[kind] ** 2
        columns = np.eye(2)[of]
        factor = cho_factor(whole, lower=True, overwrite_a=True, check_finite=False)
        solved = cho_solve(factor, np.column_stack([value, columns, to]), overwrite_b=True, check_finite=False)
        inverse = np.linalg.inv(columns.T @ solved[:, 1:3])
        means = inverse @ (columns.T @ solved[:, 0])
        column = np.eye(2)[kind] - to @ solved[:, 1:3]
        middle = to @ solved[:, 0] + column @ means
        variance = own - to @ solved[:, 3] + column @ inverse @ column
        return float(middle), math.sqrt(float(variance))

    def _nearest(self, kind: int, coordinate: float) -> Array:
        """Places of the nearest levels of a kind, and the levels, shape (2, n)."""
        places, most = self._places[kind], self._most // 2
        i = bisect_left(places, coordinate)
        around = slice(max(i - most, 0), i + most)
        both = np.array([places[around], self._values[kind][around]])
        return both[:, np.argsort(np.abs(both[0] - coordinate), kind="stable")[:most]]
