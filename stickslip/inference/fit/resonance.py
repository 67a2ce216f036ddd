"""The contact's resonance, detected in the ringing after the arrests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from ...data.segment import Event, Segmentation
from ...data.trace import Trace

Array = NDArray[np.float64]
SKIPPED = 1e-3  # s after an arrest that are no ringing yet
LONG = 0.03  # s after an arrest in which ringing is sought
SHORT = (0.015, 0.008)  # s, where the ringing may have died before the long window is half over
LOWEST = 60.0  # Hz
PERIODS = 3.0  # a short window must hold, so that a slow motion is no ringing
STANDS_OUT = 10.0  # times the median of the spectrum
LOUDER = 4.0  # times the power later in the stick, which knows of noise of any colour and of hum
ALARM = 2e-3  # chance of a peak of noise alone in one spectrum
CALM = 4  # windows later in a stick
LAST = 0.8  # of a stick, after which the next slip may begin


def ringing(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> float | None:
    """Period (s) of the ringing after the arrests: the highest peak of the mean spectrum of the 30 ms after them.

    Where nothing stands out there, of the 15 or the 8 ms after them, where ringing that dies within a few periods is
    louder. None where the sampling is too slow or nothing rings: no peak stands out of its spectrum and of the spectrum
    later in the sticks further than noise would once in a hundred records.
    """
    detected = _detected(traces, segmentations, LONG)
    if detected is None:
        others = [h for h in (_detected(traces, segmentations, length) for length in SHORT) if h is not None]
        detected = max(others, key=lambda h: h[1], default=None)
    return None if detected is None else 1.0 / detected[0]


def _detected(
    traces: Sequence[Trace], segmentations: Sequence[Segmentation], length: float
) -> tuple[float, float] | None:
    """Frequency (Hz) of what rings within ``length`` s after the arrests, and how far above the limit it is."""
    rates = [t.sampling_rate for t, s in zip(traces, segmentations, strict=True) if t.displacement is not None]
    pieces: dict[int, list[tuple[Array, list[Array]]]] = {}
    for trace, segments in zip(traces, segmentations, strict=True):
        if trace.displacement is None:
            continue
        for i, event in enumerate(segments.events):
            later = segments.events[i + 1] if i + 1 < len(segments.events) else None
            piece = _windows(trace.displacement, trace.sampling_rate, event, later, length)
            if piece is not None:
                pieces.setdefault(round(trace.sampling_rate), []).append(piece)
    if not pieces:
        return None
    top = max(pieces)
    rate, found = next(r for r in rates if round(r) == top), pieces[top]
    size = min(y.size for y, _ in found)  # rates that are equal but for rounding
    frequency = np.fft.rfftfreq(8 * size, 1.0 / rate)
    low = LOWEST if length == LONG else PERIODS / length
    band = np.flatnonzero((frequency > low) & (frequency < rate / 5.0))
    if band.size < 3:
        return None
    loud = np.mean([_power(y[:size], length) for y, _ in found], axis=0)
    i = int(band[np.argmax(loud[band])])
    # the spectrum of a slow motion, or of noise that grows towards low frequencies, has no peak but an edge
    if loud[i] < loud[i - 1 : i + 2].max():
        return None
    bins = 2.0 * band.size / 8.0
    events = len(found)
    limit = max(STANDS_OUT, chdtri(2 * events, ALARM / bins) / chdtri(2 * events, 0.5))
    excess = float(loud[i] / (limit * np.median(loud[band])))
    calm = [_power(y[:size], length) for _, rest in found for y in rest]
    if calm:
        limit = max(LOUDER, fdtri(2 * events, 2 * len(calm), 1.0 - ALARM / bins))
        excess = min(excess, float(loud[i] / (limit * np.mean(calm, axis=0)[i])))
    return (float(frequency[i]), excess) if excess > 1.0 else None


def _windows(
    position: Array, rate: float, event: Event, later: Event | None, length: float
) -> tuple[Array, list[Array]] | None:
    """What follows an arrest, and some pieces of the same length from the second half of that stick."""
    n = round(length * rate)
    first = event.i_arrest + max(int(SKIPPED * rate), 1)
    if first + n >= position.size or n < (64 if length == LONG else 32):
        return None
    stop = position.size if later is None else event.i_arrest + int(LAST * (later.i_onset - event.i_arrest))
    begin = max(first + n, (event.i_arrest + stop) // 2)
    count = min((stop - begin) // n, CALM)
    starts = np.linspace(begin, stop - n, count).astype(int) if count > 0 else np.empty(0, int)
    return position[first : first + n], [position[k : k + n] for k in starts]


def _power(y: Array, length: float) -> Array:
    """Spectrum of a piece freed from slow motion (of no scale); a short one is weighed where its ringing is loudest."""
    s = np.linspace(-1, 1, y.size)
    y = y - np.polynomial.polynomial.polyval(s, np.polynomial.polynomial.polyfit(s, y, 3))
    taper = _hann(y.size)
    if length != LONG:
        rise = y.size // 4
        taper = np.concatenate([_hann(2 * rise)[:rise], _hann(2 * (y.size - rise))[y.size - rise :]])
    return np.asarray(np.abs(np.fft.rfft(y * taper, 8 * y.size)) ** 2)


def _hann(n: int) -> Array:
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n))
