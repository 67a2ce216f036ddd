"""The vibrometer: a heterodyne fringe counter with its filters, noise, drift, counts and clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

Array = np.ndarray
COUNT = 632.8e-9 / 80  # m: one count of a fringe counter with helium-neon light, 7.91 nm
FRINGE = 632.8e-9 / 2


@dataclass(frozen=True)
class Sensor:
    """Settings of the chain, SI; zero switches a stage off.

    Attributes:
        gain, gain_bend: relative error of scale; with a bend (m) it grows as 1 - exp(-x / bend).
        low_pass: time constant of the decoder's filter, s, and its order (1, or a Bessel filter above).
        high_pass: corner of an AC-coupled stage, Hz, and its order.
        delay: s.
        drift: m/s; with ``drift_settling`` (s) it dies out exponentially.
        white: m/sqrt(Hz) one-sided. flicker: m/sqrt(Hz) at 1 Hz, falling as 1/sqrt(f). walk: m/sqrt(s).
        hum: amplitude at the mains frequency, m.
        interpolation: amplitude of the error periodic in half a wavelength, m.
        speckle: jumps per metre of travel, each of 10 to 60 nm of either sign.
        count: m.
        clock: relative error of the sampling clock.
        compliance: between the contact and the laser's spot, m/N. yaw_arm: share of the yaw that the spot sees.
    """

    gain: float = 0.0
    gain_bend: float = 0.0
    low_pass: float = 0.0
    low_pass_order: int = 1
    high_pass: float = 0.0
    high_pass_order: int = 1
    delay: float = 0.0
    drift: float = 0.0
    drift_settling: float = 0.0
    white: float = 2e-11
    flicker: float = 1e-10
    walk: float = 3e-10
    hum: float = 3e-10
    interpolation: float = 8e-10
    speckle: float = 300.0
    count: float = COUNT
    clock: float = 0.0
    compliance: float = 0.0
    yaw_arm: float = 0.0


SILENT = Sensor(white=0.0, flicker=0.0, walk=0.0, hum=0.0, interpolation=0.0, speckle=0.0)


def spot(sensor: Sensor, displacement: Array, contact_force: Array, yaw: Array) -> Array:
    """Where the laser's spot is, m."""
    return displacement + sensor.compliance * contact_force + sensor.yaw_arm * yaw


def filtered(sensor: Sensor, x: Array, rate: float) -> Array:
    """Gain, low-pass and high-pass of a record at ``rate`` (before sampling), starting settled on its first value."""
    if sensor.gain != 0.0:
        bend = 1.0 if sensor.gain_bend == 0.0 else 1.0 - np.exp(-np.abs(x) / sensor.gain_bend)
        x = x * (1.0 + sensor.gain * bend)
    if sensor.low_pass > 0.0:
        corner = 1 / (2 * np.pi * sensor.low_pass)
        x = _filter(x, sensor.low_pass_order, corner, "lowpass", rate)
    if sensor.high_pass > 0.0:
        x = _filter(x, sensor.high_pass_order, sensor.high_pass, "highpass", rate)
    return x


def _filter(x: Array, order: int, corner: float, kind: str, rate: float) -> Array:
    if kind == "lowpass" and corner >= 0.45 * rate:
        return x
    if order == 1 or kind == "highpass":
        sections = signal.butter(order, corner, kind, fs=rate, output="sos")
    else:
        sections = signal.bessel(order, corner, kind, norm="mag", fs=rate, output="sos")
    return signal.sosfilt(sections, x - x[0]) + (x[0] if kind == "lowpass" else 0.0)


def noise(sensor: Sensor, y: Array, rate: float, rng: np.random.Generator) -> Array:
    """What the instrument adds to the samples ``y``, m."""
    n = y.size
    t = np.arange(n) / rate
    added = np.zeros(n)
    if sensor.drift != 0.0:
        s = sensor.drift_settling
        added += sensor.drift * (t if s == 0.0 else s * (1 - np.exp(-t / s)))
    if sensor.white > 0:
        added += sensor.white * np.sqrt(rate / 2) * rng.standard_normal(n)
    if sensor.walk > 0:
        added += np.cumsum(sensor.walk / np.sqrt(rate) * rng.standard_normal(n))
    if sensor.flicker > 0:
        added += _flicker(n, rate, rng) * sensor.flicker
    if sensor.hum > 0:
        added += sensor.hum * np.sin(2 * np.pi * 50.0 * t + rng.uniform(0, 2 * np.pi))
    if sensor.interpolation > 0:
        phase = rng.uniform(0, 2 * np.pi, 2)
        angle = 2 * np.pi * y / FRINGE
        added += sensor.interpolation * (np.sin(angle + phase[0]) + 0.4 * np.sin(2 * angle + phase[1]))
    if sensor.speckle > 0:
        chance = sensor.speckle * np.abs(np.diff(y, prepend=y[0]))
        jumps = np.flatnonzero(rng.random(n) < chance)
        steps = np.zeros(n)
        steps[jumps] = rng.uniform(10e-9, 60e-9, jumps.size) * rng.choice([-1.0, 1.0], jumps.size)
        added += np.cumsum(steps)
    return added


def _flicker(n: int, rate: float, rng: np.random.Generator) -> Array:
    """Noise of density 1/sqrt(f) per sqrt(Hz)."""
    size = 2 ** int(np.ceil(np.log2(n)))
    f = np.fft.rfftfreq(size, 1 / rate)
    spectrum = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    spectrum[0] = 0.0
    spectrum[1:] *= np.sqrt(rate * size / 4 / f[1:])
    return np.fft.irfft(spectrum, size)[:n]


def counts(sensor: Sensor, x: Array, rate_in: float, rate_out: float, rng: np.random.Generator) -> Array:
    """Integer counts sampled at ``rate_out`` (by the sensor's own clock) of a spot record at ``rate_in``."""
    y = filtered(sensor, x, rate_in)
    duration = (x.size - 1) / rate_in
    n = int(duration * rate_out / (1 + abs(sensor.clock)) + 1e-9) + 1
    moments = np.arange(n) / rate_out * (1 + sensor.clock) - sensor.delay
    sampled = np.interp(moments, np.arange(x.size) / rate_in, y)
    return np.floor((sampled + noise(sensor, sampled, rate_out, rng)) / sensor.count + 0.5).astype(np.int64)
