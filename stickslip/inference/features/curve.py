"""A reading as a function of time, made of a model's steps or of measured samples, with one set of questions."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from ...simulation.shooting import Track
from ...simulation.solve.trajectory import hermite

_GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 4 / 9), (0.5 + 0.15**0.5, 5 / 18))


class Curve(Protocol):
    """What features ask of a cycle."""

    @property
    def top(self) -> tuple[Any, Any]:
        """Time (s) and reading (m) of the arrest that ends the cycle."""

    def value(self, t: Any) -> Any:
        """Reading (m) at times ``t`` (s)."""

    def mean(self, t: Any, width: Any) -> Any:
        """Mean reading (m) over windows of ``width`` (s) around ``t`` (s)."""

    def rise(self, levels: Any, after: Any) -> Any:
        """First times (s) later than ``after`` at which the reading passes ``levels`` (m)."""


class StepCurve(NamedTuple):
    """The model's reading: cubic between accepted steps."""

    track: Track

    def _at(self, i: Any, s: Any) -> Any:
        k = self.track
        h, dx = k.t[i + 1] - k.t[i], k.x[i + 1] - k.x[i]
        bend = hermite(s, h, dx, k.v[i], k.v[i + 1]) - s * dx
        return k.reading[i] + s * (k.reading[i + 1] - k.reading[i]) + bend

    def value(self, t: Any) -> Any:
        k = self.track
        i = jnp.clip(jnp.searchsorted(k.t, t, side="right") - 1, 0, k.t.size - 2)
        h = k.t[i + 1] - k.t[i]
        s = jnp.clip(jnp.where(h > 0, (t - k.t[i]) / jnp.where(h > 0, h, 1.0), 0.0), 0.0, 1.0)
        return self._at(i, s)

    def mean(self, t: Any, width: Any) -> Any:
        return sum(w * self.value(t + (g - 0.5) * width) for g, w in _GAUSS)

    def rise(self, levels: Any, after: Any) -> Any:
        k = self.track
        levels = jnp.asarray(levels)
        above = (k.reading[None, :] >= levels[:, None]) & (k.t[None, :] > after)
        j = jnp.clip(jnp.argmax(above, axis=1), 1, k.t.size - 1)
        j = jnp.where(jnp.any(above, axis=1), j, k.t.size - 1)
        i = j - 1

        def halve(_: int, bracket: tuple) -> tuple:
            low, high = bracket
            mid = 0.5 * (low + high)
            below = self._at(i, mid) < levels
            return jnp.where(below, mid, low), jnp.where(below, high, mid)

        low, high = jax.lax.fori_loop(0, 24, halve, (jnp.zeros(levels.shape), jnp.ones(levels.shape)))
        return k.t[i] + 0.5 * (low + high) * (k.t[j] - k.t[i])

    @property
    def top(self) -> tuple[Any, Any]:
        return self.track.arrest, self.value(self.track.arrest)


class SampledCurve:
    """A measured reading: samples of one cycle and some beyond it.

    Args:
        t: times (s), shape (n,), increasing.
        y: readings (m), shape (n,).
        arrest: estimated time of the arrest that ends the cycle (s), or None where the cycle has no slip.
        width: window (s) of the parabola through the arrest.
    """

    def __init__(self, t: np.ndarray, y: np.ndarray, arrest: float | None, width: float) -> None:
        self.t, self.y = t, y
        steps = 0.5 * (y[1:] + y[:-1]) * np.diff(t)
        self._sum = np.concatenate([[0.0], np.cumsum(steps)])
        self.top = (t[-1], y[-1]) if arrest is None else _parabola(t, y, arrest, width)

    def value(self, t: Any) -> np.ndarray:
        return np.interp(t, self.t, self.y)

    def mean(self, t: Any, width: Any) -> np.ndarray:
        a = np.clip(t - 0.5 * width, self.t[0], self.t[-1])
        b = np.clip(t + 0.5 * width, self.t[0], self.t[-1])
        wide = b - a
        exact = wide > 0
        area = np.interp(b, self.t, self._sum) - np.interp(a, self.t, self._sum)
        return np.where(exact, area / np.where(exact, wide, 1.0), self.value(t))

    def rise(self, levels: Any, after: Any) -> np.ndarray:
        first = int(np.searchsorted(self.t, after))
        y, t = self.y[first:], self.t[first:]
        if y.size < 2:  # the cycle is over before that
            return np.full(np.shape(levels), np.nan)
        top = max(int(np.searchsorted(t, self.top[0], side="right")), 1)
        times = []
        for level in np.asarray(levels):
            # the last passage before the top: noise reaches a low level long before the block does
            below = np.flatnonzero(y[:top] < level)
            j = int(below[-1]) + 1 if below.size else 1
            j = min(max(j, 1), y.size - 1)
            rise = y[j] - y[j - 1]
            s = (level - y[j - 1]) / rise if rise > 0 else 1.0
            times.append(t[j - 1] + np.clip(s, 0.0, 1.0) * (t[j] - t[j - 1]))
        return np.array(times)


def _parabola(t: np.ndarray, y: np.ndarray, near: float, width: float) -> tuple[float, float]:
    """Top of the parabola through the samples around ``near``; the largest sample where there is no top."""
    inside = np.flatnonzero(np.abs(t - near) <= 3 * width)
    if inside.size == 0:
        return near, float(np.interp(near, t, y))
    centre = t[inside[np.argmax(y[inside])]]
    inside = np.flatnonzero(np.abs(t - centre) <= width)
    if inside.size < 5:
        return centre, float(np.interp(centre, t, y))
    s = (t[inside] - centre) / width
    c, b, a = np.polynomial.polynomial.polyfit(s, y[inside], 2)
    if a >= 0 or abs(b) > 2 * abs(a):
        return centre, float(np.interp(centre, t, y))
    at = -b / (2 * a)
    return centre + at * width, c + b * at + a * at * at
