"""Position and velocity of the block from what was measured, at a resolution the counts allow."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..drive import Drive
from ..trace import Trace

Array = NDArray[np.float64]
_CHUNK = 1 << 14


def velocity(time: Array, position: Array, half: int) -> Array:
    """Velocity at each sample: mean of the ``half`` samples after it minus mean of those before, over the time between.

    With half = 1 it is the central difference. Averages over windows, because a count of 8 nm lasts many samples
    during creep and the difference of two raw counts says nothing. At the ends the windows shrink. Its standard
    deviation for white noise s and step dt is ``s sqrt(2/half) / ((half + 1) dt)``.

    Args:
        time, position: s and m, shape (n,).
        half: samples on each side.
    """
    n = position.size
    half = max(1, min(half, (n - 1) // 2))
    result = np.empty(n)
    if half == 1:
        result[1:-1] = position[2:] - position[:-2]
        result[1:-1] /= time[2:] - time[:-2]
    else:
        for start in range(half, n - half, _CHUNK):
            stop = min(start + _CHUNK, n - half)
            result[start:stop] = _chunk(time, position, half, start, stop)
    for i in (*range(half), *range(n - half, n)):
        result[i] = _edge(time, position, half, i)
    return result


def _chunk(time: Array, position: Array, half: int, start: int, stop: int) -> Array:
    # sums run over one chunk only, counted from its first sample: running sums over a long record lose digits
    part = slice(start - half, stop + half)
    differences = []
    for values in (position[part], time[part]):
        total = np.concatenate([[0.0], np.cumsum(values - values[0])])
        m = stop - start
        after = total[2 * half + 1 : 2 * half + 1 + m] - total[half + 1 : half + 1 + m]
        before = total[half : half + m] - total[:m]
        differences.append(after - before)
    return differences[0] / differences[1]


def _edge(time: Array, position: Array, half: int, i: int) -> float:
    before = slice(max(i - half, 0), i) if i else slice(0, 1)
    after = slice(i + 1, i + 1 + half) if i < position.size - 1 else slice(i, i + 1)
    gap = float(time[after].mean() - time[before].mean())
    return float(position[after].mean() - position[before].mean()) / gap


def velocity_noise(noise: float, half: int, step: float) -> float:
    """Standard deviation of `velocity` for white noise of one sample (m) at a sampling step (s), m/s."""
    return noise * math.sqrt(2.0 / half) / ((half + 1) * step)


def half_window(noise: float, step: float, wanted: float, most: int) -> int:
    """Fewest samples on each side for which the velocity's noise is at most ``wanted`` (m/s)."""
    half = 1
    while half < most and velocity_noise(noise, half, step) > wanted:
        half += max(1, half // 8)
    return min(half, max(most, 1))


def position_at(time: Array, position: Array, moment: float, half: int) -> float:
    """Position at a moment, by a straight line through the samples within ``half`` of it."""
    i = int(np.clip(np.searchsorted(time, moment), 1, time.size - 1))
    low, high = max(i - half, 0), min(i + half, time.size)
    t, x = time[low:high] - moment, position[low:high]
    if t.size == 2:
        return float(x[0] - t[0] * (x[1] - x[0]) / (t[1] - t[0]))
    centre = t.mean()
    return float(x.mean() - centre * np.sum((t - centre) * x) / np.sum((t - centre) ** 2))


def block_motion(
    trace: Trace, stiffness: float | None = None, gain: float | None = None
) -> tuple[Array, Drive | None, float | None, str]:
    """The block's position as well as the trace tells it.

    Displacement as measured; else the integral of velocity; else ``drive - F / c_s``. Where the spring's stiffness is
    not known its place is taken by the rate of loading (so that the block stands still in early stick), and where the
    drive is not known either, lengths are seconds of loading: enough to find events.

    Args:
        stiffness: N/m; default the trace's.
        gain: elongation gain found before on this trace, to be used again instead.

    Returns:
        position (m, shape (n,)), drive, gain (N per unit of length, None unless force was used), unit of length.
    """
    if trace.displacement is not None:
        return trace.displacement, trace.drive, None, "m"
    if trace.velocity is not None:
        middle = 0.5 * (trace.velocity[1:] + trace.velocity[:-1]) * np.diff(trace.time)
        return np.concatenate([[0.0], np.cumsum(middle)]), trace.drive, None, "m"
    assert trace.spring_force is not None  # a trace has one of the three
    drive, unit, level = trace.drive, "m", trace.noise or 0.0
    gain = gain or stiffness or trace.spring_stiffness
    if drive is None or drive.speed == 0:
        rate = loading_rate(trace.time, trace.spring_force, level)
        drive = Drive.constant(math.copysign(1.0, rate), float(trace.time[0]), float(trace.time[-1]))
        gain, unit = abs(rate) or 1.0, "s of loading"
    if gain is None:
        gain = abs(loading_rate(trace.time, trace.spring_force, level, drive)) or 1.0
    position = np.asarray(drive.position(trace.time))
    if not position.flags.writeable:
        position = position.copy()
    position -= trace.spring_force / gain
    return position, drive, gain, unit


def loading_rate(time: Array, force: Array, noise: float, drive: Drive | None = None) -> float:
    """How fast the force builds up while the block sticks: N for each metre of drive, or N/s without a drive.

    The upper quartile of the slopes of the commoner sign. Slopes are between means over blocks long enough for their
    noise to be an eighth of the usual slope. Where these slopes scatter too much to speak of a build-up (steady
    sliding, velocity steps, loops) it is the steepest, so that fluctuations of the force do not count as motion.
    """
    size = 4
    along = time if drive is None else drive.position(time)
    while True:
        blocks = force.size // size
        if blocks < 3:
            return float(force[-1] - force[0]) / (float(along[-1] - along[0]) or 1.0)
        means, places = (values[: blocks * size].reshape(blocks, size).mean(axis=1) for values in (force, along))
        rises, runs = np.diff(means), np.diff(places)
        moving = np.abs(runs) > 0.2 * np.quantile(np.abs(runs), 0.9)
        slopes = rises[moving] / runs[moving]
        if slopes.size == 0:
            return 0.0
        usual = float(np.median(np.abs(rises[moving])))
        if usual > 8 * noise * math.sqrt(2.0 / size) or blocks < 50:
            break
        size *= 2
    sign = 1.0 if drive is not None or np.count_nonzero(slopes > 0) >= np.count_nonzero(slopes < 0) else -1.0
    same = np.abs(slopes[sign * slopes > 0])
    if same.size == 0:
        return 0.0
    quartiles = np.quantile(same, [0.25, 0.5, 0.75])
    steady = quartiles[2] - quartiles[0] < 0.9 * quartiles[1]
    return sign * float(quartiles[2] if steady else same.max())
