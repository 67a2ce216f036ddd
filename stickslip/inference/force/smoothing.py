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
        slow, fast: of slow motion and of what is added to it, shape (2 h + 1,) both.
        gain: how much of that is added at every sample, shape (N,).
    """

    slow: Array
    fast: Array
    gain: Array

    def matrix(self, index: Index) -> csr_array:
        """From all samples to the smoothed displacement at some of them."""
        h, n = self.slow.size // 2, self.gain.size
        around = np.clip(index[:, None] + np.arange(-h, h + 1), 0, n - 1)
        weights = self.slow + self.gain[index][:, None] * self.fast
        rows = np.repeat(np.arange(index.size), 2 * h + 1)
        return coo_array((weights.ravel(), (rows, around.ravel())), shape=(index.size, n)).tocsr()


def smoothed(x: Array, noise: float, rate: float, times: Scales) -> tuple[Array, Array, Smoother]:
    """Displacement and velocity where every sample counts, and how the former is made of the samples.

    At every sample a cubic and a ringing that grows or decays, over two of its periods (where none is heard, a cubic
    alone). A parabola would give the same displacement and, in a nucleation, a velocity that is a third too large. On
    top of them what a polynomial of the fourth degree over half a period adds, shrunk by as much as noise adds to it in
    squares. The noise of one sample, taken for motion, would be a path that weakens the contact and makes it young; a
    ringing that is smoothed away would be a force of the contact, which is stiff.
    """
    period = (times.ring or times.half) * rate
    long = round(2.0 * period if times.ring else period) // 2 * 2 + 1
    short = round(0.5 * period) // 2 * 2 + 1
    if long < (9 if times.ring else 5):  # too few samples for what would be fitted to them
        return x, np.gradient(x) * rate, Smoother(np.ones(1), np.zeros(1), np.zeros(x.size))
    slow, drift = _local(long, 3, period if times.ring else None)
    close, run = _local(short, 4) if short >= 7 else _local(3, 2)
    pad = (long - close.size) // 2
    fast, rush = np.pad(close, pad) - slow, np.pad(run, pad) - drift
    added = correlate1d(x, fast, mode="nearest")
    level = noise**2 * float((fast**2).sum())
    seen = np.maximum(uniform_filter1d(added**2, round(period) // 2 * 2 + 1), 1e-300)
    gain = np.sqrt(np.maximum(1.0 - level / seen, 0.0))
    followed = correlate1d(x, slow, mode="nearest") + gain * added
    speed = correlate1d(x, drift, mode="nearest") + gain * correlate1d(x, rush, mode="nearest")
    return followed, speed * rate, Smoother(slow, fast, gain)


def _local(length: int, degree: int, period: float | None = None) -> tuple[Array, Array]:
    """Weights of the samples around one in the value and the slope (1/sample) there of a function fitted to them.

    A polynomial, and with a period (in samples) a wave whose amplitude changes linearly besides.
    """
    i = np.arange(length) - length // 2
    columns = [i.astype(float) ** k for k in range(degree + 1)]
    value, slope = np.eye(degree + 1)[:2]
    if period is not None:
        turn = 2.0 * np.pi / period
        columns += [np.cos(turn * i), np.sin(turn * i), i * np.cos(turn * i), i * np.sin(turn * i)]
        value, slope = np.append(value, [1.0, 0.0, 0.0, 0.0]), np.append(slope, [0.0, turn, 1.0, 0.0])
    matrix = np.stack(columns, axis=1)
    scale = np.abs(matrix).max(axis=0)
    solved = np.linalg.pinv(matrix / scale)
    return np.asarray((value / scale) @ solved), np.asarray((slope / scale) @ solved)


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
