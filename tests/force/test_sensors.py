"""The chain of sensors undone by nothing but the sensors themselves, also by one that a user brings."""

from __future__ import annotations

from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from stickslip.inference.force.force_along_motion import read, undone
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Motion, Sensor
from stickslip.physics.params import parameter

from . import solver_motion


class Bent(Sensor):
    """A user's own: the scale of the reading changes with the reading."""

    tag: ClassVar[str] = "own-bent-scale"
    amplitude: ClassVar[str] = "bend"
    place: ClassVar[int] = Sensor.GAIN

    bend: Array = parameter(0.0, unit="1/m", lower=-100.0, upper=100.0, null=0.0, doc="relative change of scale")

    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading * (1.0 + self.bend * reading)


SENSORS = {
    "gain": catalogue.make("sensor-gain", gain=0.01),
    "drift": catalogue.make("sensor-drift", rate=2e-8),
    "low-pass": catalogue.make("sensor-low-pass", time_constant=6e-5),
    "high-pass": catalogue.make("sensor-high-pass", cutoff=0.05),
    "read-out compliance": catalogue.make("machine-compliance", compliance=2e-7),
    "a user's own": Bent(bend=jnp.asarray(50.0)),
}
CHAIN = ("gain", "drift", "low-pass", "high-pass")
ROUNDED = 1e-9  # m
# a low-pass sees the velocity, which the solver's uneven steps give badly: one reading belongs to several ways
LEFT = {"low-pass": 0.15}


@pytest.fixture(scope="module")
def moved():
    """The block as it moves, through slips and the ringing after them."""
    return solver_motion.simulated(())


def seen(slips, effects):
    """The model with sensors, the motion of its block and of what they show, and the force."""
    model = solver_motion.with_effects(slips.model, effects)
    force = jnp.concatenate(
        [jnp.asarray(slips.steps.contact_force), jnp.zeros(solver_motion.KNOTS - slips.steps.t.size)]
    )
    reading = jax.jit(read)(model, slips.way, force)
    n = slips.steps.t.size
    rate = np.zeros(solver_motion.KNOTS)
    rate[:n] = np.gradient(np.asarray(reading)[:n], np.asarray(slips.way.t)[:n])
    return model, force, slips.way._replace(x=reading, v=rate)


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_is_undone(moved, name):
    model, force, shown = seen(moved, (SENSORS[name],))
    n = moved.steps.t.size
    found = jax.jit(undone)(model, shown, force)
    off, before = (np.abs(np.asarray(w.x - moved.way.x))[:n].max() for w in (found, shown))
    again = np.abs(np.asarray(jax.jit(read)(model, found, force) - shown.x))[:n].max()
    assert before > 3e-9  # it shows
    assert again < ROUNDED
    assert off < max(LEFT.get(name, 0.0) * before, ROUNDED)


def test_a_chain_of_sensors_is_undone(moved):
    model, force, shown = seen(moved, tuple(SENSORS[name] for name in CHAIN))
    n = moved.steps.t.size
    found = jax.jit(undone)(model, shown, force)
    off, before = (np.abs(np.asarray(w.x - moved.way.x))[:n].max() for w in (found, shown))
    assert off < 1e-3 * before


def test_a_low_pass_that_loses_most_of_the_ringing_is_undone(moved):
    """A ringing that decays, of which a filter of two radians of it shows less than half (Laplace transform)."""
    tau, turn, decay = 6.4e-4, 2.0 * np.pi * 513.0, 60.0
    pole = -decay + 1j * turn
    t = np.arange(solver_motion.KNOTS) * 1e-4
    sway, fade = 1e-7 * np.exp(pole * t), 1e-7 * np.exp(-t / tau)
    x = sway.real
    shown = 1.0 / (1.0 + pole * tau)
    reading = (shown * sway).real + (1.0 - shown.real) * fade  # which begins with the block
    rate = (shown * pole * sway).real - (1.0 - shown.real) / tau * fade
    assert np.abs(reading[50:250]).max() < 0.5 * np.abs(x[50:250]).max()
    model = solver_motion.with_effects(moved.model, (catalogue.make("sensor-low-pass", time_constant=tau),))
    still = moved.way._replace(t=jnp.asarray(t), x=jnp.asarray(reading), v=jnp.asarray(rate))
    found = jax.jit(undone)(model, still, jnp.zeros(solver_motion.KNOTS))
    assert np.abs(np.asarray(found.x) - x).max() < 1e-3 * np.abs(x).max()


def test_a_high_pass_that_loses_most_of_the_record_is_undone(moved):
    model, force, shown = seen(moved, (catalogue.make("sensor-high-pass", cutoff=0.5),))
    found = jax.jit(undone)(model, shown, force)
    assert np.abs(np.asarray(found.x - moved.way.x))[: moved.steps.t.size].max() < 1e-8


def test_without_sensors_nothing_is_done(moved):
    assert undone(moved.model, moved.way, moved.way.x) is moved.way


@pytest.mark.slow
@pytest.mark.parametrize("tag", ["sensor-gain", "sensor-drift", "sensor-low-pass", "sensor-high-pass"])
def test_what_is_read_along_a_motion_is_what_the_solver_read(tag):
    """One chain of sensors in the simulation and along its motion."""
    effects = solver_motion.effects_with((tag, {}))
    slips = solver_motion.simulated(effects)
    n = slips.steps.t.size
    shown = np.asarray(jax.jit(read)(slips.model, slips.way, jnp.zeros(solver_motion.KNOTS)))[:n]
    assert np.abs(slips.steps.reading - slips.steps.x).max() > 1e-9
    np.testing.assert_allclose(shown, slips.steps.reading, rtol=0.0, atol=1e-13)
