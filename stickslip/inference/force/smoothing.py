"""What of a reading is motion: slow noise, smoothed displacement and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d, uniform_filter1d
from scipy.optimize import isotonic_regression
from scipy.sparse import coo_array, csr_array

from ...data.segment import Event
from .scales import Scales

Array = NDArray[np.float64]
Index = NDArray[np.intp]
BACK = 5.0  # noise levels of one sample within which a step back is noise
STEPS = 6.0  # of the sensor that the block moves by while its velocity in the creep is found
DEGREE, LEAST = 4, 2  # of the polynomial for it, and windows at either side (where it ends, more at the other)


def unsteady(x: Array, t: Array, events: tuple[Event, ...], rate: float) -> float:
    """Slow noise of the reading (m): how far means over a hundredth of a stick stray from a line through two others."""
    found = []
    for before, event in pairwise(events):
        a = int(np.searchsorted(t, before.t_arrest + 0.4 * (event.t_onset - before.t_arrest)))
        b = int(np.searchsorted(t, before.t_arrest + 0.8 * (event.t_onset - before.t_arrest)))
        width = (b - a) // 40
        if width < 2:
            continue
        mean = x[a : a + 40 * width].reshape(40, width).mean(axis=1)
        found.append(np.median(np.abs(np.diff(mean, 2))) / 0.6745 / np.sqrt(6.0))
    return float(np.median(found)) if found else 0.0


class Bend(NamedTuple):
    """Weights for the samples around an arrest.

    Attributes:
        low: the first of these m samples.
        first: the first of the M samples that they are made of.
        slow, fast: see :class:`Smoother`, shape (m, M) both.
    """

    low: int
    first: int
    slow: Array
    fast: Array


@dataclass(frozen=True)
class Smoother:
    """Weights of the samples around one in its smoothed displacement.

    Attributes:
        slow, fast: of slow motion and of what is added to it, shape (2 h + 1,) both.
        gain: how much of that is added at every sample, shape (N,).
        bends: other weights where the block comes to rest.
    """

    slow: Array
    fast: Array
    gain: Array
    bends: tuple[Bend, ...] = ()

    @property
    def squares(self) -> Array:
        """Variance of the smoothed displacement over that of a sample, shape (N,)."""
        out = _squares(self.slow, self.fast, self.gain)
        for bend in self.bends:
            own = slice(bend.low, bend.low + len(bend.slow))
            out[own] = _squares(bend.slow, bend.fast, self.gain[own])
        return out

    def matrix(self, index: Index) -> csr_array:
        """From all samples to the smoothed displacement at some of them."""
        h, n = self.slow.size // 2, self.gain.size
        place = np.arange(index.size)
        parts = []
        for bend in self.bends:
            own = np.flatnonzero((index >= bend.low) & (index < bend.low + len(bend.slow)))
            at = index[own] - bend.low
            weights = bend.slow[at] + self.gain[index[own]][:, None] * bend.fast[at]
            parts.append((own, np.broadcast_to(bend.first + np.arange(weights.shape[1]), weights.shape), weights))
            place = place[~np.isin(place, own)]
        around = np.clip(index[place][:, None] + np.arange(-h, h + 1), 0, n - 1)
        parts.append((place, around, self.slow + self.gain[index[place]][:, None] * self.fast))
        rows = np.concatenate([np.repeat(own, weights.shape[1]) for own, _, weights in parts])
        columns, values = (np.concatenate([part[i].ravel() for part in parts]) for i in (1, 2))
        return coo_array((values, (rows, columns)), shape=(index.size, n)).tocsr()


def _squares(slow: Array, fast: Array, gain: Array) -> Array:
    one, both, two = ((a * b).sum(axis=-1) for a, b in ((slow, slow), (slow, fast), (fast, fast)))
    return np.asarray(one + gain * (2.0 * both + gain * two))


def smoothed(x: Array, noise: float, rate: float, times: Scales, arrests: Array) -> tuple[Array, Array, Smoother]:
    """Displacement and velocity where every sample counts, and how the former is made of the samples.

    At every sample a cubic and a ringing that grows or decays, over two of its periods (where none is detected, a cubic
    alone). A parabola would give the same displacement and, in a nucleation, a velocity that is a third too large. On
    top of them what a polynomial of the fourth degree over half a period adds, shrunk by as much as noise adds to it in
    squares. The noise of one sample, followed as motion, would be a path that weakens the contact and makes it young; a
    ringing that is smoothed away would be a force of the contact, which is stiff.

    Around an arrest there are two such functions, one before and one after it, with the same displacement, velocity and
    acceleration at the arrest: there a contact that slid begins to hold, and the force on the block has a kink. One
    function over it would be biased at every arrest, by a third of the noise of a sample.

    Args:
        x: samples (m), shape (N,).
        noise: of one (m).
        rate: of the samples (1/s).
        times: of the campaign.
        arrests: where the block comes to rest, in samples from the first, in order.
    """
    period = (times.ring or times.half) * rate
    long = round(2.0 * period if times.ring else period) // 2 * 2 + 1
    short = round(0.5 * period) // 2 * 2 + 1
    if long < (9 if times.ring else 5):  # too few samples for what would be fitted to them
        return x, np.gradient(x) * rate, Smoother(np.ones(1), np.zeros(1), np.zeros(x.size))
    wave = period if times.ring else None
    slow, drift = _local(np.arange(long) - long // 2, np.zeros(1), 3, wave)
    short, degree = (short, 4) if short >= 7 else (3, 2)
    close, run = _local(np.arange(short) - short // 2, np.zeros(1), degree)
    fast, rush = _beside(close, slow), _beside(run, drift)
    level = np.full(x.size, noise**2 * float((fast**2).sum()))
    added = correlate1d(x, fast[0], mode="nearest")
    followed, speed = correlate1d(x, slow[0], mode="nearest"), correlate1d(x, drift[0], mode="nearest")
    hurried = correlate1d(x, rush[0], mode="nearest")
    bends = []
    for at in _with_room(arrests, 2 * long, x.size):
        first = int(at) + 1 - long
        own, all_of_it = slice(int(at) + 1 - long // 2, int(at) + 1 + long // 2), x[first : first + 2 * long]
        values, slopes = _bent(long, long // 2, wave, round(8.0 * (at % 1.0)) / 8.0)
        centres = np.arange(own.start, own.stop) - first
        near, hasty = _centred(close[0], centres, 2 * long), _centred(run[0], centres, 2 * long)
        bends.append(Bend(own.start, first, values, near - values))
        level[own] = noise**2 * ((near - values) ** 2).sum(axis=1)
        added[own], followed[own] = (near - values) @ all_of_it, values @ all_of_it
        speed[own], hurried[own] = slopes @ all_of_it, (hasty - slopes) @ all_of_it
    over = round(period) // 2 * 2 + 1
    seen = np.maximum(uniform_filter1d(added**2, over), 1e-300)
    gain = np.sqrt(np.maximum(1.0 - uniform_filter1d(level, over) / seen, 0.0))
    smoother = Smoother(slow[0], fast[0], gain, tuple(bends))
    return followed + gain * added, (speed + gain * hurried) * rate, smoother


def _with_room(arrests: Array, room: int, n: int) -> list[float]:
    """Arrests with so many samples around them, half of them at either side, that hold no other arrest."""
    apart = np.diff(np.concatenate([[-np.inf], arrests, [np.inf]]))
    inside = (arrests >= 0.5 * room) & (arrests < n - 0.5 * room - 1)
    return [float(a) for a in arrests[inside & (apart[:-1] > 0.5 * room) & (apart[1:] > 0.5 * room)]]


@lru_cache(maxsize=64)
def _bent(side: int, near: int, period: float | None, after: float) -> tuple[Array, Array]:
    """Weights of the samples around an arrest in displacement and velocity near it, shape (2 near, 2 side) both.

    Args:
        side, near: samples at either side that count, and of which displacement and velocity are wanted.
        period: of the ringing (samples).
        after: by how much the arrest comes after the last sample before it (samples).
    """
    i = np.arange(2 * side) - (side - 1) - after
    return _local(i, i[side - near : side + near], 3, period, bent=True)


def _centred(weights: Array, centres: Index, length: int) -> Array:
    """The same weights around several samples of a window, shape (m, L)."""
    out = np.zeros((centres.size, length))
    first = centres - weights.size // 2
    out[np.arange(centres.size)[:, None], first[:, None] + np.arange(weights.size)] = weights
    return out


def _beside(short: Array, long: Array) -> Array:
    """Weights of a window less those of a longer one with the same middle, shape (1, L)."""
    return np.asarray(np.pad(short, ((0, 0), ((long.shape[1] - short.shape[1]) // 2,) * 2)) - long)


def _local(i: Any, at: Any, degree: int, period: float | None = None, bent: bool = False) -> tuple[Array, Array]:
    """Weights of samples in the values and the slopes (1/sample) of a function fitted to them, shape (m, L) both.

    A polynomial, and with a period (in samples) a wave whose amplitude changes linearly besides. A ``bent`` one is
    another after zero than before, with two derivatives in common there.

    Args:
        i: the samples, shape (L,).
        at: where values and slopes are wanted (samples), shape (m,).
        degree: of the polynomial.
        period: of the wave (samples).
        bent: whether it is bent at zero.
    """
    matrix, (values, slopes) = _functions(i, degree, period, bent)[0], _functions(at, degree, period, bent)
    scale = np.abs(matrix).max(axis=0)
    solved = np.linalg.pinv(matrix / scale)
    return np.asarray((values / scale) @ solved), np.asarray((slopes / scale) @ solved)


def _functions(i: Any, degree: int, period: float | None, bent: bool) -> tuple[Array, Array]:
    """Values of the functions of :func:`_local` and their slopes, shape (m, f) both."""
    i = np.asarray(i, float)[:, None]
    powers = np.arange(degree + 1)
    values: list[Array] = [i**powers]
    slopes: list[Array] = [powers * i ** np.maximum(powers - 1, 0)]
    if period is not None:
        turn = 2.0 * np.pi / period
        c, s = np.cos(turn * i), np.sin(turn * i)
        values.append(np.hstack([c, s, i * c, i * s]))
        slopes.append(np.hstack([-turn * s, turn * c, c - turn * i * s, s + turn * i * c]))
    if bent:
        after = np.where(i > 0.0, 1.0, 0.0)
        values.append(after * i**3)
        slopes.append(after * 3.0 * i**2)
    if bent and period is not None:  # each less its first powers up to the square
        t = turn * i
        values.append(after * np.hstack([c - 1.0 + 0.5 * t**2, s - t, i * (c - 1.0), i * (s - t)]))
        slopes.append(after * np.hstack([turn * (t - s), turn * (c - 1.0), c - 1.0 - t * s, s - t + t * (c - 1.0)]))
    return np.hstack(values), np.hstack(slopes)


def crept(
    t: Array, x: Array, weight: Array, stretch: Index, onset: Array, step: float, speed: Array, period: float
) -> Array:
    """Velocity where the block creeps and begins to slip (m/s), shape (n,), as the given ``speed`` elsewhere.

    The slope of a polynomial through the windows around one, so many that the block moves by some steps of its sensor
    in them: over two periods of the ringing alone, the velocity of a nucleation is that of the noise. It is one in the
    logarithm of the time that is left to the onset, in which a block creeps evenly that becomes ever faster. Windows of
    a stretch in which it does not move so far, or is as far within two periods, keep the ``speed``.

    Args:
        t, x: middles of the windows (s) and means of the reading (m).
        weight: samples of each.
        stretch: numbers windows between which nothing changes the motion suddenly; negative where there is none.
        onset: of the slip after each (s), NaN where none follows.
        step: of the sensor (m).
        speed: what else is known of the velocity (m/s), NaN where nothing is.
        period: of the ringing (s).
    """
    far, root, left = 0.5 * STEPS * step, np.sqrt(weight), (onset - t) / period
    course = np.where(np.isnan(left), t / period, -np.arcsinh(left))
    pace = np.where(np.isnan(left), 1.0, 1.0 / np.sqrt(1.0 + left**2)) / period
    out = np.where(np.isnan(speed), np.gradient(x, t), speed)
    for own in np.split(np.arange(t.size), np.flatnonzero(np.diff(stretch)) + 1):
        first, last = int(own[0]), int(own[-1])
        if stretch[first] < 0 or last - first < 2 * LEAST:
            continue
        for i in own:
            away = np.abs(x[first : last + 1] - x[i]) >= far
            before, after = np.flatnonzero(away[: i - first]), np.flatnonzero(away[i - first :])
            if not before.size and not after.size:
                continue
            low = max(first, min(first + int(before[-1]) if before.size else first, i - LEAST, last - 2 * LEAST))
            high = min(last, max(i + int(after[0]) if after.size else last, i + LEAST, first + 2 * LEAST))
            if t[high] - t[low] < 2.0 * period and np.isfinite(speed[i]):
                continue
            around, scale = slice(low, high + 1), max(course[i] - course[low], course[high] - course[i])
            powers = np.arange(min(DEGREE, high - low - 1) + 1)
            matrix = ((course[around, None] - course[i]) / scale) ** powers * root[around, None]
            out[i] = np.linalg.lstsq(matrix, x[around] * root[around], rcond=None)[0][1] / scale * pace[i]
    return out


def onward(x: Array, weight: Array, slow: NDArray[np.bool_], event: Index, noise: float) -> csr_array:
    """What takes the noise's steps back from the windows of every stick, shape (n, n): the block creeps one way.

    A step back by a nanometre would unload every element, and the next one forward would not load them again at once:
    noise would make the model weaker than the contact. Windows that go back share their mean. Where the block does go
    back by more than noise, nothing is changed.
    """
    block, share = np.arange(x.size), np.ones(x.size)
    edges = np.flatnonzero(np.diff(slow.astype(int)) | (np.diff(event) != 0)) + 1
    for piece in np.split(np.arange(x.size), edges):
        if piece.size < 3 or not slow[piece[0]]:
            continue
        rising = bool(x[piece[-1]] >= x[piece[0]])
        found = isotonic_regression(x[piece], weights=weight[piece], increasing=rising)
        if np.abs(found.x - x[piece]).max() < BACK * noise:
            sizes = np.diff(found.blocks)
            block[piece] = piece[0] + np.repeat(found.blocks[:-1], sizes)
            share[piece] = np.where(np.repeat(sizes, sizes) > 1, weight[piece] / np.repeat(found.weights, sizes), 1.0)
    shape = (x.size, x.size)
    means = coo_array((share, (block, np.arange(x.size))), shape=shape).tocsr()
    return csr_array(means[block])
