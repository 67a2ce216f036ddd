"""Periodic motion while the block sticks (ripple of the drive, hum, vibration): lines of one spectrum over all sticks.

The sticks keep their place in the record, so a ripple that goes on through the slips adds up in phase over the whole
run, and a line of a few nanometres stands out of micrometres of creep and noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from ..trace import Trace
from .kinematics import block_motion
from .records import Segmentation

_RATE = 1000.0  # Hz, what faster records are averaged down to
_HIGHEST = 200.0  # Hz
_LEAST_STICKS, _LINES, _APART = 12, 4, 1.2  # fewer sticks of similar course make lines of their own
_MARGIN = 1.3  # on the highest line that noise alone makes
_SIDEBANDS = 2.6  # of a line, in units of one over the recurrence time, within which the gaps of the slips blur it
_FAINT = 0.05  # lines below this share of the noise of one sample are not reported
_POINTS = 3000
_GRID = np.linspace(-1, 1, 301)


def stick_ripple(trace: Trace, found: Segmentation) -> dict[str, Any] | None:
    """Lines in the spectrum of the position in all sticks, or None where there are too few sticks.

    Each stick is freed from a cubic in time and from the course that all sticks share (creep), and tapered. A line is a
    sum over three neighbouring frequencies that exceeds 1.3 times what the largest of as many sums of noise would be.

    Returns:
        ``lines``: list of period (s), amplitude (in ``unit``) and prominence, the strongest first; ``unit``;
        ``frequency`` (Hz) and ``amplitude`` arrays for a picture (largest of each bin).
    """
    pieces = _residues(trace, found)
    if pieces is None:
        return None
    rest, sticks, taper, rate, unit = pieces
    n = rest.size
    lengths = [(high - low) / rate for low, high in sticks]
    frequency = np.fft.rfftfreq(n, 1 / rate)
    power = np.convolve(np.abs(np.fft.rfft(rest)) ** 2 * 4.0 / taper**2, np.ones(3), mode="same")
    # a cubic takes out what is slower than one and a half waves in a stick
    band = (frequency > 2.0 / float(np.median(lengths))) & (frequency < min(_HIGHEST, 0.4 * rate))
    if band.sum() < 200:
        return None
    frequency, power = frequency[band], power[band]
    prominence = power / np.maximum(median_filter(power, size=min(401, band.sum() // 2 * 2 - 1)), 1e-300)
    count = float(frequency.size)
    # largest of `count` sums of three exponential powers, over their median
    limit = _MARGIN * (np.log(count) + 2 * np.log(np.log(count))) / 2.674
    sideband = _SIDEBANDS / float(np.median([event.recurrence for event in found.events[1:]]))
    lines: list[dict[str, float]] = []
    for i in np.argsort(-prominence):
        if prominence[i] < limit or len(lines) == _LINES:
            break
        if power[i] < (_FAINT * found.settings.noise) ** 2:
            continue
        if not any(_belongs(float(frequency[i]), float(np.sqrt(power[i])), x, sideband) for x in lines):
            lines.append(
                {
                    "period": float(1.0 / frequency[i]),
                    "amplitude": float(np.sqrt(power[i])),
                    "prominence": float(prominence[i]),
                }
            )
    size = -(-frequency.size // _POINTS)
    usable = frequency.size // size * size
    return {
        "lines": lines,
        "unit": unit,
        "frequency": frequency[:usable].reshape(-1, size).mean(axis=1),
        "amplitude": np.sqrt(power[:usable].reshape(-1, size).max(axis=1)),
    }


def stick_spectrum(trace: Trace, found: Segmentation) -> tuple[np.ndarray, np.ndarray, int] | None:
    """The mean of the sticks' spectra without their phases: it shows a ripple whose phase wanders as well.

    Returns:
        Frequencies (Hz), amplitudes (root of the mean square, in the unit of the motion) and the number of sticks, or
        None where there are too few.
    """
    pieces = _residues(trace, found)
    if pieces is None:
        return None
    rest, sticks, _, rate, _ = pieces
    size = 4 * 2 ** int(np.ceil(np.log2(max(high - low for low, high in sticks))))
    power = [
        np.abs(2.0 * np.fft.rfft(rest[low:high], size) / np.sum(np.hanning(high - low))) ** 2 for low, high in sticks
    ]
    return np.fft.rfftfreq(size, 1.0 / rate), np.sqrt(np.mean(power, axis=0)), len(sticks)


def _residues(trace: Trace, found: Segmentation) -> tuple[np.ndarray, list[tuple[int, int]], float, float, str] | None:
    """What is left of the sticks: averaged samples, where they lie, the sum of the tapers, the rate, the unit."""
    position, _, _, unit = block_motion(trace, gain=found.settings.gain)
    block = max(1, int(trace.sampling_rate // _RATE))
    n = trace.time.size // block
    time, position = (a[: n * block].reshape(n, block).mean(axis=1) for a in (trace.time, position))
    rate = trace.sampling_rate / block
    rest, sticks = np.zeros(n), []
    for event in found.events[1:]:
        length = event.stick_time
        if not np.isfinite(length) or event.holds:
            continue
        begin = event.t_onset - length
        low, high = np.searchsorted(time, [begin + 0.12 * length, begin + 0.85 * length])
        if high - low < 64:
            continue
        x, y = np.linspace(-1, 1, high - low), position[low:high]
        rest[low:high] = y - np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyfit(x, y, 3))
        sticks.append((int(low), int(high)))
    if len(sticks) < _LEAST_STICKS:
        return None
    return rest, sticks, _tapered(rest, sticks), rate, unit


def _belongs(frequency: float, amplitude: float, line: dict[str, float], sideband: float) -> bool:
    """Whether a line is part of a known one: beside it, or one of the sidebands that the slips cut out of it."""
    ratio = frequency * line["period"]
    beside = max(ratio, 1 / ratio) < _APART
    return beside or (abs(frequency - 1 / line["period"]) < sideband and amplitude < 0.75 * line["amplitude"])


def _tapered(rest: np.ndarray, sticks: list[tuple[int, int]]) -> float:
    """Take the mean course of all sticks out of each and taper it, in place; returns the sum of the tapers."""
    mean = np.mean([np.interp(_GRID, np.linspace(-1, 1, b - a), rest[a:b]) for a, b in sticks], axis=0)
    total = 0.0
    for a, b in sticks:
        window = np.hanning(b - a)
        rest[a:b] = (rest[a:b] - np.interp(np.linspace(-1, 1, b - a), _GRID, mean)) * window
        total += float(window.sum())
    return total
