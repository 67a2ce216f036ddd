"""Records of any signal, at any usual sampling rate, tell the same model."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.blind.generator import Run, make_campaign
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.displacements import with_displacements
from stickslip.data.segment import segment
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.force.fit import fit

RUNS = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 4), Run("v400", 4e-4, 4))
NOISE = 2e-9  # m; of the force over the spring's stiffness
SHAKE = 2e-6  # m/s


def recorded(folder, rate):
    truth = make_campaign(folder, 21, (), runs=RUNS, spring_known=True, rate=rate)
    campaign = load_campaign(folder / "campaign.toml")
    return truth["rig"], campaign, load_traces(campaign)


def fitted(campaign, traces):
    found = [segment(t) for t in traces]
    moving, _ = with_displacements(traces, found)
    prepared = prepare(campaign, moving, found)
    return prepared, fit(prepared.problem, prepared.start)


def assert_recovered(found, rig, within):
    truth = {
        "weakening.drop": 1.0 - rig["mu_k"] / rig["mu_s"],
        "weakening.slip_distance": rig["slip_length"],
        "weakening.healing_time": rig["heal_time"],
        "rig.damping": rig["damping"],
    }
    std = found.std()
    for name, value in truth.items():
        assert abs(found.values[name] - value) < 4.0 * std[name] + 0.005 * value, name
        assert std[name] < within * value, name


@pytest.mark.slow
@pytest.mark.parametrize("rate", [2e3, 5e4])
def test_displacement_at_any_usual_rate(tmp_path, rate):
    rig, campaign, traces = recorded(tmp_path / "c", rate)
    prepared, found = fitted(campaign, traces)
    assert not [why for why in prepared.dropped if "too coarse" in why]
    assert_recovered(found, rig, 0.03)


@pytest.mark.slow
@pytest.mark.parametrize("signal", ["spring force", "velocity"])
def test_spring_force_or_velocity_alone(tmp_path, signal):
    rig, campaign, traces = recorded(tmp_path / "c", 1e4)
    rng = np.random.default_rng(3)
    bare = {"displacement": None, "resolution": None, "walk": 0.0, "hum": 0.0}
    other = []
    for t in traces:
        white, x = rng.standard_normal(t.time.size), np.asarray(t.displacement)
        if signal == "velocity":
            other.append(t.replace(velocity=np.gradient(x, t.time) + SHAKE * white, noise=SHAKE, **bare))
        else:
            force = rig["spring_stiffness"] * (t.drive.position(t.time) - x + NOISE * white)
            other.append(t.replace(spring_force=force, noise=rig["spring_stiffness"] * NOISE, **bare))
    _, found = fitted(campaign, other)
    assert_recovered(found, rig, 0.15 if signal == "velocity" else 0.03)


@pytest.mark.slow
def test_samples_too_far_apart_for_inertia_are_said(tmp_path):
    _, campaign, traces = recorded(tmp_path / "c", 5e3)
    sparse = [t.replace(time=t.time[::20], displacement=t.displacement[::20]) for t in traces]
    prepared, _ = fitted(campaign, sparse)
    (said,) = [why for why in prepared.dropped if "too coarse" in why]
    assert "250 Hz" in said
