import copy
import pickle

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.provenance import Provenance
from stickslip.data.trace import Trace
from stickslip.errors import InputError


def test_trace_cannot_be_changed_from_outside():
    t, x = np.arange(5.0), np.arange(5.0)
    trace = Trace("a", t, displacement=x)
    x[0] = 99.0
    assert trace.displacement[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        trace.displacement[0] = 1.0
    with pytest.raises(AttributeError):
        trace.name = "b"


@pytest.mark.parametrize("again", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])  # noqa: S301  (bytes of its own)
def test_a_copy_says_the_same_and_cannot_be_changed_either(again):
    """As a worker of another process gets it."""
    t = np.arange(5.0)
    came = Provenance("run.csv", "ab12", "text", {"displacement": "x [um]"})
    trace = Trace("a", t, displacement=t**2, drive=Drive.constant(1e-4, 0.0, 4.0), virgin=True, provenance=came)
    found = again(trace)
    assert found is not trace and found.name == "a" and found.virgin and found.provenance == came
    assert np.array_equal(found.displacement, t**2) and np.array_equal(found.drive.positions, trace.drive.positions)
    for values in (found.time, found.displacement, found.drive.times):
        assert not values.flags.writeable
    with pytest.raises(TypeError):
        found.provenance.columns["displacement"] = "y"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"time": [0.0, 1.0, 1.0], "displacement": [0.0, 1.0, 2.0]}, "does not increase at sample 2"),
        ({"time": [0.0, np.nan, 1.0], "displacement": [0.0, 1.0, 2.0]}, "does not increase"),
        ({"time": [0.0, 1.0], "displacement": [0.0, 1.0, 2.0]}, "has 3 samples, time has 2"),
        ({"time": [0.0, 1.0], "displacement": [0.0, np.inf]}, "not finite"),
        ({"time": [0.0, 1.0]}, "no signal"),
        ({"time": [0.0], "displacement": [0.0]}, "has 1 samples"),
    ],
)
def test_trace_refuses(arguments, word):
    with pytest.raises(InputError, match=word):
        Trace("a", **{key: np.array(value) for key, value in arguments.items()})


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"role": "heldout"}, '(?s)no such role.*"held-out"'),  # it would have taken part in the fit
        ({"resolution": "8 nm"}, "resolution is not possible.*'8 nm'"),
        ({"noise": -1e-9}, "noise is not possible"),
        ({"spring_stiffness": np.nan}, "spring_stiffness is not possible"),
    ],
)
def test_trace_refuses_roles_and_sizes_that_are_none(change, word):
    trace = Trace("a", np.arange(3.0), displacement=np.arange(3.0), role="held-out", noise=None, hum=0.0)
    with pytest.raises(InputError, match=word):
        trace.replace(**change)


def test_a_part_of_a_trace_is_a_record_of_its_own():
    t = np.arange(0.0, 10.0, 0.5)
    whole = Trace(
        "a", t, displacement=t**2, normal_load=t + 1.0, drive=Drive.constant(2.0), virgin=True, missing=(1.0, 6.0)
    )
    part = whole.between("2000 ms", 7.5)
    assert part.time[0] == 2.0 and part.time[-1] == 7.5  # both ends, as in a campaign file and in xarray
    assert np.array_equal(part.displacement, part.time**2) and np.array_equal(part.normal_load, part.time + 1.0)
    assert part.drive is whole.drive and part.missing == (6.0,)
    assert not part.virgin and whole.between(stop=5.0).virgin
    assert [(r.kind, r.count) for r in part.repairs] == [("cut", 8)]
    assert whole.between() is whole
    with pytest.raises(InputError, match=r"(?s)less than two samples.*allowed: 0 s to 9.5 s"):
        whole.between(20.0)


def test_a_coarser_record_is_what_xarray_makes_of_it():
    t = np.arange(0.0, 1.0, 1e-3)
    x, load = np.cumsum(np.random.default_rng(1).normal(0.0, 1e-7, (2, t.size)), axis=1)
    whole = Trace("a", t, displacement=x, normal_load=load, drive=Drive.constant(2.0), walk=1e-9, virgin=True)
    coarse = whole.coarsened("0.14 kHz")  # means of 7 samples come nearest
    expected = whole.to_xarray().coarsen(time=7, boundary="trim").mean()
    for name in ("displacement", "normal_load", "time"):
        np.testing.assert_allclose(getattr(coarse, name), expected[name], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(coarse.drive.position(coarse.time), expected["load_point"], rtol=1e-12)
    assert coarse.virgin and coarse.walk == 1e-9 and coarse.sampling_rate == pytest.approx(1000.0 / 7.0)
    assert [(r.kind, r.count) for r in coarse.repairs] == [("coarsened", t.size - t.size // 7)]
    assert whole.coarsened(900.0) is whole
    for rate, word in (("2 kHz", "(?s)no coarser sampling.*up to 1 kHz"), (-5.0, "no coarser"), (1.5, "less than two")):
        with pytest.raises(InputError, match=word):
            whole.coarsened(rate)


def test_no_mean_reaches_over_a_gap():
    t = np.delete(np.arange(40.0), [13, 14, 15, 30])
    t = np.delete(t, np.flatnonzero((t > 15.0) & (t < 18.0)))  # 16 and 17 are lost too
    trace = Trace("a", t, displacement=t.copy(), missing=(12.0, 29.0))
    coarse = trace.coarsened(0.25)
    assert coarse.time.tolist() == [1.5, 5.5, 9.5, 19.5, 23.5, 27.5, 32.5, 36.5]
    assert coarse.missing == (9.5, 27.5) and np.array_equal(coarse.displacement, coarse.time)
    short = Trace("a", t, displacement=t.copy(), missing=(1.0, 12.0, 29.0, 38.0)).coarsened(0.25)
    assert short.missing == (7.5, 27.5)  # before the first mean, and after the last, there is none


@pytest.mark.parametrize("blur", [0.0, 0.2, 0.35, 0.8])  # of a count
def test_the_noise_of_means_is_that_of_counted_readings(blur):
    """Without noise all counts of a mean have the same error; noise of half a count makes their errors independent."""
    count, size, rng = 8e-9, 25, np.random.default_rng(5)
    truth = np.repeat(rng.random(4000), size) + np.repeat(np.arange(4000), size)
    x = count * np.round(truth + blur * rng.standard_normal(truth.size))
    noise = count * np.sqrt(blur**2 + 1.0 / 12.0)
    trace = Trace("a", np.arange(x.size) * 1e-4, displacement=x, noise=noise, resolution=count)
    coarse = trace.coarsened("400 Hz")
    measured = np.std(coarse.displacement - count * truth[::size])
    assert coarse.noise == pytest.approx(measured, rel=0.04)  # eight terms of the series leave 3 %
    assert coarse.resolution == count / size
    grid = coarse.displacement / coarse.resolution
    assert np.abs(grid - np.round(grid)).max() < 1e-6
    assert bool(coarse.warnings) == (blur < 0.2)


def test_hum_is_what_means_leave_of_it():
    t = np.arange(0.0, 2.0, 1e-3)
    trace = Trace("a", t, displacement=3e-9 * np.sin(99.3 * np.pi * t), hum=3e-9)
    coarse = trace.coarsened("200 Hz")
    left = np.ptp(coarse.displacement) / 2.0  # its phase goes through all values, for the mains are a little slow
    assert left < 2.8e-9 and coarse.hum == pytest.approx(left, rel=0.03)


def test_means_are_not_taken_of_means():
    """Rounding is the same in all samples of a count: its part of the noise is known of the record only."""
    t = np.arange(0.0, 1.0, 1e-3)
    once = Trace("a", t, displacement=t.copy(), noise=3e-9, resolution=8e-9).coarsened("200 Hz")
    with pytest.raises(InputError, match="coarsened already"):
        once.coarsened("50 Hz")


def test_traces_of_one_digest_have_the_same_numbers():
    t = np.arange(0.0, 1.0, 1e-2)
    trace = Trace("a", t, displacement=t**2, noise=1e-9, drive=Drive.constant(2.0))
    same = pickle.loads(pickle.dumps(trace.replace(name="b", warnings=("odd",))))  # noqa: S301  (bytes of its own)
    assert same.digest == trace.digest
    assert trace.replace(noise=np.float64(1e-9), walk=0).digest == trace.replace(noise=1e-9, walk=0.0).digest
    others = [
        trace.coarsened(50.0), trace.between(stop=0.5), trace.replace(noise=2e-9), trace.replace(role="held-out"),
        trace.replace(drive=Drive.constant(2.1)), trace.replace(displacement=None, velocity=t**2),
    ]  # fmt: skip
    assert len({trace.digest, *(other.digest for other in others)}) == 7


def test_a_trace_goes_to_xarray_and_back():
    t = np.arange(0.0, 3.0, 0.5)
    trace = Trace("a", t, displacement=t**2, normal_load=t + 1.0, drive=Drive.constant(2.0))
    found = trace.to_xarray()
    assert set(found) == {"displacement", "normal_load", "load_point"} and found.attrs["title"] == "a"
    assert {name: found[name].attrs["units"] for name in found.variables} == {
        "time": "s", "displacement": "m", "normal_load": "N", "load_point": "m"
    }  # fmt: skip
    np.testing.assert_array_equal(found.load_point, 2.0 * t)
    again = Trace.from_arrays(displacement=found.displacement, drive_position=found.load_point)
    assert np.array_equal(again.time, t) and np.array_equal(again.displacement, trace.displacement)
    with pytest.raises(ValueError, match="read-only"):
        found["displacement"][0] = 1.0


def test_drive_of_pieces_has_the_integral_of_its_velocities():
    drive = Drive.from_pieces([2.0, 5.0, 6.0], [1e-3, 0.0, -2e-3], start=1.0)
    t = np.linspace(1, 6, 1001)
    v = drive.velocity(t[:-1])
    assert np.allclose(np.concatenate([[0], np.cumsum(v * np.diff(t))]), drive.position(t), atol=2e-5)
    assert drive.position([1, 2, 5, 6]) == pytest.approx([0, 1e-3, 1e-3, -1e-3])
    assert list(drive.breakpoints) == [2.0, 5.0]
    assert drive.holds(0, 10) == [(2.0, 5.0)]
    # beyond its ends it goes on
    assert drive.position([0.0, 7.0]) == pytest.approx([-1e-3, -3e-3])


def test_a_drive_shows_its_velocities_and_not_its_arrays():
    assert repr(Drive.constant(-50e-6, 1.0, 3.0)) == "Drive(from 1 s: -50 µm/s until 3 s)"
    t = np.arange(0.0, 1e3)
    rough = repr(Drive(t, np.random.default_rng(3).random(t.size)))
    assert rough.endswith("... 999 pieces until 999 s)") and len(rough) < 200


def test_velocity_at_a_breakpoint_is_that_of_the_next_piece():
    drive = Drive.from_pieces([2.0, 5.0], [1e-3, 0.0])
    assert drive.velocity([2.0 - 1e-9, 2.0]) == pytest.approx([1e-3, 0.0])


def test_sampled_drive_stays_within_its_tolerance_and_is_short():
    t = np.arange(0, 20, 1e-3)
    ripple = 1e-6 * np.sin(2 * np.pi * t / 0.15)
    steady = 42e-6 * np.clip(t, 0, 8) + 42e-6 * np.clip(t - 10, 0, None)
    noise = np.random.default_rng(1).normal(0, 1e-8, t.size)
    short = Drive.from_samples(t, steady + noise, 6e-8)
    assert short.times.size < 40
    assert np.abs(short.position(t) - steady).max() < 2 * 6e-8
    assert short.speed == pytest.approx(42e-6, rel=1e-2)
    (hold,) = [h for h in short.holds(0, 20) if h[1] - h[0] > 0.1]
    assert hold == pytest.approx((8, 10), abs=0.02)
    rippled = Drive.from_samples(t, steady + ripple, 6e-8)
    assert np.abs(rippled.position(t) - steady - ripple).max() <= 2 * 6e-8
    assert rippled.times.size > 20 / 0.15


def test_speeds_are_those_that_last():
    """Steps between two speeds, one of them a little unsteady; a hold and a short jump back are none."""
    drive = Drive.from_pieces([10.0, 20.0, 30.0, 40.0, 50.0, 50.5], [1e-5, 1e-4, 1.1e-5, 0.0, 1e-4, -1e-3])
    assert drive.speeds(1.25) == pytest.approx([1.05e-5, 1e-4])
    assert Drive.constant(3e-6).speeds(1.25) == pytest.approx([3e-6])
    assert Drive.from_pieces([1.0, 2.0], [0.0, 0.0]).speeds(1.25) == []


def test_usual_speed_leaves_holds_out():
    assert Drive.from_pieces([1.0, 100.0], [3e-6, 0.0]).speed == pytest.approx(3e-6)
    assert Drive.constant(-2e-6).speed == pytest.approx(2e-6)
    assert Drive.constant(0.0).holds(0.0, 4.0) == [(0.0, 4.0)]


@pytest.mark.parametrize("times", [[0.0, 0.0], [1.0, 0.0], [0.0, np.nan]])
def test_drive_refuses_times_that_do_not_increase(times):
    with pytest.raises(InputError, match="increase"):
        Drive(np.array(times), np.array([0.0, 1.0]))
