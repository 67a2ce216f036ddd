"""From files to traces: units, drives, repairs, order of time, and runs that cannot be."""

import json
import tomllib

import numpy as np
import pytest
import scipy.io

from stickslip.cli import run as command
from stickslip.data.campaign import campaign_text, load_campaign, load_traces
from stickslip.data.drive import Drive
from stickslip.data.readers import beside
from stickslip.data.segment import segment
from stickslip.data.trace import Trace

TIME = 'time = { column = "time", unit = "s" }\n'
X = 'displacement = { column = "x", unit = "um" }\n'
DRIVE = 'drive_velocity = "50 um/s"\n'
LSB = 7.91e-3  # um


def only(path):
    (trace,) = load_traces(load_campaign(path))
    return trace


@pytest.fixture
def run(stick_slip):
    """Time in s and displacement in um, of counts with noise."""
    model = stick_slip(ring=150e-9)
    t = np.arange(0, model.stop, 1e-4)
    x = model.position(t) * 1e6 + np.random.default_rng(9).normal(0, 2e-3, t.size)
    return t, np.round(x / LSB) * LSB


def test_units_resolution_noise_and_provenance(campaign, run):
    t, x = run
    trace = only(campaign(TIME + X + DRIVE, rows=np.column_stack([t, x])))
    assert trace.time == pytest.approx(t)
    assert trace.displacement == pytest.approx(x * 1e-6, abs=1e-15)
    assert trace.resolution == pytest.approx(7.91e-9, rel=1e-3)
    # between rounding alone and rounding and noise as if they were independent
    assert 7.91e-9 / np.sqrt(12) < trace.noise < np.hypot(2e-9, 7.91e-9 / np.sqrt(12))
    assert trace.drive.position(t[-1]) == pytest.approx(50e-6 * t[-1])
    assert trace.provenance.file == "a.csv"
    assert len(trace.provenance.sha256) == 64
    assert dict(trace.provenance.columns) == {"time": "'time' [s]", "displacement": "'x' [um]"}
    assert trace.repairs == trace.warnings == ()
    with pytest.raises(TypeError):
        trace.provenance.columns["time"] = "other"


def test_a_virgin_record_is_counted_from_its_load_point(campaign, run):
    """A vibrometer's zero is anywhere; taken as it is, the spring would seem stretched and the first slip late."""
    t, x = run
    there = only(campaign(TIME + X + DRIVE + "virgin = true\n", rows=np.column_stack([t, x])))
    assert there.repairs == ()
    shifted = only(campaign(TIME + X + DRIVE + "virgin = true\n", rows=np.column_stack([t, x + 100.0])))
    assert shifted.displacement == pytest.approx((x - np.median(x[:5])) * 1e-6, abs=1e-15)
    assert [r.kind for r in shifted.repairs] == ["zero"]
    # how far the spring of another record is stretched as it begins is not known
    other = only(campaign(TIME + X + DRIVE, rows=np.column_stack([t, x + 100.0])))
    assert other.displacement == pytest.approx((x + 100.0) * 1e-6, abs=1e-15)
    assert other.repairs == ()
    # a load point that was read, in a part of the record: it may have been loaded before
    rows = np.column_stack([t, x + 100.0, 50.0 * t])
    read = 'drive_position = { column = "d", unit = "um" }\nvirgin = true\nstart = "0.02 s"\n'
    part = only(campaign(TIME + X + read, rows=rows, header="time,x,d"))
    assert [r.kind for r in part.repairs] == ["cut"]


def test_units_of_the_header_and_a_conflict(campaign, run, refuses):
    rows = np.column_stack(run)[:5000]
    both = 'time = { column = "time" }\ndisplacement = { column = "x" }\n' + DRIVE
    trace = only(campaign(both, rows=rows, header="time [s],x [um]"))
    assert trace.displacement[-1] == pytest.approx(rows[-1, 1] * 1e-6)
    refuses(
        lambda: only(campaign(both, rows=rows)), "trace[1].time.unit", "unit of column 'time' is missing", "write  unit"
    )
    trace = only(campaign(TIME + X + DRIVE, rows=rows, header="time [s],x [mm]"))
    assert "the file says column 'x' is in mm" in trace.warnings[0]
    refuses(lambda: only(campaign(both, rows=rows, header="time [s],x [V]")), "header of a.csv", "not one of m")


def test_columns_that_are_not_there(campaign, run, refuses):
    rows = np.column_stack(run)[:100]
    refuses(
        lambda: only(campaign(TIME + X + DRIVE, rows=rows, header="tme,x")),
        "c.toml",
        "trace[1].time.column",
        "did you mean 'tme'",
        "sampling_rate",
    )
    refuses(
        lambda: only(campaign(TIME + X + DRIVE, rows=rows, header="time,y")),
        "trace[1].displacement.column",
        "no column 'x' in a.csv",
    )


def test_time_that_runs_backwards_names_the_line(campaign, run, refuses):
    rows = np.column_stack(run)[:300]
    rows[200:, 0] -= 0.01
    refuses(
        lambda: only(campaign(TIME + X + DRIVE, rows=rows)), "a.csv", "line 202", "does not increase", "cut the file"
    )


def test_sampling_rate_in_place_of_time(campaign, run):
    t, x = run
    trace = only(campaign('sampling_rate = "10 kHz"\n' + X + DRIVE, rows=np.column_stack([t, x])))
    assert trace.time == pytest.approx(t)


def test_a_sampling_rate_is_for_the_signal_and_not_for_what_else_is_in_the_file(campaign, run, tmp_path):
    _, x = run
    path = campaign('sampling_rate = "10 kHz"\n' + X + DRIVE, rows=np.zeros((2, 2)))
    np.savez(tmp_path / "a.npz", calibration=np.ones(3), x=x)
    path.write_text(path.read_text().replace("a.csv", "a.npz"))
    assert only(path).time.size == x.size


def test_resets_outside_what_is_read_are_cut_with_it(campaign, run):
    t, x = run
    cleared = x.copy()
    for moment in (1.0, 2.5):
        cleared[t >= moment] -= cleared[t >= moment][0]
    body = 'start = "0.1 s"\nstop = "2 s"\n' + TIME + X.replace('"um"', '"um", resets = ["1 s", "2.5 s"]') + DRIVE
    trace = only(campaign(body, rows=np.column_stack([t, cleared])))
    assert [repair.count for repair in trace.repairs if repair.kind == "reset"] == [1]


def test_all_repairs_together_are_counted_and_exact(campaign, run):
    t, x = run
    bad = (x + 16.2) % (4096 * LSB) - 16.2
    spikes = [5050, 15000, 31234]
    bad[spikes] += 4.0
    bad[20000:20010] = np.nan
    keep = np.ones(t.size, bool)
    keep[40000:40005] = False
    stamps = t.copy()
    stamps[7001] = stamps[7000]
    rows = np.column_stack([stamps, bad])[keep]
    trace = only(campaign(TIME + X.replace('"um"', '"um", wrap = "32.4 um"') + DRIVE, rows=rows))
    kinds = {repair.kind: repair.count for repair in trace.repairs}
    assert {key: kinds[key] for key in ("nan", "duplicate-time", "spike")} == {
        "nan": 10,
        "duplicate-time": 1,
        "spike": 3,
    }
    # the samples lost to NaN and the doubled stamp leave holes in time as well
    assert kinds["dropped-samples"] == 5 + 10 + 1
    (gaps,) = (repair for repair in trace.repairs if repair.kind == "dropped-samples")
    assert "left out" in gaps.reason
    assert "are among them" in gaps.reason
    (lost,) = (repair for repair in trace.repairs if repair.kind == "nan")
    assert lost.where.endswith(f"({t[20000]:.6g} s)")
    assert kinds["wrap"] == np.floor((x[-1] + 16.2) / (4096 * LSB))
    assert all(repair.reason and repair.where for repair in trace.repairs)
    index = np.round(trace.time * 1e4).astype(int)
    true = x[index] - x[0]
    ours = trace.displacement * 1e6 - trace.displacement[0] * 1e6
    others = ~np.isin(index, spikes)
    assert np.abs(ours - true)[others].max() < 1e-6
    assert np.abs(ours - true).max() < 0.1
    assert len(trace.missing) == 3
    assert len(segment(trace).events) == 6


def test_spikes_can_be_left_alone(campaign, run):
    t, x = run
    x[5000] += 4.0
    rows = np.column_stack([t, x])
    assert [r.kind for r in only(campaign(TIME + X + DRIVE, rows=rows)).repairs] == ["spike"]
    trace = only(campaign(TIME + X + DRIVE + "spikes = false", rows=rows))
    assert trace.repairs == ()
    assert trace.displacement[5000] == pytest.approx(x[5000] * 1e-6)


def test_cutting_resets_and_clock(campaign, run):
    t, x = run
    x[25000:] -= x[25000]
    body = TIME + X.replace('"um"', '"um", resets = ["2.5 s"]') + DRIVE
    trace = only(campaign(body + 'start = "1 s"\nstop = "4 s"\nclock_error = "100 ppm"', rows=np.column_stack([t, x])))
    assert [r.kind for r in trace.repairs] == ["clock", "cut", "reset"]
    assert trace.time[0] == pytest.approx(1.0, abs=1e-3)
    assert trace.time[-1] == pytest.approx(4.0, abs=1e-3)
    assert trace.sampling_rate == pytest.approx(1e4 * (1 + 1e-4), rel=1e-7)
    assert np.abs(np.diff(trace.displacement)).max() < 1e-6


def test_drive_in_pieces_is_in_the_time_of_the_record(campaign, run):
    t, x = run
    ends = [("101 s", 50e-6), ("102 s", 0), ("110 s", 50e-6)]
    pieces = "drive = [" + ", ".join(f'{{ until = "{end}", velocity = {v} }}' for end, v in ends) + "]"
    trace = only(campaign(TIME + X + pieces, rows=np.column_stack([t + 100, x])))
    assert trace.drive.position([100, 101, 102, 103]) == pytest.approx([0, 50e-6, 50e-6, 100e-6])
    assert trace.drive.holds(100, 106) == [(101.0, 102.0)]


def test_drive_that_ends_before_the_record(campaign, run, refuses):
    t, x = run
    body = TIME + X + 'drive = [{ until = "5 s", velocity = "50 um/s" }]'
    refuses(lambda: only(campaign(body, rows=np.column_stack([t + 100, x]))), "drive ends at 5 s", "begins at 100 s")


def test_measured_drive(campaign, run):
    t, x = run
    drive = np.round(50 * np.clip(t, 0, 3) + 50 * np.clip(t - 4, 0, None), 2)
    body = TIME + X + 'drive_position = { column = "s", unit = "um" }'
    trace = only(campaign(body, rows=np.column_stack([t, x, drive]), header="time,x,s"))
    assert trace.drive_position == pytest.approx(drive * 1e-6)
    assert np.abs(trace.drive.position(t) - drive * 1e-6).max() < 4e-8
    assert trace.drive.times.size < 20
    ((start, stop),) = trace.drive.holds(0, 6)
    assert (start, stop) == pytest.approx((3, 4), abs=0.01)


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        ('displacement = { column = "x", unit = "mm" }', ["outruns", "trace[1].displacement", "'um' in place of 'mm'"]),
        ('velocity = { column = "v", unit = "m/s" }', ["block outruns the drive", "'mm/s' in place of 'm/s'"]),
        ('spring_force = { column = "f", unit = "N" }\nspring_stiffness = 1000', ["outruns", "'mN' in place of 'N'"]),
    ],
)  # fmt: skip
def test_units_wrong_by_a_thousand(campaign, run, refuses, signal, words):
    t, x = run
    v = np.gradient(x, t) * 1e-3  # mm/s
    force = 1000 * (50e-6 * t - x * 1e-6) * 1e3  # mN
    body = TIME + DRIVE + signal
    rows = np.column_stack([t, x, v, force])
    refuses(lambda: only(campaign(body, rows=rows, header="time,x,v,f")), *words)
    right = body.replace('"mm"', '"um"').replace('"m/s" }', '"mm/s" }').replace('"N"', '"mN"')
    assert only(campaign(right, rows=rows, header="time,x,v,f")).warnings == ()


def test_a_unit_wrong_by_a_thousand_tells_what_the_header_said(campaign, run, refuses):
    body = TIME + X.replace('"um"', '"mm"') + DRIVE
    words = ["'um' in place of 'mm'", "noted while reading", "the file says column 'x' is in um, the campaign says mm"]
    refuses(lambda: only(campaign(body, rows=np.column_stack(run), header="time [s],x [um]")), *words)


@pytest.mark.parametrize(
    ("stated", "quantised", "words"),
    [
        ("8 um", True, "states a resolution of 8 µm, but the values step by 7.91 nm"),
        ("0.1 nm", True, "states a resolution of 100 pm, but the values step by 7.91 nm"),
        ("1 um", False, "states a resolution of 1 µm, but the values scatter by"),
        ("7.91 nm", True, None),
        ("8 nm", True, None),
        ("8 nm", False, None),
    ],
)
def test_a_resolution_that_is_not_that_of_the_values_is_pointed_out(campaign, run, stated, quantised, words):
    t, x = run
    if not quantised:
        x = x + np.random.default_rng(2).normal(0, 5e-3, t.size)
    body = TIME + X.replace(" }", f', resolution = "{stated}" }}') + DRIVE
    warnings = only(campaign(body, rows=np.column_stack([t, x]))).warnings
    assert warnings == () if words is None else words in warnings[0]


def test_a_run_cut_around_one_slip_does_not_outrun_its_drive(campaign, run):
    t, x = run
    part = (t > 0.95) & (t < 1.05)
    trace = only(campaign(TIME + X + DRIVE, rows=np.column_stack([t, x])[part]))
    assert len(segment(trace).events) == 1


def test_a_block_that_hardly_moves_is_a_warning(campaign, run):
    t, x = run
    trace = only(campaign(TIME + X.replace('"um"', '"nm"') + DRIVE, rows=np.column_stack([t, x])))
    assert "a wrong unit, a counter that wraps" in trace.warnings[0]


def test_the_velocity_of_another_run_is_a_warning(campaign, run):
    t, x = run
    rows = np.column_stack([t, x])
    assert only(campaign(TIME + X + DRIVE, rows=rows)).warnings == ()
    trace = only(campaign(TIME + X + DRIVE.replace("50", "5"), rows=rows))
    assert "the velocity of the drive that of another run" in trace.warnings[0]


def test_spring_force_of_the_wrong_sign_is_a_warning(campaign, run):
    t, x = run
    force = -1000 * (50e-6 * t - x * 1e-6)
    body = TIME + DRIVE + 'spring_force = { column = "x", unit = "N" }\nspring_stiffness = 1000'
    trace = only(campaign(body, rows=np.column_stack([t, force])))
    assert "sign opposite" in trace.warnings[0]
    body = body.replace('"N"', '"-1 N"')
    trace = only(campaign(body, rows=np.column_stack([t, force])))
    assert trace.warnings == ()
    assert len(segment(trace).events) == 6


def test_a_channel_of_another_file(tmp_path, campaign):
    t = np.arange(0, 10, 0.015)
    np.savetxt(tmp_path / "tau.txt", np.column_stack([t[:-3], 0.5 * t[:-3]]))
    body = 'time = { column = 1, unit = "s" }\ndisplacement = { column = 2, unit = "mm" }\n'
    body += 'spring_force = { file = "tau.txt", column = 2, unit = "N" }'
    trace = only(campaign(body, rows=np.column_stack([t, 1e-3 * t**2]), header=""))
    assert trace.time.size == t.size - 3
    assert trace.spring_force == pytest.approx(0.5 * trace.time)
    assert {r.kind: r.count for r in trace.repairs} == {"resampled": t.size, "nan": 3}
    assert "tau.txt (sha256 " in trace.provenance.columns["spring_force"]


def test_matlab_campaign_with_a_generic_force_unit(tmp_path, stick_slip):
    model = stick_slip(v0=42e-6, period=1.6, duration=0.045)
    t = np.arange(0, model.stop, 5e-4)
    force = 168.0 * (model.v0 * t - model.position(t))
    scipy.io.savemat(tmp_path / "k.mat", {"t": t, "Fnorm": force / 0.3012})
    text = 'schema = 1\n[[trace]]\nfile = "k.mat"\ntime = { column = "t", unit = "s" }\n'
    text += 'spring_force = { column = "Fnorm", unit = "0.3012 N" }\n'
    text += 'drive_velocity = "42 um/s"\nspring_stiffness = "168 N/m"\n'
    (tmp_path / "c.toml").write_text(text)
    trace = only(tmp_path / "c.toml")
    assert trace.spring_force == pytest.approx(force)
    assert trace.spring_stiffness == 168.0
    assert len(segment(trace).events) == model.events


def test_a_simulated_run_is_read_back_as_a_measurement(tmp_path, stick_slip):
    model = stick_slip(ring=150e-9)
    t = np.arange(0, model.stop, 1e-4)
    drive = Drive.from_pieces([3.0, 3.5, 7.0], [50e-6, 0.0, 50e-6])
    made = Trace("held run", t, displacement=model.position(t), drive=drive, virgin=True, role="held-out")
    other = made.replace(name="plain", drive=Drive.constant(50e-6, 0.0, model.stop), virgin=False, role="")
    for name in ("one.csv", "two.csv"):
        np.savetxt(
            tmp_path / name,
            np.column_stack([t, made.displacement]),
            delimiter=",",
            header="time,displacement",
            comments="",
            fmt="%.17g",
        )
    rig = {
        "mass": 0.0894,
        "contacts": 4,
        "note": 'a "quoted" note',
        "spring_stiffness": {"guess": 1e3, "lower": 1.0, "upper": 1e4},
    }
    (tmp_path / "c.toml").write_text(campaign_text([made, other], ["one.csv", "two.csv"], rig))
    loaded = load_campaign(tmp_path / "c.toml")
    first, second = load_traces(loaded)
    assert (first.name, first.virgin, first.role) == ("held run", True, "held-out")
    assert np.array_equal(first.displacement, made.displacement)
    assert np.allclose(first.drive.position(t), drive.position(t), atol=1e-18)
    assert np.allclose(second.drive.position(t), 50e-6 * t, atol=1e-18)
    assert (loaded.rig.mass, loaded.rig.contacts, loaded.rig.note) == (0.0894, 4, 'a "quoted" note')


def test_messages_are_plain_text(campaign, run, refuses):
    error = refuses(lambda: only(campaign(TIME + X + DRIVE, rows=np.column_stack(run)[:1])), "fewer than two samples")
    assert json.dumps(str(error))
    assert "Traceback" not in str(error)


def test_a_load_that_no_model_takes_up_is_said_to_be_left_out(campaign, run, capsys):
    t, x = run
    rows = np.column_stack([t, x, 0.3 + 0.02 * t / t[-1]])
    load = 'normal_load = { column = "N", unit = "N" }\n'
    told = []
    for more in ("", load):
        path = campaign(TIME + X + more + DRIVE, rows=rows, header="time,x,N")
        assert command(["inspect", str(path), "--json"]) == 0
        told.append(json.loads(capsys.readouterr().out)["dropped"])
        assert command(["inspect", str(path)]) == 0
        assert ("left out: normal_load is not used by the models" in capsys.readouterr().out) == bool(more)
    assert not any("normal_load" in text for text in told[0])
    assert any("normal_load" in text and "mean 0.31 N, 0.3 to 0.32 N" in text for text in told[1])


def test_a_repair_that_was_asked_for_and_found_nothing_is_said(campaign, run):
    rows = np.column_stack(run)
    body = TIME + X.replace('"um"', '"um", wrap = "32.4 mm", resets = true') + DRIVE
    assert only(campaign(body, rows=rows)).provenance.notes == (
        "displacement: no jump of half of 'wrap', so nothing was unwrapped",
        "displacement: 'resets' is true, and the counter never jumps to zero",
    )


def test_slow_noise_is_stated_and_written_again(campaign, run, refuses):
    rows = np.column_stack(run)
    trace = only(campaign(TIME + X.replace('"um"', '"um", walk = "2 nm/s^0.5", hum = "3 nm"') + DRIVE, rows=rows))
    assert (trace.walk, trace.hum) == pytest.approx((2e-9, 3e-9))
    (again,) = tomllib.loads(campaign_text([trace], ["a.csv"], {"mass": 0.0894}))["trace"]
    assert (again["displacement"]["walk"], again["displacement"]["hum"]) == (trace.walk, trace.hum)
    wrong = campaign(TIME + X.replace('"um"', '"um", walk = "-2 nm/s^0.5"') + DRIVE, rows=rows)
    refuses(lambda: only(wrong), "walk", "out of range")


def test_of_the_files_beside_it_only_those_that_may_be_records_are_offered(tmp_path):
    for name in ("mine.CSV", "old.mat", "README.md", "script.py", "picture.png", ".hidden.csv", "c.toml"):
        (tmp_path / name).write_text("")
    assert sorted(beside(tmp_path / "missing.csv")) == ["mine.CSV", "old.mat"]
