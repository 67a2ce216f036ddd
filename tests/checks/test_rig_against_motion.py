"""A wrong entry in a campaign file is noticed by the motion alone, and nothing is where all is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from stickslip.blind.generator import Run, make_campaign
from stickslip.errors import InputError
from stickslip.objects.diagnosis import diagnose_campaign

from .wrong_entries import findings, hidden, wrong

RUNS = (
    Run("v050", 5e-5, 5), Run("v100", 1e-4, 5), Run("v200", 2e-4, 5), Run("v400", 4e-4, 5),
    Run("holds", 1e-4, pieces=((3.0, 1e-4), (3.6, 0.0), (5.0, 1e-4), (6.0, 0.0), (7.5, 1e-4))),
)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rig") / "case"
    make_campaign(folder, 21, runs=RUNS, spring_known=True)
    return folder


def changed(folder: Path, kind: str, run: str, factor: float = 1.0) -> Path:
    """The campaign file with one entry wrong."""
    path = folder / f"{kind}-{run}.toml"
    path.write_text(wrong((folder / "campaign.toml").read_text(), kind, run, factor))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("run", ["v050", "v400", "holds"])
@pytest.mark.parametrize(
    ("kind", "what"), [("velocity", "drive velocity"), ("scale", "displacement scale"), ("clock", "time")]
)
@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_tenth_off_in_one_run_is_named_with_the_true_value(made, run, kind, what, factor):
    (found,) = findings(changed(made, kind, run, factor))
    assert (found.what, found.run, found.stops) == (what, run, True)
    assert found.value == pytest.approx(found.stated / factor, rel=0.02)
    assert abs(found.value - found.stated / factor) < 3.0 * found.std
    assert run in found.sentence


def test_a_wrong_sign_is_called_so_though_no_slip_is_seen(made):
    (found,) = findings(changed(made, "sign", "v100"))
    assert (found.what, found.run, found.stops) == ("sign", "v100", True)
    assert found.value == pytest.approx(-1.0, abs=0.02)


def test_a_wrong_sign_in_all_runs_is_said_once(made):
    text = (made / "campaign.toml").read_text()
    for run in RUNS:
        text = wrong(text, "sign", run.name, 1.0)
    path = made / "all-signs.toml"
    path.write_text(text)
    (found,) = findings(path)
    assert (found.what, found.run) == ("sign", None)
    with pytest.raises(InputError, match="which no spring can do"):
        diagnose_campaign(path, made / "out", jobs=1)


def test_a_unit_off_by_a_thousand_is_refused(made):
    refused = findings(changed(made, "unit", "v200"))
    assert isinstance(refused, str)
    assert "a unit is probably wrong by 10^3" in refused


def test_a_scale_that_all_runs_share_is_told_beyond_what_a_sensor_may_have(made):
    text = (made / "campaign.toml").read_text()
    for factor, count in ((1.02, 0), (1.15, 1)):
        every = text
        for run in RUNS:
            every = wrong(every, "scale", run.name, factor)
        path = made / "every.toml"
        path.write_text(every)
        found = findings(path)
        assert len(found) == count
        if found:
            assert found[0].run is None
            assert found[0].value == pytest.approx(factor, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "effects", "options"),
    [
        (21, (), {}),
        (22, (), {"new_lines": True}),
        (23, (), {"virgin": False}),
        (24, (hidden("sensor-gain", 1.0),), {}),
        (25, (hidden("wear", 1.0),), {"new_lines": True, "virgin": False}),
        (26, (hidden("sensor-drift", -1.0),), {}),
    ],
)
def test_nothing_is_said_where_nothing_is_wrong(tmp_path, seed, effects, options):
    make_campaign(tmp_path / "case", seed, effects, runs=RUNS, **options)
    assert findings(tmp_path / "case" / "campaign.toml") == ()


@pytest.mark.slow
def test_a_wrong_velocity_stops_the_name(made):
    path = changed(made, "velocity", "v100", 1.2)
    result = diagnose_campaign(path, made / "stopped", jobs=1)
    verdict = result["verdict"]
    assert (verdict["kind"], verdict["effects"], verdict["set"]) == ("unknown", [], [])
    assert verdict["text"].startswith("v100: over")
    (found,) = result["rig"]
    assert found["value"] == pytest.approx(1e-4, rel=0.02)
    assert result["ranking"] == []
    assert [step["model"] for step in result["ladder"]] == [["static"], ["static", "inertia"]]
    report = (made / "stopped" / "report.html").read_text()
    assert report.index('id="rig"') < report.index('id="ladder"')
