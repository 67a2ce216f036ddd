"""What a simulation gives back, and that it is the physics that was asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray

from stickslip.errors import InputError
from stickslip.simulation.scenario import make_scenario, record, simulate
from stickslip.simulation.scenario.events import UNITS

from .conftest import rig

UNIT_OF = {
    "displacement": "m",
    "velocity": "m/s",
    "spring_force": "N",
    "contact_force": "N",
    "psi": "1",
    "sliding_share": "1",
    "drive_position": "m",
    "reading": "m",
    "static_displacement": "m",
    "static_time": "s",
    **UNITS,
}


@pytest.mark.slow
def test_every_variable_has_its_unit(stick_slip):
    assert {name: stick_slip[name].attrs["units"] for name in stick_slip.data_vars} == UNIT_OF
    assert stick_slip["time"].attrs["units"] == "s"
    for name in stick_slip.data_vars:
        assert np.isfinite(stick_slip[name].values[1:]).all()


def test_attributes_say_how_it_was_made(stick_slip):
    for key in ("N", "L", "seed_lines", "seed_sensor", "versions", "steps", "rejected", "energy_error"):
        assert key in stick_slip.attrs
    assert "stickslip" in stick_slip.attrs["versions"]
    assert stick_slip.attrs["energy_error"] < 2e-3
    assert stick_slip.attrs["steps"] > 100


@pytest.mark.parametrize("length", [{"events": 3}, {"duration": "30 s"}])
def test_it_ends_where_a_condition_turns_true(stick_slip, length):
    scenario = make_scenario({**rig(), "drive": {"velocity": "200 um/s", **length}})
    found = simulate(scenario, until=lambda steps: (steps.v < 0.0) & (steps.x > 5e-5))
    assert stick_slip.attrs["ended"] == "complete" and found.attrs["ended"] == "until"
    v, x = stick_slip["velocity"].values, stick_slip["displacement"].values
    first = float(stick_slip["time"][np.argmax((v < 0.0) & (x > 5e-5))])
    assert float(found["time"][-1]) == pytest.approx(first, abs=3e-4)
    n = min(found.sizes["time"], stick_slip.sizes["time"]) - 1
    np.testing.assert_allclose(found["displacement"][:n], x[:n], atol=1e-8)
    assert found.attrs["verdict"].startswith("stick-slip: 2 slip events in")
    short = simulate(scenario, until=lambda steps: steps.x > 1e-7)
    assert short.attrs["verdict"].endswith("where the run was ended") and short.sizes["event"] == 0


def test_it_survives_netcdf(stick_slip, tmp_path):
    stick_slip.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf", decode_times=False) as back:
        xarray.testing.assert_identical(back.load(), stick_slip)


def test_it_is_written_as_xarray_would(tmp_path):
    """`Recording` writes its file itself, so that the command line need not import xarray."""
    made = record(make_scenario(rig()))
    made.to_netcdf(tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf", decode_times=False) as back:
        xarray.testing.assert_identical(back.load(), made.dataset())
    assert made.sizes == dict(made.dataset().sizes)
    assert made["slip"].values.size == made.sizes["event"] > 0


def test_forces_and_displacements_belong_together(stick_slip):
    stretch = stick_slip["drive_position"] - stick_slip["displacement"]
    np.testing.assert_allclose(stick_slip["spring_force"], 1000.0 * stretch, rtol=1e-12, atol=1e-15)
    x, v, t = (stick_slip[name].values for name in ("displacement", "velocity", "time"))
    travelled = np.concatenate([[0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])
    assert np.max(np.abs(travelled - x)) < 0.02 * x.max()


def test_events_are_those_of_a_block_on_a_spring(stick_slip):
    """Slip dF (1 + exp(-pi zeta))/c_s with damping; recurrence = slip/v0 of a stationary cycle."""
    mass, k, c, v0 = 0.0894, 1000.0, 10.0, 2e-4
    drop = 0.15 * 4 * 0.21 * 0.31
    zeta = c / (2 * math.sqrt(mass * k))
    expected = drop * (1 + math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2))) / k
    slip, recurrence = stick_slip["slip"].values, stick_slip["recurrence"].values
    assert stick_slip.sizes["event"] == 3
    assert slip[1:] == pytest.approx(expected, rel=0.15)
    assert math.isnan(recurrence[0])
    stationary = slip[2] + stick_slip["creep_before_slip"].values[2]
    assert recurrence[2] == pytest.approx(stationary / v0, rel=0.01)
    duration = (stick_slip["arrest"] - stick_slip["onset"]).values
    assert np.all((duration > 0.02) & (duration < 0.06))


def test_spring_force_peaks_at_onset_and_is_least_at_arrest(stick_slip):
    t, force = stick_slip["time"].values, stick_slip["spring_force"].values
    for onset, arrest in zip(stick_slip["onset"].values, stick_slip["arrest"].values, strict=True):
        near = (t > onset - 0.03) & (t < arrest + 0.03)
        assert abs(t[near][np.argmax(force[near])] - onset) < 4e-4
        assert abs(t[near][np.argmin(force[near])] - arrest) < 4e-4


def test_the_contact_is_not_virgin_after_an_event(stick_slip):
    creep = stick_slip["creep_before_slip"].values
    assert creep[1] < 0.6 * creep[0]


def test_first_stick_follows_the_static_curve(stick_slip):
    t, x = stick_slip["time"].values, stick_slip["displacement"].values
    static = np.interp(t, stick_slip["static_time"].values, stick_slip["static_displacement"].values)
    early = t < 0.6 * float(stick_slip["onset"][0])
    assert np.max(np.abs(x - static)[early]) < 3e-9
    assert static[early][-1] > 1e-7


def test_constant_friction_slides_and_says_why():
    data = simulate(make_scenario(rig(weakening__ratio=1.0, drive={"velocity": 2e-4, "duration": 3})))
    assert data.sizes["event"] == 0
    assert "friction does not weaken" in data.attrs["verdict"]
    assert data["velocity"].values[-1] == pytest.approx(2e-4, rel=1e-3)


def test_too_stiff_a_spring_slides_and_names_the_critical_one():
    limit = simulate(make_scenario(rig(drive={"velocity": 2e-4, "duration": 0.01}))).attrs["critical_stiffness"]
    stiff = simulate(make_scenario(rig(block__spring_stiffness=3 * limit, drive={"velocity": 2e-4, "duration": 0.6})))
    assert stiff.sizes["event"] == 0
    assert "slides" in stiff.attrs["verdict"]
    assert f"critical stiffness is {limit:.4g} N/m" in stiff.attrs["verdict"]


def test_above_the_critical_velocity_it_slides_and_names_it():
    data = simulate(make_scenario(rig(drive={"velocity": 3e-3, "duration": 1.5})))
    assert "slides" in data.attrs["verdict"]
    assert f"critical velocity is {1e6 * data.attrs['critical_velocity']:.3g} µm/s" in data.attrs["verdict"]
    assert data["velocity"].values[-1] == pytest.approx(3e-3, rel=0.02)


def test_too_short_a_run_says_how_long_loading_takes():
    data = simulate(make_scenario(rig(drive={"velocity": 2e-4, "duration": 0.2})))
    assert "full friction only after about 1.3" in data.attrs["verdict"]


@pytest.mark.slow
def test_a_hold_and_a_reversal():
    pieces = [
        {"velocity": 2e-4, "duration": 1.6},
        {"velocity": 0.0, "duration": 1.0},
        {"velocity": -2e-4, "duration": 3.5},
    ]
    data = simulate(make_scenario(rig(drive={"piece": pieces})))
    t = data["time"].values
    held = (t > 1.8) & (t < 2.6)
    assert np.ptp(data["displacement"].values[held]) < 2e-9
    last = data.isel(event=-1)
    assert last["onset"] > 2.6
    assert last["slip"] > 1e-5  # in the direction of the pull, which is now backwards
    assert data["displacement"].values[-1] < data["displacement"].values[held].mean() - 1e-5


def test_same_seed_same_bits():
    content = rig(drive={"velocity": 2e-4, "duration": 1.5}, sensor={"white": 1e-11, "random_walk": 1e-9, "seed": 4})
    first, second = (simulate(make_scenario(content)) for _ in range(2))
    xarray.testing.assert_identical(first, second)
    other = simulate(make_scenario(content).changed(sensor__seed=5))
    assert not np.array_equal(other["reading"], first["reading"])
    np.testing.assert_array_equal(other["displacement"], first["displacement"])


def test_an_effect_of_the_catalogue_acts():
    base = rig(drive={"velocity": 2e-4, "duration": 0.5})
    plain = simulate(make_scenario(base))
    drifting = simulate(make_scenario({**base, "effect": [{"type": "sensor-drift", "rate": "5 nm/s"}]}))
    np.testing.assert_allclose(drifting["displacement"], plain["displacement"], atol=1e-12)
    drift = (drifting["reading"] - plain["reading"]).values
    np.testing.assert_allclose(drift, 5e-9 * plain["time"].values, atol=1e-11)


def test_progress_ends_at_the_end_and_counts_events():
    heard: list[tuple[str, float]] = []
    simulate(make_scenario(rig()), lambda text, share: heard.append((text, share)))
    shares = [share for _, share in heard]
    assert shares == sorted(shares) and 0.0 < shares[-1] <= 1.0
    assert heard[-1][0].endswith("s simulated, 3 slips")


def test_an_output_that_would_not_fit_is_refused():
    with pytest.raises(InputError, match="too long"):
        simulate(
            make_scenario(rig(drive={"velocity": 2e-4, "duration": 0.5}, output__sampling_rate="100 MHz")).changed(
                drive__duration="5 s", drive__velocity="1 nm/s"
            )
        )


def test_the_default_tolerance_keeps_what_a_scenario_promises():
    """Recurrence to a thousandth, creep to a nanometre, against a tolerance a thousand times tighter."""
    base = make_scenario(rig(contact__bins=128))
    tight = {
        f"solver__{key}": getattr(base.file.solver, key) / 1000 for key in ("relative", "displacement", "velocity")
    }
    seen, exact = simulate(base), simulate(base.changed(**tight))
    assert exact.attrs["steps"] > 5 * seen.attrs["steps"]
    assert seen["recurrence"].values[1:] == pytest.approx(exact["recurrence"].values[1:], rel=1e-3)
    assert seen["slip"].values == pytest.approx(exact["slip"].values, rel=1e-3)
    assert seen["creep_before_slip"].values == pytest.approx(exact["creep_before_slip"].values, abs=1e-9)
