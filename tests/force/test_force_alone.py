"""Records of nothing but the spring's force: its scale and the drive's ripple are found with the rest of the model."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from stickslip.inference.force.composition import SCALE
from stickslip.inference.force.force_along_motion import of_block
from stickslip.inference.force.problem import CREEPING
from stickslip.physics.effects import catalogue
from stickslip.simulation.solve import Tolerance

from . import solver_motion

RUNS = (Run("v100", 1e-4, 8), Run("v200", 2e-4, 8), Run("v400", 4e-4, 4))
NOISE = 2e-8  # m; of the force over the spring's stiffness
QUIET = 5e-9
GAIN = 1.1
RIPPLE = {"ripple": 4e-7, "pitch": 5e-5}
EFFECTS = {
    "linear": (),
    "ripple": (catalogue.make("drive-ripple", **RIPPLE),),
    "sensor": (catalogue.make("sensor-gain", gain=0.03), catalogue.make("sensor-low-pass", time_constant=5e-4)),
    "nonlinear spring": (catalogue.make("nonlinear-spring", curvature=400.0),),
}


def force_alone(trace, stiffness, gain=GAIN, seed=3):
    """A run of which only the force is left, read by a sensor whose scale is wrong."""
    stretch = trace.drive.position(trace.time) - np.asarray(trace.displacement)
    noisy = stretch + NOISE * np.random.default_rng(seed).standard_normal(stretch.size)
    return trace.replace(
        displacement=None, resolution=None, walk=0.0, hum=0.0, spring_force=gain * stiffness * noisy,
        noise=gain * stiffness * NOISE,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["linear", "ripple", "nonlinear spring"])
def test_the_block_is_where_the_model_s_spring_has_the_measured_force(name):
    slips = solver_motion.simulated(EFFECTS[name])
    n, stiffness = slips.steps.t.size, float(slips.model.block.spring_stiffness)
    drive = np.asarray(slips.way.drive)
    shown = drive.copy()
    shown[:n] -= GAIN * slips.steps.spring_force / (1.04 * stiffness)
    way = slips.way._replace(x=shown, force_scale=1.04)
    assert np.abs(shown[:n] - slips.steps.x).max() > 1e-6
    found = jax.jit(of_block)(slips.model, way, GAIN)
    np.testing.assert_allclose(found.x[:n], slips.steps.x, atol=1e-12)


def test_a_sensor_of_the_force_sees_the_elongation():
    """Too large a reading, and a late one, of the elongation: not of the displacement, which goes with the drive."""
    slips = solver_motion.simulated(())
    n, stiffness = slips.steps.t.size, float(slips.model.block.spring_stiffness)
    t, drive, stretch = slips.way.t, np.asarray(slips.way.drive), slips.steps.spring_force / stiffness
    shown = drive.copy()
    shown[:n] -= 1.03 * stretch
    way = slips.way._replace(x=shown, v=np.gradient(shown, t), force_scale=1.0)
    gain = solver_motion.with_effects(slips.model, EFFECTS["sensor"][:1])
    np.testing.assert_allclose(jax.jit(of_block)(gain, way, 1.0).x[:n], slips.steps.x, atol=1e-10)
    # of an elongation that grows evenly a low-pass shows what it was a time constant before
    v, tau = 1e-4, float(EFFECTS["sensor"][1].time_constant)
    even = np.linspace(0.0, 0.1, solver_motion.KNOTS)
    late = solver_motion.with_effects(slips.model, EFFECTS["sensor"][1:])
    way = slips.way._replace(
        t=even, drive=v * even, x=v * even - v * (even - tau), v=np.zeros_like(even), force_scale=1.0
    )
    np.testing.assert_allclose(jax.jit(of_block)(late, way, 1.0).x[1:-1], 0.0, atol=1e-12)


def solved(effect, end):
    """A run of the solver of which the force alone is read."""
    model, steps = solver_motion.slipping(effect, end, Tolerance(5e-4, 5e-12, 5e-9))
    t, stiffness = np.arange(0.0, steps.t[-1], 1e-4), float(model.block.spring_stiffness)
    x = CubicHermiteSpline(steps.t, steps.x, steps.v)(t) - QUIET * np.random.default_rng(0).standard_normal(t.size)
    force = stiffness * (np.asarray(jax.vmap(model.lead)(jnp.asarray(t))) - x)
    run = ss.Trace.from_arrays(
        "run", time=t, spring_force=force, drive_velocity=solver_motion.SPEED, noise=stiffness * QUIET
    )
    return ss.Campaign.from_traces([run], solver_motion.SAMPLED)


@pytest.mark.slow
def test_what_a_force_counts_for_in_creep_does_not_depend_on_the_spring():
    """It is the force that was read: a spring that stiffens makes nothing of it larger."""
    prepared = solved(catalogue.make("drive-ripple"), 1.0).prepare()
    bent = catalogue.make("nonlinear-spring", curvature=400.0)
    problem = prepared.problem.with_composition(prepared.problem.composition.with_effect(bent, ()))
    share, slow = problem.forces(prepared.start).share, problem.phase == CREEPING
    np.testing.assert_allclose(share[slow], 1.0, rtol=1e-12)
    assert np.ptp(share[~slow]) > 1e-3


@pytest.mark.slow
def test_the_scale_of_a_force_is_found_with_the_rest(tmp_path):
    truth = make_campaign(tmp_path / "c", 21, (), runs=RUNS, spring_known=True, rate=1e4)["rig"]
    made = ss.load_campaign(tmp_path / "c" / "campaign.toml")
    traces = [force_alone(t, truth["spring_stiffness"]) for t in made.values()]
    campaign = ss.Campaign(made.description, traces)
    (note,) = campaign.scaled[1]
    assert all(name in note for name in campaign.names)  # one sensor: of the run with few sticks, too
    fit = campaign.fit()
    table = fit.parameters
    true = {
        SCALE: GAIN, "weakening.drop": 1.0 - truth["mu_k"] / truth["mu_s"],
        "weakening.slip_distance": truth["slip_length"], "rig.damping": truth["damping"],
    }  # fmt: skip
    for name, value in true.items():
        assert abs(table.value[name] - value) < 4.0 * table["std"][name] + 0.005 * value, name
        assert table["std"][name] < 0.02 * value, name
    # better than the sticks tell it: they creep
    assert abs(table.value[SCALE] - GAIN) < 0.7 * abs(1.099 - GAIN)
    predicted = fit.predict()
    assert predicted.slip["all"] < 0.01 and predicted.missed["all"] == 0


@pytest.mark.slow
def test_the_drive_s_ripple_is_found_in_a_force():
    found = solved(EFFECTS["ripple"][0], 1.9).fit("drive-ripple").parameters
    for name, value in (("ripple", RIPPLE["ripple"]), ("pitch", RIPPLE["pitch"])):
        assert found.value[f"drive-ripple.{name}"] == pytest.approx(value, rel=0.01)
        assert found["std"][f"drive-ripple.{name}"] < 0.01 * value
    assert found.value[SCALE] == pytest.approx(1.0, abs=1e-3)
