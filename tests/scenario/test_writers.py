"""A simulated run written as a measurement and read back by the campaign reader."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.readers import read_columns
from stickslip.errors import InputError
from stickslip.simulation.scenario import make_scenario, simulate
from stickslip.simulation.scenario.writers import write_campaign, write_trace

from .conftest import rig

ENDINGS = (".csv", ".nc", ".mat", ".uff")


@pytest.mark.parametrize("ending", ENDINGS)
def test_columns_come_back(tmp_path, ending):
    t = np.arange(3001) / 3000.0  # a step no header of six digits can hold
    x = np.floor(1e4 * np.sin(t)) * 0.00791
    columns = {"time": (t, "s"), "displacement": (x, "um"), "drive_position": (50 * t, "um")}
    found = read_columns(write_trace(tmp_path / f"a{ending}", columns))
    for name, (values, _) in columns.items():
        np.testing.assert_allclose(found.data[name], values, rtol=1e-11, atol=1e-12)


def test_text_has_fifteen_digits_of_the_largest_value(tmp_path):
    """What is not finite, zero or too small for that is written too."""
    t = np.arange(2001) / 3000.0
    counts = np.floor(1e4 * np.sin(t)) * 0.00791
    odd = np.full(t.size, 1e-300)
    odd[:4] = np.nan, np.inf, -np.inf, 0.0
    path = write_trace(
        tmp_path / "a.csv", {"time": (t, "s"), "displacement": (counts, "um"), "odd": (odd, "N"), "none": (0 * t, "N")}
    )
    lines = path.read_text().splitlines()
    assert lines[0] == "time [s],displacement [um],odd [N],none [N]" and lines[-1].endswith(",1e-300,0")
    assert [line.split(",")[2] for line in lines[1:5]] == ["nan", "inf", "-inf", "0"]
    assert max(len(line.split(",")[1]) for line in lines[1:]) <= len("48.91544")  # no digits of binary fractions
    back = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(back[:, 0], t, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(back[:, 2], odd)


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.csv \.nc"):
        write_trace(tmp_path / "a.xls", {"time": (np.arange(3.0), "s")})


@pytest.mark.slow
@pytest.mark.parametrize("ending", ENDINGS)
def test_a_simulated_run_is_read_back_as_a_measurement(tmp_path, ending):
    """Counter wraps are undone; what comes back is the truth to one count."""
    content = rig(sensor={"counter_steps": 4096}, output={"sampling_rate": "5 kHz", "trace": f"run{ending}"})
    scenario = make_scenario(content)
    data = simulate(scenario)
    assert np.ptp(data["reading"].values) <= 4096 * 7.91e-9 < np.ptp(data["displacement"].values)
    (trace,) = load_traces(load_campaign(write_campaign(tmp_path, [scenario], [data])))
    np.testing.assert_allclose(trace.time, data["time"], atol=1e-10)
    behind = data["displacement"].values - trace.displacement
    assert behind.min() > -1e-12 and behind.max() < 7.92e-9
    assert trace.virgin
    assert trace.resolution == pytest.approx(7.91e-9)
    assert trace.drive.speed == pytest.approx(2e-4)


@pytest.mark.slow
def test_clears_are_handed_over(tmp_path):
    content = rig(sensor={"clear_at_arrest": True}, output={"sampling_rate": "5 kHz", "trace": "run.csv"})
    scenario = make_scenario(content)
    data = simulate(scenario)
    (trace,) = load_traces(load_campaign(write_campaign(tmp_path, [scenario], [data])))
    behind = data["displacement"].values - trace.displacement
    assert np.abs(behind).max() < 1e-7  # each join may lose a few counts of ringing
    assert np.ptp(data["reading"].values) < 0.7 * np.ptp(trace.displacement)


@pytest.mark.slow
def test_holds_channels_and_rig_are_handed_over(tmp_path):
    pieces = [{"velocity": 2e-4, "duration": 1.6}, {"velocity": 0, "duration": 0.5}]
    output = {"sampling_rate": "5 kHz", "trace": "run.mat", "channels": ["spring_force", "velocity"]}
    scenario = make_scenario(rig(drive={"piece": pieces}, output=output, contact__residual=1.0))
    campaign = load_campaign(write_campaign(tmp_path, [scenario], [simulate(scenario)]))
    (trace,) = load_traces(campaign)
    assert trace.displacement is None and trace.spring_force is not None and trace.velocity is not None
    assert trace.drive.holds(0.0, 2.1) == [(1.6, 2.1)]
    assert not trace.virgin
    assert campaign.rig.mass == pytest.approx(0.0894)
    assert campaign.rig.contacts == 4
    assert campaign.rig.friction_coefficient == 0.21


def test_several_runs_make_one_campaign(tmp_path):
    output = {"sampling_rate": "5 kHz", "trace": "run.csv", "channels": ["displacement", "drive_position"]}
    base = make_scenario(rig(output=output, drive={"velocity": 2e-4, "duration": 0.5}))
    runs = [base, base.changed(drive__velocity=1e-4, block__spring_stiffness=500.0)]
    campaign = load_campaign(write_campaign(tmp_path, runs, [simulate(run) for run in runs]))
    assert campaign.names == ["run-01", "run-02"]
    assert campaign.rig_of("run-01").spring_stiffness == 1000.0
    assert campaign.rig_of("run-02").spring_stiffness == 500.0
    speeds = [trace.drive.speed for trace in load_traces(campaign)]
    assert speeds == pytest.approx([2e-4, 1e-4], rel=1e-3)
