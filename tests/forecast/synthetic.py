"""Sliders whose strength wanders by a known law, written down as a sawtooth of the spring's force."""

from __future__ import annotations

import numpy as np

from stickslip.data.trace import Trace
from stickslip.inference.forecast.known_record import Past
from stickslip.inference.forecast.predict import Compared, compare, training_slips
from stickslip.inference.forecast.wander import Component, Wander, covariance

STIFFNESS, SPEED = 168.0, 42e-6  # N/m, m/s
MEANS = (0.08, 0.06)  # N, at onset and arrest
LAW = Wander((Component("ornstein-uhlenbeck", "slip path", (0.008, 0.008), 5e-3),), (0.0025, 0.003))
SLIP = 0.05  # s


def prepare(trace: Trace, train: float) -> tuple[Past, list[Compared]]:
    """A run divided, and laws of its wandering level compared on the first part."""
    past = Past.of(trace, train)
    return past, compare(past.arrays, training_slips(past))


def wander(kernel: str, at: np.ndarray, length: float, rng: np.random.Generator) -> np.ndarray:
    """A wander of unit variance at coordinates that do not decrease."""
    if kernel == "ornstein-uhlenbeck":
        w = np.empty(at.size)
        w[0] = rng.normal()
        carried = np.exp(-np.diff(at) / length)
        for i, r in enumerate(carried):
            w[i + 1] = r * w[i] + np.sqrt(1.0 - r * r) * rng.normal()
        return w
    whole = covariance(kernel, np.abs(at[:, None] - at), length) + 1e-10 * np.eye(at.size)
    return np.linalg.cholesky(whole) @ rng.normal(size=at.size)


def series(number: int, law: Wander, seed: int, means: tuple[float, float] = MEANS) -> dict[str, np.ndarray]:
    """Levels of slips at even distances in time (1 s and 2 s in turn) and slip path, as `level_arrays` gives them."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(np.tile([1.0, 2.0], number)[:number])
    path = 1e-4 * np.arange(number)
    out = {"time_onset": t, "time_arrest": t + 0.05, "path_onset": path, "path_arrest": path + 0.99e-4}
    out |= {"place_onset": path, "place_arrest": path + 0.99e-4, "direction": np.ones(number)}
    levels = [np.full(number, m) for m in means]
    for c in law.components:
        key = {"time": "time", "slip path": "path", "place": "place"}[c.coordinate]
        at = np.stack([out[f"{key}_onset"], out[f"{key}_arrest"]], axis=1).ravel()
        w = wander(c.kernel, at, c.length, rng)
        levels = [level + size * w[k::2] for k, (level, size) in enumerate(zip(levels, c.size, strict=True))]
    for k, name in enumerate(("onset", "arrest")):
        out[name] = levels[k] + law.scatter[k] * rng.normal(size=number)
    return out


def record(
    number: int, seed: int, rate: float = 100.0, law: Wander = LAW, creep: float = 0.1, noise: float = 1e-5
) -> Trace:
    """A slider's force. Its strength wanders along the slip path, so that it waits for the load where it is.

    Args:
        number: of slips. seed: of everything random. rate: Hz. law: along the slip path.
        creep: share by which creep lengthens a stick, most of it at its end. noise: N.
    """
    rng = np.random.default_rng(seed)
    (c,) = law.components
    usual = (MEANS[0] - MEANS[1]) / STIFFNESS
    # places a usual slip apart at which the wander is drawn; a slip of another size is between them
    at = np.arange(2 * number + 2) * 0.5 * usual
    w = wander(c.kernel, at, c.length, rng)
    times, forces, now, arrest, path = [np.zeros(1)], [np.array([MEANS[1]])], 0.0, MEANS[1], 0.0
    shape = np.linspace(0.0, 1.0, 200)[1:]
    turn = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 20)[1:]))
    for _ in range(number):
        strength = MEANS[0] + c.size[0] * np.interp(path, at, w) + law.scatter[0] * rng.normal()
        strength = max(strength, arrest + 1e-3)
        load = (strength - arrest) / (STIFFNESS * SPEED)
        times.append(now + load * (shape + creep * shape**5))
        forces.append(arrest + (strength - arrest) * shape)
        now = times[-1][-1]
        level = MEANS[1] + c.size[1] * np.interp(path + usual, at, w) + law.scatter[1] * rng.normal()
        level = min(level, strength - 3e-3)
        times.append(now + SLIP * np.linspace(0.0, 1.0, 20)[1:])
        forces.append(strength + (level - strength) * turn)
        now, path, arrest = now + SLIP, path + (strength - level) / STIFFNESS, level
        path = min(path, at[-1] - usual)
    t = np.arange(0.0, now, 1.0 / rate)
    force = np.interp(t, np.concatenate(times), np.concatenate(forces)) + noise * rng.normal(size=t.size)
    return Trace.from_arrays(
        "synthetic", time=t, spring_force=force, drive_velocity=SPEED, spring_stiffness=STIFFNESS, noise=noise
    )
