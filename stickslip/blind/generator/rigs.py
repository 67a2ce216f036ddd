"""Rigs that a user could have: hidden parameters drawn around a steel block on two V-grooves."""

from __future__ import annotations

import math

import numpy as np

from .dynamics import Rig
from .forms import Setup
from .forms.base import log_uniform
from .lines import Surface
from .sensor import Sensor

FASTEST = 4e-4  # m/s: stick-slip must survive here


def draw_setup(rng: np.random.Generator, *, points: int = 16384) -> Setup:
    """Hidden parameters: friction, weakening, damping, spring, roughness and the vibrometer's noise.

    Drawn again until steady sliding is unstable at the fastest drive with a margin.
    """
    while True:
        mu_s = 0.21 * math.exp(0.02 * rng.standard_normal())
        rig = Rig(
            spring_stiffness=1000.0 * math.exp(0.1 * rng.standard_normal()),
            mu_s=mu_s,
            mu_k=mu_s * rng.uniform(0.80, 0.90),
            slip_length=log_uniform(rng, 0.7e-6, 1.5e-6),
            heal_time=log_uniform(rng, 5e-3, 3e-2),
            damping=log_uniform(rng, 5.0, 12.0),
        )
        if unstable(rig, 1.8 * FASTEST):
            break
    surface = Surface(hurst=rng.uniform(0.25, 0.4), h_rms=log_uniform(rng, 2.0e-6, 3.0e-6), points=points)
    # no error of the gain, no drift to speak of, no vibration of the table: those are effects, and hidden as such
    sensor = Sensor(
        white=log_uniform(rng, 1e-12, 1e-10),
        walk=log_uniform(rng, 1e-9, 5e-9),
        drift=rng.normal(0.0, 1e-10),
        clock=rng.normal(0.0, 5e-6),
        hum=log_uniform(rng, 5e-10, 5e-9),
        interpolation=log_uniform(rng, 1e-9, 3e-9),
    )
    return Setup(rig=rig, surface=surface, sensor=sensor)


def unstable(rig: Rig, velocity: float) -> bool:
    """Whether steady sliding at ``velocity`` grows into stick-slip (Routh-Hurwitz of the linearised motion)."""
    drop = (rig.mu_s - rig.mu_k) * sum(rig.loads)
    ratio = velocity * rig.heal_time / rig.slip_length
    rate = (1 + ratio) / rig.heal_time
    weakening = drop / (rig.slip_length * (1 + ratio))
    m, c, k = rig.mass, rig.damping, rig.spring_stiffness
    return (c + m * rate) * (k + c * rate - weakening) <= m * k * rate
