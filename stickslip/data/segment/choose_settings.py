"""Choosing the estimator's settings from the scale of a trace: rig, table-top or laboratory fault."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drive import Drive
from .kinematics import half_window, velocity, velocity_noise
from .records import Settings

Array = NDArray[np.float64]
_RIG_FACTOR, _RIG_FLOOR = 4.0, 1e-4


def choose_settings(
    time: Array,
    position: Array,
    drive: Drive | None,
    noise: float,
    resolution: float | None = None,
    *,
    minimum_slip: float | None = None,
    gain: float | None = None,
    unit: str = "m",
    slow: bool = False,
) -> Settings:
    """Settings for `pick`, so that noise cannot cross the threshold.

    The threshold is 4 v0 + 0.1 mm/s where slips are at least twice as fast; on slower or other scales (a laboratory
    fault, lengths in seconds of loading) it is 1.5 v0, raised above the noise. The window is the shortest for which
    the velocity's noise is a fifth of the threshold (a quarter of the drive's speed on other scales), widened to a
    twentieth as far as that leaves the fastest slip's velocity as it is.

    Args:
        time, position: s, m, shape (n,).
        drive: the load point, or None (then ten times the block's usual speed is the threshold).
        noise, resolution: of one sample of position, m.
        minimum_slip: m; default 10 noise levels (and `pick` leaves out what is below a tenth of the large slips).
        slow: choose for slow slips even where some are twice as fast as the rig's threshold.
    """
    step = float(np.median(np.diff(time[:200_001])))
    speed = _speed(time, drive)
    # a count that never changes hides up to half of itself
    spread = max(noise, 0.5 * (resolution or 0.0), 1e-15 * float(np.ptp(position)), 1e-300)
    relative = 0.1 if minimum_slip is None else 0.0
    smallest = 10 * spread if minimum_slip is None else minimum_slip
    most = max(1, min(time.size // 20, 20_000))

    def settings(half: int, threshold: float, usual: float) -> Settings:
        return Settings(half * step, threshold, usual, smallest, spread, gain=gain, unit=unit, relative=relative)

    if drive is None:
        return settings(*_undriven(time, position, step, spread, most))
    if unit == "m" and not slow:
        threshold = _RIG_FACTOR * speed + _RIG_FLOOR
        half = half_window(spread, step, threshold / 5, most)
        fastest = float(np.max(np.abs(velocity(time, position, half))))
        if fastest > 2 * threshold and velocity_noise(spread, half, step) <= threshold / 4:
            allowance = 4 * velocity_noise(spread, half, step)
            half = _widen(time, position, half, half_window(spread, step, threshold / 20, most), allowance)
            return settings(half, threshold, speed)
    half = half_window(spread, step, speed / 4 if speed > 0 else np.inf, most)
    return settings(half, max(1.5 * speed, speed + 5 * velocity_noise(spread, half, step)), speed)


def _widen(time: Array, position: Array, half: int, wanted: int, noise: float) -> int:
    """A wider window, up to ``wanted``, that lowers the greatest velocity by no more than a hundredth and its noise."""
    if wanted <= half:
        return half
    top = int(np.argmax(np.abs(velocity(time, position, half))))
    part = slice(max(top - 20 * wanted, 0), top + 20 * wanted)
    fastest = float(np.abs(velocity(time[part], position[part], half)).max()) - noise
    while half < wanted:
        wider = min(half + max(1, half // 4), wanted)
        if float(np.abs(velocity(time[part], position[part], wider)).max()) < 0.99 * fastest:
            break
        half = wider
    return half


def _undriven(time: Array, position: Array, step: float, noise: float, most: int) -> tuple[int, float, float]:
    """Half window, threshold and speed where the block is loaded by a force and there is no drive.

    The threshold is ten times the usual speed of the block, or half its greatest.
    """
    half = half_window(noise, step, abs(float(np.ptp(position))) / float(time[-1] - time[0]), most)
    speeds = np.abs(velocity(time, position, half))
    usual, greatest = float(np.median(speeds)), float(speeds.max())
    lowest = usual + 5 * velocity_noise(noise, half, step)
    threshold = max(lowest, min(10 * usual, 0.5 * greatest))
    return half, threshold, 0.5 * threshold


def _speed(time: Array, drive: Drive | None) -> float:
    """Speed of the drive that 95 % of its moving time does not exceed, m/s; 0 without a drive."""
    if drive is None:
        return 0.0
    edges = np.unique(np.clip(drive.times, time[0], time[-1]))
    if edges.size < 2:
        edges = time[[0, -1]]
    length = np.diff(edges)
    speeds = np.abs(np.diff(drive.position(edges)) / length)
    moving = speeds > 0.05 * drive.speed
    if not moving.any():
        return drive.speed
    order = np.argsort(speeds[moving])
    share = np.cumsum(length[moving][order])
    return float(speeds[moving][order][np.searchsorted(share, 0.95 * share[-1])])
