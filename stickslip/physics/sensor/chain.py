"""The chain of a fringe-counting laser vibrometer, from the true motion to counts.

``y = HP(LP(x(t - t_d)(1 + gain))) + interpolation error + drift + speckle + noise``, then counts of a fringe fraction,
which a counter of limited range wraps and a user clears. Facts: Polytec OFV-3001 manual (one fringe is half a
wavelength of a helium-neon laser, interpolated to 40 counts of 7.91 nm; a 12-bit counter then spans 32.4 um).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from ...errors import InputError
from ...system.object_repr import quantity
from ...system.units import to_si
from .noise import flicker_noise, random_walk, white_noise

Array = np.ndarray
FRINGE = 632.8e-9 / 2.0  # m
_LEAST = {"gain": -1.0, "drift": -1.0, "clock_error": -0.5}  # of what may be negative
_UNITS = {
    "resolution": "m", "gain": "1", "interpolation_error": "m", "delay": "s", "low_pass": "s", "high_pass": "Hz",
    "drift": "m/s", "random_walk": "m/s**0.5", "white": "m/Hz**0.5", "flicker": "m", "mains": "m",
    "mains_frequency": "Hz", "speckle_rate": "1/m", "speckle_jump": "m", "dropout_rate": "1/m", "dropout_time": "s",
    "clock_error": "1",
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class Vibrometer:
    """Settings of a simulated vibrometer; a value of zero switches that error off.

    Quantities are numbers in SI or text with a unit: ``Vibrometer(resolution="8 nm", low_pass="0.1 ms")``.

    Args:
        resolution: one count (m).
        counter_steps: counts after which the counter wraps.
        clears: times at which the counter is cleared (s).
        gain: error of the scale (1).
        interpolation_error: amplitude of the periodic error within a fringe (m); half of it at half the period.
        delay: pure delay (s).
        low_pass: time constant of the output filter (s).
        high_pass: corner frequency of an AC coupling (Hz).
        drift: constant drift (m/s).
        random_walk: drift at random (m/s^0.5).
        white: amplitude density (m/Hz^0.5).
        flicker: 1/f noise, root of the power density at 1 Hz (m).
        mains, mains_frequency: hum, amplitude (m) and frequency (Hz).
        speckle_rate, speckle_jump: jumps for each metre travelled (1/m), and their rms (m).
        dropout_rate, dropout_time: losses of signal for each metre travelled (1/m), and how long the counter then
            stands still (s); whole half fringes are lost.
        clock_error: by which share the sample clock runs fast (1).
        dither: whether half a count of noise is added before counting.
        seed: of everything random; every part draws from its own stream.

    Raises:
        InputError: a size that is negative or not finite, a unit that cannot be read, or a counter without a
            resolution.
    """

    resolution: float = 7.91e-9
    counter_steps: int = 0
    clears: tuple[float, ...] = ()
    gain: float = 0.0
    interpolation_error: float = 0.0
    delay: float = 0.0
    low_pass: float = 0.0
    high_pass: float = 0.0
    drift: float = 0.0
    random_walk: float = 0.0
    white: float = 0.0
    flicker: float = 0.0
    mains: float = 0.0
    mains_frequency: float = 50.0
    speckle_rate: float = 0.0
    speckle_jump: float = 3e-8
    dropout_rate: float = 0.0
    dropout_time: float = 1e-3
    clock_error: float = 0.0
    dither: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        for f in fields(self):
            value, least = getattr(self, f.name), _LEAST.get(f.name, 0.0)
            if isinstance(value, str) and f.name in _UNITS:
                value = to_si(value, _UNITS[f.name], key=f"sensor.{f.name}")
                object.__setattr__(self, f.name, value)
            if f.name != "clears" and not least <= value < np.inf:
                allowed = f"{least:g} or more, in SI"
                raise InputError("out of range", key=f"sensor.{f.name}", value=value, allowed=allowed)
        if self.counter_steps and not self.resolution:
            raise InputError("a counter needs a resolution", key="sensor.resolution", allowed="above 0 m")

    def __repr__(self) -> str:
        """The resolution, and what is not as by default."""
        own = {f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default}
        said = {"resolution": self.resolution, **own}
        text = (f"{name}={quantity(v, _UNITS[name]) if name in _UNITS else repr(v)}" for name, v in said.items())
        return f"{type(self).__name__}({', '.join(text)})"

    @property
    def wrap(self) -> float | None:
        """Range after which the counter starts anew (m), or None."""
        return self.counter_steps * self.resolution if self.counter_steps and self.resolution else None


def measure(vibrometer: Vibrometer, motion: Callable[[Array], Array], times: Array) -> Array:
    """What the vibrometer shows.

    Args:
        vibrometer: its settings.
        motion: true displacement (m) at times (s); held constant before and after what is known.
        times: evenly spaced nominal sample times (s), shape (n,); a clock that runs fast samples earlier.

    Returns:
        (n,) readings in m: whole counts times the resolution, wrapped and cleared.

    Raises:
        InputError: fewer than two samples, or times that do not increase evenly.
    """
    v = vibrometer
    t = np.asarray(times, float)
    if t.size < 2:
        raise InputError("the vibrometer needs two samples or more", key="output.sampling_rate", value=t.size)
    if not _even(t):
        raise InputError("the vibrometer samples evenly, and the times do not increase evenly", key="times")
    rate = (t.size - 1) / (t[-1] - t[0])
    true = t[0] + (t - t[0]) / (1.0 + v.clock_error)
    x = np.asarray(motion(true - v.delay), float)
    streams = iter(np.random.default_rng([v.seed, part]) for part in range(8))
    y = x * (1.0 + v.gain)
    y = y if not v.low_pass else low_pass(y, v.low_pass * rate)
    y = y if not v.high_pass else y - low_pass(y, rate / (2.0 * np.pi * v.high_pass))
    y = y + _interpolation(x, v.interpolation_error)
    y = y + v.drift * (true - true[0]) + v.mains * np.sin(2.0 * np.pi * v.mains_frequency * true)
    y = y + random_walk(next(streams), t.size, v.random_walk, rate)
    y = y + white_noise(next(streams), t.size, v.white, rate)
    y = y + flicker_noise(next(streams), t.size, v.flicker, rate)
    y = y + _speckle(next(streams), x, v.speckle_rate, v.speckle_jump)
    y = _dropouts(next(streams), x, y, v.dropout_rate, max(1, round(v.dropout_time * rate)))
    if not v.resolution:
        return _cleared(t, y, v.clears)
    if v.dither:
        y = y + v.resolution * (next(streams).random(t.size) - 0.5)
    counts = np.floor(y / v.resolution).astype(np.int64)
    counts = np.asarray(_cleared(t, counts, v.clears))
    if v.counter_steps:
        half = v.counter_steps // 2
        counts = (counts + half) % v.counter_steps - half
    return counts * v.resolution


def _even(t: Array, looks: int = 1000) -> bool:
    """Whether times increase evenly, to a hundredth of a step; looked at here and there, for records are long."""
    i = np.unique(np.linspace(0, t.size - 1, looks).astype(int))
    step = (t[-1] - t[0]) / (t.size - 1)
    return bool(step > 0.0 and np.all(np.abs(t[i] - t[0] - i * step) < 0.01 * step))


def low_pass(y: Array, samples: float) -> Array:
    """A first-order low-pass with a time constant in samples, exact for input that is linear between samples."""
    from scipy.signal import lfilter

    decay = np.exp(-1.0 / samples)
    share = samples * (1.0 - decay)
    # z' = (y - z)/tau over one sample in which y goes linearly from y0 to y1
    b = [1.0 - share, share - decay]
    return lfilter(b, [1.0, -decay], y, zi=np.array([decay * y[0] + (share - decay) * y[0]]))[0]


def _interpolation(x: Array, amplitude: float) -> Array:
    if not amplitude:
        return np.zeros(())
    phase = 2.0 * np.pi * x / FRINGE
    return amplitude * (np.sin(phase) + 0.5 * np.sin(2.0 * phase))


def _travel(x: Array) -> Array:
    return np.abs(np.diff(x, prepend=x[:1]))


def _speckle(rng: np.random.Generator, x: Array, rate: float, jump: float) -> Array:
    """Jumps that stay, more of them the more the speckle pattern changes."""
    if not rate:
        return np.zeros(())
    number = rng.poisson(rate * _travel(x))
    return np.cumsum(np.sqrt(number) * jump * rng.standard_normal(x.size))


def _dropouts(rng: np.random.Generator, x: Array, y: Array, rate: float, samples: int) -> Array:
    """The counter stands still while the signal is lost, and whole half fringes are missing afterwards."""
    if not rate:
        return y
    y = y.copy()
    starts = np.flatnonzero(rng.random(x.size) < -np.expm1(-rate * _travel(x)))
    free: int = 0
    for start in starts.tolist():
        if start < free:
            continue
        free = min(start + samples, x.size - 1)
        lost = np.round((x[free] - x[start]) / (0.5 * FRINGE)) * 0.5 * FRINGE
        y[start:free] = y[start]
        y[free:] -= lost
    return y


def _cleared(t: Array, y: Array, clears: tuple[float, ...]) -> Array:
    """Start again from zero at every time in ``clears``."""
    if not clears:
        return y
    at = np.searchsorted(t, np.sort(np.asarray(clears)))
    at = at[at < t.size]
    zero = np.zeros(t.size, y.dtype)
    for first in at:
        zero[first:] = y[first]
    return y - zero
