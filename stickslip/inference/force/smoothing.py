"""What of a reading is motion: slow noise, smoothed displacement and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

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


@dataclass(frozen=True)
class Smoother:
    """Weights of the samples around one in its smoothed displacement.

    Attributes:
        slow, fast: of slow motion and of what is added to it, by where a sample lies in its window, shape (L, L) both.
        first: sample that the window of every one begins with, shape (N,).
        gain: how much is added at every sample, shape (N,).
    """

    slow: Array
    fast: Array
    first: Index
    gain: Array

    @property
    def squares(self) -> Array:
        """Variance of the smoothed displacement over that of a sample, shape (N,)."""
        place = np.arange(self.gain.size) - self.first
        one, both, two = (self.slow**2).sum(1), (self.slow * self.fast).sum(1), (self.fast**2).sum(1)
        return np.asarray(one[place] + self.gain * (2.0 * both[place] + self.gain * two[place]))

    def matrix(self, index: Index) -> csr_array:
        """From all samples to the smoothed displacement at some of them."""
        length, n = len(self.slow), self.gain.size
        first = self.first[index]
        around = np.minimum(first[:, None] + np.arange(length), n - 1)
        weights = self.slow[index - first] + self.gain[index][:, None] * self.fast[index - first]
        rows = np.repeat(np.arange(index.size), length)
        return coo_array((weights.ravel(), (rows, around.ravel())), shape=(index.size, n)).tocsr()


def smoothed(x: Array, noise: float, rate: float, times: Scales, breaks: Index) -> tuple[Array, Array, Smoother]:
    """Displacement and velocity where every sample counts, and how the former is made of the samples.

    At every sample a cubic and a ringing that grows or decays, over two of its periods (where none is heard, a cubic
    alone). A parabola would give the same displacement and, in a nucleation, a velocity that is a third too large. On
    top of them what a polynomial of the fourth degree over half a period adds, shrunk by as much as noise adds to it in
    squares. The noise of one sample, taken for motion, would be a path that weakens the contact and makes it young; a
    ringing that is smoothed away would be a force of the contact, which is stiff.

    No window reaches over a break, an arrest: there a contact that slid begins to hold, and no function that is smooth
    describes both sides (the mean over it is off alike at every arrest, by a fifth of the noise of one sample).

    Args:
        x: samples (m), shape (N,).
        noise: of one (m).
        rate: of the samples (1/s).
        times: of the campaign.
        breaks: first samples after the breaks, in order.
    """
    period = (times.ring or times.half) * rate
    long = round(2.0 * period if times.ring else period) // 2 * 2 + 1
    short = round(0.5 * period) // 2 * 2 + 1
    if long < (9 if times.ring else 5) or x.size < long:  # too few samples for what would be fitted to them
        alone = Smoother(np.ones((1, 1)), np.zeros((1, 1)), np.arange(x.size), np.zeros(x.size))
        return x, np.gradient(x) * rate, alone
    slow, drift = _local(long, 3, period if times.ring else None)
    close, run = _within(long, *(_local(short, 4) if short >= 7 else _local(3, 2)))
    fast, rush = close - slow, run - drift
    first = _windows(x.size, long, breaks)
    place = np.arange(x.size) - first
    added = _applied(fast, x, first)
    over = round(period) // 2 * 2 + 1
    level = uniform_filter1d(noise**2 * (fast**2).sum(axis=1)[place], over)
    seen = np.maximum(uniform_filter1d(added**2, over), 1e-300)
    gain = np.sqrt(np.maximum(1.0 - level / seen, 0.0))
    followed = _applied(slow, x, first) + gain * added
    speed = _applied(drift, x, first) + gain * _applied(rush, x, first)
    return followed, speed * rate, Smoother(slow, fast, first, gain)


def _windows(n: int, length: int, breaks: Index) -> Index:
    """First sample of the window of every sample, in its middle where no break is near, shape (n,).

    Breaks that leave no room for a window between them are none.
    """
    edges = [0]
    for at in breaks.tolist():
        if at - edges[-1] >= length and n - at >= length:
            edges.append(at)
    low = np.repeat(edges, np.diff([*edges, n]))
    high = np.repeat([*edges[1:], n], np.diff([*edges, n])) - length
    return np.clip(np.arange(n) - length // 2, low, high)


def _applied(weights: Array, x: Array, first: Index) -> Array:
    """What weights (L, L), by where a sample lies in its window, give of the samples, shape (N,)."""
    length = len(weights)
    out = correlate1d(x, weights[length // 2], mode="nearest")
    place = np.arange(x.size) - first
    aside = np.flatnonzero(place != length // 2)
    out[aside] = (weights[place[aside]] * x[first[aside][:, None] + np.arange(length)]).sum(axis=1)
    return out


def _within(length: int, value: Array, slope: Array) -> tuple[Array, Array]:
    """Weights of shorter windows within longer ones, as much in their middles as there is room, shape (L, L) both."""
    short = len(value)
    out = np.zeros((2, length, length))
    for i in range(length):
        at = min(max(i - short // 2, 0), length - short)
        out[0, i, at : at + short], out[1, i, at : at + short] = value[i - at], slope[i - at]
    return out[0], out[1]


def _local(length: int, degree: int, period: float | None = None) -> tuple[Array, Array]:
    """Weights of the samples of a window in the value and the slope (1/sample) at each of them of a function fitted.

    A polynomial, and with a period (in samples) a wave whose amplitude changes linearly besides. Shape (L, L) both.
    """
    i = np.arange(length) - length // 2
    powers = np.arange(degree + 1)
    columns, slopes = i[:, None] ** powers.astype(float), powers * i[:, None] ** np.maximum(powers - 1.0, 0.0)
    if period is not None:
        turn = 2.0 * np.pi / period
        c, s = np.cos(turn * i), np.sin(turn * i)
        columns = np.column_stack([columns, c, s, i * c, i * s])
        slopes = np.column_stack([slopes, -turn * s, turn * c, c - turn * i * s, s + turn * i * c])
    scale = np.abs(columns).max(axis=0)
    solved = np.linalg.pinv(columns / scale)
    return np.asarray((columns / scale) @ solved), np.asarray((slopes / scale) @ solved)


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
