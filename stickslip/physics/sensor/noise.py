"""Noise of a sensor, each kind with its own generator stream."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def white_noise(rng: np.random.Generator, samples: int, density: float, rate: float) -> Array:
    """Samples at ``rate`` (Hz) of noise with the one-sided amplitude density ``density`` (m/Hz^0.5) up to rate/2."""
    return density * np.sqrt(0.5 * rate) * rng.standard_normal(samples)


def random_walk(rng: np.random.Generator, samples: int, strength: float, rate: float) -> Array:
    """A walk from zero whose rms grows as ``strength`` (m/s^0.5) times the root of time."""
    steps = strength / np.sqrt(rate) * rng.standard_normal(samples)
    steps[:1] = 0.0
    return np.cumsum(steps)


def flicker_noise(rng: np.random.Generator, samples: int, level: float, rate: float) -> Array:
    """1/f noise: one-sided power density ``level``^2/f (m^2/Hz, ``level`` in m), zero mean."""
    if samples < 2:
        return np.zeros(samples)
    frequency = np.fft.rfftfreq(samples, 1.0 / rate)
    amplitude = np.zeros(frequency.size)
    # |X|^2 of a record of n samples at density S is S n rate/2 for the real and imaginary part together
    amplitude[1:] = level / np.sqrt(frequency[1:]) * np.sqrt(0.5 * samples * rate)
    spectrum = amplitude * (rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)) / np.sqrt(2)
    return np.fft.irfft(spectrum, samples)
