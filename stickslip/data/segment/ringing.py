"""The ring-down after an arrest: its frequency, and by which law its amplitude decays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .records import Event, Segmentation

Array = NDArray[np.float64]
SAMPLES = 4.0  # a period; with fewer, a frequency may be an alias
WINDOW = 2.64  # slip durations after an arrest within which the block rings
SHARE = 0.3  # of a stick that is no longer than that
PERIODS = 3.0  # the window must hold
LOUD = 4.0  # power of the ring-down over that of the later stick, from which something rings
ABOVE = 3.0  # noise levels from which an amplitude counts
FALL = 1.5  # factor by which the amplitude must fall for a law to be told
CLEAR = 1.25  # ratio of squared residuals from which one law is better than the next
LAWS = {
    "exponential": "amplitude falls as exp(-t/T): viscous damping",
    "linear": "amplitude falls as 1 - t/T: constant friction",
    "algebraic": "amplitude falls as 1/(1 + t/T): losses that grow with the amplitude, as in microslip",
}


@dataclass(frozen=True)
class Ringing:
    """One ring-down.

    Attributes:
        frequency: Hz.
        amplitude: one period after the arrest, m.
        law: a key of LAWS, "unclear" where two describe it as well, or "" where it does not fall far enough to tell.
        decay_time: in which the amplitude falls by a factor e at first, whatever the law, s; NaN where there is no law.
    """

    frequency: float
    amplitude: float
    law: str
    decay_time: float


def ringing(
    time: Array, position: Array, found: Segmentation, duration: float
) -> tuple[list[Ringing | None], float, str, str]:
    """Ring-downs of all events, their common frequency (Hz), their usual law, and why there is none ("" if there is).

    The frequency is where the power after the arrests most exceeds that later in the sticks (so that hum of the mains
    and ripple of the drive do not count), among those with at least four samples a period.

    Args:
        duration: usual length of a slip (s), the unit of the window.
    """
    none: list[Ringing | None] = [None] * len(found.events)
    rate = 1.0 / float(np.median(np.diff(time)))  # not the mean: samples may be lost
    sticks = [e.stick_time for e in found.events if np.isfinite(e.stick_time)]
    length = min(WINDOW * duration, SHARE * float(np.median(sticks))) if sticks else WINDOW * duration
    low, high = PERIODS / length, rate / SAMPLES
    if high < 2.0 * low:
        why = f"{rate:.3g} Hz are less than {SAMPLES:g} samples a period of anything that rings after these slips"
        return none, float("nan"), "", why
    pairs = [_window(time, position, found, event, length, rate) for event in found.events]
    pieces = [p for p in pairs if p is not None]
    if not pieces:
        return none, float("nan"), "", "the sticks are too short for a ring-down"
    frequency = _common(pieces, rate, low, high)
    if frequency is None:
        why = f"no ring-down between {low:.3g} and {high:.3g} Hz above the level of the sticks"
        return none, float("nan"), "", why
    rings = [None if p is None else _one(p[0], rate, frequency, found.settings.noise) for p in pairs]
    told = [r for r in rings if r is not None]
    if not told:
        return none, float("nan"), "", "the ring-downs do not stand out of the noise"
    laws = [r.law for r in told if r.law in LAWS]
    usual = max(LAWS, key=laws.count) if laws else ""
    if usual and laws.count(usual) < 0.5 * len(told):
        usual = "unclear"
    return rings, float(np.median([r.frequency for r in told])), usual, ""


def _window(
    time: Array, position: Array, found: Segmentation, event: Event, length: float, rate: float
) -> tuple[Array, Array] | None:
    """Positions just after an arrest and later in the same stick, each over ``length``, freed from slow motion."""
    later = event.index + 1
    end = found.events[later].t_onset - 0.5 * event.duration if later < len(found.events) else float(time[-1])
    if event.t_arrest + 2.2 * length > end:
        return None
    n = int(length * rate)
    first, second = np.searchsorted(time, [event.t_arrest, event.t_arrest + 1.2 * length])
    if n < 16 or second + n > time.size:
        return None
    return _flat(position[first : first + n]), _flat(position[second : second + n])


def _flat(y: Array) -> Array:
    s = np.linspace(-1, 1, y.size)
    return y - np.polynomial.polynomial.polyval(s, np.polynomial.polynomial.polyfit(s, y, 2))


def _common(pieces: list[tuple[Array, Array]], rate: float, low: float, high: float) -> float | None:
    size = 8 * max(p[0].size for p in pieces)
    frequency = np.fft.rfftfreq(size, 1 / rate)
    band = (frequency > low) & (frequency < high)
    # differences weigh against slow motion, which is louder after a slip than later
    loud, calm = (np.mean([np.abs(np.fft.rfft(np.diff(p[k]), size)) ** 2 for p in pieces], axis=0) for k in (0, 1))
    best = int(np.argmax(np.where(band, loud, 0.0)))
    if not band[best] or loud[best] < LOUD * (calm[best] + np.median(calm[band])):
        return None
    inside = band[best - 1 : best + 2].all() and loud[best] >= loud[best - 1 : best + 2].max()
    return float(frequency[best]) if inside else None


def _one(y: Array, rate: float, common: float, noise: float) -> Ringing | None:
    """Frequency and decay of one ring-down from its complex amplitude at the common frequency."""
    width = max(round(2.0 * rate / common), 4)
    if y.size < 2 * width:
        return None
    # zeros of a Hann window two periods long lie on the mean and on twice the frequency
    taper = np.hanning(width + 2)[1:-1]
    taper /= taper.sum()
    t = np.arange(y.size) / rate
    complex_amplitude = np.convolve(2.0 * y * np.exp(-2j * np.pi * common * t), taper, mode="valid")
    at = t[: complex_amplitude.size] + 0.5 * (width - 1) / rate
    size = np.abs(complex_amplitude)
    level = ABOVE * noise * float(np.sqrt(2.0 * np.sum(taper**2)))
    quiet = np.flatnonzero(size < max(level, 0.05 * float(size.max())))
    stop = int(quiet[0]) if quiet.size else size.size
    if stop < 4 or stop / rate < 0.5 / common:
        return None
    phase = np.unwrap(np.angle(complex_amplitude[:stop]))
    slope = np.polynomial.polynomial.polyfit(at[:stop], phase, 1, w=size[:stop])[1]
    frequency = common + float(slope) / (2.0 * np.pi)
    if not 0.5 * common < frequency < 1.5 * common:
        return None
    law, decay = _law(at[:stop], size[:stop])
    return Ringing(frequency, float(size[0]), law, decay)


def _law(t: Array, size: Array) -> tuple[str, float]:
    """The law that describes a falling amplitude best, and the time of the exponential one."""
    if size[0] < FALL * size[-1]:
        return "", float("nan")
    errors: dict[str, float] = {}
    fold = float("nan")
    # every law is a straight line of some function of the amplitude; weights make its error that of the amplitude
    for name, function, weight in (
        ("exponential", np.log, size),
        ("linear", np.asarray, np.ones_like(size)),
        ("algebraic", np.reciprocal, size**2),
    ):
        a, b = np.polynomial.polynomial.polyfit(t, function(size), 1, w=weight)
        line = a + b * t
        with np.errstate(over="ignore", divide="ignore"):
            inverse = {"exponential": np.exp(line), "linear": line, "algebraic": 1.0 / line}[name]
        if (b > 0) == (name == "algebraic"):
            errors[name] = float(np.sum((inverse - size) ** 2))
            fold = float(-1.0 / b) if name == "exponential" else fold
    if not np.isfinite(fold):
        return "", float("nan")
    order = sorted(errors, key=lambda k: errors[k])
    unclear = len(order) > 1 and errors[order[1]] < CLEAR * errors[order[0]]
    return "unclear" if unclear else order[0], fold
