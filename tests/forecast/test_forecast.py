"""Forecasts of the next slip: scored rightly, calibrated on a known law, and blind to what comes later."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure
from scipy.integrate import quad
from scipy.stats import norm, t, truncnorm

import stickslip as ss
from stickslip.cli import run
from stickslip.data.trace import Trace
from stickslip.errors import ArgumentError, InputError
from stickslip.inference.forecast.known_record import Past
from stickslip.inference.forecast.predict import (
    MEMBERS,
    METHODS,
    Ahead,
    Forecaster,
    predictor,
    spread,
    take,
    times,
    waiting,
)
from stickslip.inference.forecast.rolling import SHARES, choose, moments, roll
from stickslip.inference.forecast.scoring import crps, quantiles, score, standard_error
from stickslip.inference.forecast.wander import ONSET, Wander, fit
from stickslip.objects import forecast
from stickslip.objects.forecast import QUANTILES, ForecastPlots
from stickslip.system.runstore import json_text, read_result

from .synthetic import LAW, SPEED, STIFFNESS, prepare, record, series


def test_the_score_is_the_integral_of_the_squared_difference():
    rng = np.random.default_rng(0)
    for truth in (-3.0, 0.1, 0.8, 5.0):
        members = rng.gamma(2.0, 1.0, 37)
        edges = np.sort(np.append(members, truth))

        def difference(x: float, members=members, truth=truth) -> float:
            return (np.mean(members <= x) - (truth <= x)) ** 2

        whole = sum(quad(difference, a, b)[0] for a, b in pairwise(edges))
        assert crps(members, truth) == pytest.approx(whole, rel=1e-6)


def test_the_score_of_many_members_is_the_normal_laws():
    """Gneiting & Raftery (2007), eq. 21."""
    middle = norm.ppf((np.arange(4000) + 0.5) / 4000)
    for z in (-1.5, 0.0, 0.7):
        closed = z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi)
        assert crps(middle, z) == pytest.approx(closed, abs=1e-3)


def test_quantiles_of_an_ensemble_are_those_of_the_distribution_it_stands_for():
    shares = [0.05, 0.25, 0.5, 0.75, 0.95]
    for m in (20, 100):
        np.testing.assert_allclose(quantiles((np.arange(m) + 0.5) / m, shares), shares, rtol=1e-12)
    # the interval that is called one of 90 % holds 90 %
    found = quantiles(norm.ppf((np.arange(MEMBERS) + 0.5) / MEMBERS), shares)
    np.testing.assert_allclose(norm.cdf(found), shares, atol=5e-4)


def test_coverage_errors_and_standard_errors():
    rng = np.random.default_rng(1)
    truths = rng.normal(size=4000)
    members = norm.ppf((np.arange(100) + 0.5) / 100)
    found = score([members] * 4000, truths)
    assert found["coverage_50"] == pytest.approx(0.5, abs=0.03)
    assert found["coverage_90"] == pytest.approx(0.9, abs=0.02)
    assert found["r2"] == pytest.approx(0.0, abs=1e-3)
    assert found["mae"] == pytest.approx(np.sqrt(2 / np.pi), abs=0.03)
    assert found["crps_std"] == pytest.approx(0.0074, rel=0.3)
    # ten moments of one slip are no ten slips
    own = rng.normal(size=300)
    assert standard_error(np.repeat(own, 10), np.repeat(np.arange(300), 10)) == pytest.approx(
        own.std(ddof=1) / np.sqrt(300), rel=0.01
    )


def test_on_a_straight_load_the_time_is_the_truncated_strength():
    rate, level, mean, std = 0.02, 1.0, 1.05, 0.04
    until = np.linspace(0.0, 20.0, 4000)
    found = times(until, level + rate * until[None, :], mean, std)
    law = truncnorm((level - mean) / std, np.inf, loc=mean, scale=std)
    expected = (law.ppf((np.arange(MEMBERS) + 0.5) / MEMBERS) - level) / rate
    np.testing.assert_allclose(found, expected, atol=0.01)
    late = times(until, level + 1.0 + rate * until[None, :], mean, std)  # far beyond what was thought possible
    assert (late >= 0).all() and np.isfinite(late).all() and late.mean() < found.mean()


def test_waiting_goes_on_beyond_the_longest_recurrence():
    seen = np.array([1.0, 2.0, 4.0])
    np.testing.assert_allclose(waiting(seen, 1.5), [0.5, 2.5])
    assert (waiting(seen, 5.0) > 0).all()


@pytest.mark.parametrize("tails", ["long", "normal"])
def test_the_spread_about_a_prediction_has_the_tails_of_the_errors(tails):
    """Of levels whose scatter is now small, now large, the normal law's 50 % interval holds far more than half."""
    scatter, rng = 3.0 * LAW.scatter[0], np.random.default_rng(2)
    arrays = series(1600, Wander(LAW.components, (1e-9, LAW.scatter[1])), 1)
    arrays["onset"] += scatter * (rng.standard_t(3, 1600) / np.sqrt(3.0) if tails == "long" else rng.normal(size=1600))
    law = fit(arrays, LAW.components, 800)
    found = spread(arrays, law, 800)
    later = {name: np.where(np.arange(1600) < 800, v, 2.0 * v + 1.0) for name, v in arrays.items()}
    assert spread(later, law, 800) == found, "nothing after the training tells"
    assert (found is None) == (tails == "normal")
    own, ahead, errors = predictor(law), Ahead.of(arrays, 800), []
    for i in range(1600):
        if i >= 800:
            mean, std = own.predict({c: ahead(arrays, i - 1)[c] for c in law.coordinates}, ONSET)
            errors.append(float((arrays["onset"][i] - mean) / std))
        take(own, arrays, i)
    laws = {"found": t(found[0], scale=found[1]) if found else norm(), "normal": norm()}
    held = {n: [np.mean(np.abs(errors) < d.ppf(0.5 + 0.5 * share)) for share in (0.5, 0.9)] for n, d in laws.items()}
    assert held["found"] == pytest.approx([0.5, 0.9], abs=0.04)
    assert (held["normal"][0] > 0.56) == (tails == "long")


def test_a_time_with_long_tails_is_the_truncated_t():
    rate, level, mean, std, freedom, scale = 0.02, 1.0, 1.05, 0.04, 3.0, 0.7
    until = np.linspace(0.0, 200.0, 400_000)
    found = times(until, level + rate * until[None, :], mean, std, None, (freedom, scale))
    law = t(freedom, loc=mean, scale=scale * std)
    begun = law.cdf(level)
    expected = (law.ppf(begun + (1.0 - begun) * (np.arange(MEMBERS) + 0.5) / MEMBERS) - level) / rate
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-3)


def test_creep_leads_from_an_arrest_to_the_next_onset_and_turns_do_not_count():
    arrays = {
        "time_arrest": np.arange(5.0),
        "path_onset": np.array([0.0, 1.1, 2.1, 3.1, 4.1]), "path_arrest": np.arange(5.0) + 1.0,
        "place_onset": np.array([0.0, 1.1, 1.0, 0.9, -0.1]), "place_arrest": np.array([1.0, 2.0, 1.9, 0.0, -1.0]),
        "direction": np.array([1.0, 1.0, -1.0, -1.0, -1.0]),
    }  # fmt: skip
    ahead = Ahead.of(arrays, 5)
    assert ahead.path == pytest.approx(0.1)
    # the third slip goes back: what lies between its arrest and the one before it is a turn
    assert ahead.place == pytest.approx(np.mean([0.1, 1.0, 0.1]))
    assert ahead(arrays, 4)["place"] == pytest.approx(-1.0 - ahead.place)


@pytest.fixture(scope="module")
def known():
    trace = record(2600, 0)
    past, laws = prepare(trace, 0.2)
    return past, laws


@pytest.mark.slow
@pytest.mark.parametrize("at", [None, 0.0, 0.5])
def test_on_a_known_law_the_intervals_hold_what_they_should(known, at):
    past, _ = known
    rolled = roll(past, LAW, at)
    scores = rolled.score()
    own = scores["wandering strength"]
    assert np.unique(rolled.slip).size > 1000
    assert own["coverage_50"] == pytest.approx(0.5, abs=0.03)
    assert own["coverage_90"] == pytest.approx(0.9, abs=0.03)
    assert all(own["crps"] < scores[name]["crps"] for name in scores if name != "wandering strength")


@pytest.mark.slow
def test_the_law_chosen_from_the_data_does_nearly_as_well(known):
    past, laws = known
    own = roll(past, laws[0].law).score()["wandering strength"]
    true = roll(past, LAW).score()["wandering strength"]
    assert own["crps"] < 1.05 * true["crps"]
    assert own["coverage_90"] == pytest.approx(0.9, abs=0.04)


@pytest.mark.slow
def test_the_rise_of_late_tells_of_the_onset(known):
    past, _ = known
    with_it = roll(past, LAW, 0.5).score()["wandering strength"]
    without = roll(past, LAW, 0.5, rise=False).score()["wandering strength"]
    assert with_it["crps"] < 0.7 * without["crps"]
    assert without["coverage_90"] == pytest.approx(0.9, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.0, 0.5])
def test_nothing_of_a_slip_is_counted_as_creep_before_it(width):
    """No forecast is scored once the force has passed its top, sharp or smoothed over half a second."""
    trace = record(600, 3, rate=50.0)
    assert trace.spring_force is not None
    n = int(0.5 * width * 50.0)
    force = np.convolve(np.pad(trace.spring_force, n, "edge"), np.full(2 * n + 1, 1.0 / (2 * n + 1)), "valid")
    past, _ = prepare(replace(trace, spring_force=force), 0.4)
    rolled = roll(past, LAW)
    time, arrest = past.trace.time, np.searchsorted(past.trace.time, past.arrays["time_arrest"])
    tops = [first + np.argmax(force[first:last]) for first, last in pairwise(arrest)]
    assert rolled.truth.size > 2000 and (rolled.sample <= np.array(tops)[rolled.slip - 1]).all()
    early = rolled.ahead(0.5)  # without the last half second, in which a smoothed record holds what follows
    assert (time[early.sample] + 0.5 <= past.arrays["time_onset"][early.slip]).all()
    assert early.truth.size == np.sum(rolled.truth >= 0.5) == len(early.members["constant strength"])
    assert early.gains()["constant strength"]["share"] > 0.7


def spoilt(trace: Trace, last: int, seed: int) -> Trace:
    """The same run, but with another future: every sample after ``last`` is changed."""
    rng = np.random.default_rng(seed)
    n = trace.time.size - last - 1
    other = {
        0: lambda v: v[last] + 0.5 * np.abs(v).max() * rng.normal(size=n),
        1: lambda v: np.full(n, v[last] + 0.01),
        2: lambda v: v[last + 1 :][::-1],
    }[seed]
    changed = {}
    for name in ("spring_force", "displacement", "drive_position"):
        values = getattr(trace, name)
        if values is not None:
            changed[name] = np.concatenate([values[: last + 1], other(values)])
    if "drive_position" in changed:  # a load point is driven on, if at another speed
        ahead = SPEED * np.array([0.3, 1.0, 2.5])[seed] * np.arange(1, n + 1) / trace.sampling_rate
        changed["drive_position"][last + 1 :] = trace.drive_position[last] + ahead
    return trace.replace(**changed)


def signal(kind: str) -> Trace:
    """A run of 90 slips by its force, its displacement, or by both with a measured load point."""
    trace = record(90, 5)
    at = SPEED * (trace.time - trace.time[0])
    if kind == "force":
        return trace
    x = at - trace.spring_force / STIFFNESS
    if kind == "displacement":
        return Trace.from_arrays(
            kind, time=trace.time, displacement=x, drive_velocity=SPEED, spring_stiffness=STIFFNESS
        )
    noisy = at + 2e-8 * np.random.default_rng(3).normal(size=at.size)
    if kind == "measured load point":
        return Trace.from_arrays(kind, time=trace.time, displacement=x, drive_position=noisy)
    return Trace.from_arrays(kind, time=trace.time, spring_force=trace.spring_force, drive_position=noisy)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["force", "displacement", "measured load point", "force and load point"])
def test_no_forecast_changes_when_the_future_does(kind):
    """Bit by bit, with settings, events, levels and what is learned found anew from the changed record."""
    trace = signal(kind)
    past, laws = prepare(trace, 0.5)
    law = laws[0].law
    forecaster = Forecaster(past, law)
    onsets = past.arrays["time_onset"]
    asked = [i for i in moments(past, forecaster.recurrence, None).tolist() if past.trace.time[i] < onsets[-1]][::60]
    # also the very last sample before an onset
    asked += [int(np.searchsorted(trace.time, t)) - 1 for t in onsets[onsets > past.split][1:20:9]]
    expected = {i: found for i in sorted(asked) if (found := forecaster.at(i)) is not None}
    assert len(expected) > 5
    for number, (i, before) in enumerate(expected.items()):
        changed = spoilt(trace, i, number % 3)
        if number == 0:  # laws, too
            other, other_laws = prepare(changed, 0.5)
            assert other_laws[0].law == law
            if kind == "force":
                assert choose(other, other_laws) == choose(past, laws)
        other = Past.of(changed, 0.5)
        after = Forecaster(other, law).at(i)
        assert after is not None
        for name, members in before.items():
            assert members.tobytes() == after[name].tobytes(), f"{name} at sample {i} saw the future"


def test_moments_do_not_depend_on_how_long_a_stick_will_be():
    trace = record(90, 5)
    past = Past.of(trace, 0.5)
    first = moments(past, 3.0, 0.5)
    cut = int(first[10])
    other = Past.of(spoilt(trace, cut, 1), 0.5)
    np.testing.assert_array_equal(moments(other, 3.0, 0.5)[:10], first[:10])


def test_pictures_are_drawn_in_axes_of_ones_own():
    """Made-up forecasts of ten slips, in a figure with other things."""
    n, units = np.arange(1.0, 11.0), {"units": "N"}
    data = {
        "onset": ("slip_number", 0.2 + 0.01 * np.sin(n), units), "arrest": ("slip_number", 0.1 + 0.0 * n, units),
        "time_onset": ("slip_number", n), "time_arrest": ("slip_number", n + 0.1), "truth": ("forecast", n),
        "quantile_times": (("forecast", "share"), np.outer(n, 1.0 + np.array(QUANTILES))),
        "pit": (("forecaster", "forecast"), np.tile(n / 11.0, (len(METHODS), 1))),
    }  # fmt: skip
    arrays = xarray.Dataset(data, {"forecaster": list(METHODS)}, {"title": "saw", "split": 5.0})
    plots, own = ForecastPlots(SimpleNamespace(arrays=arrays)), Figure()
    axes = own.subplots(3, 2)
    assert plots.levels(ax=axes[0]) is own and plots.calibration(ax=axes[1]) is own
    assert [a.has_data() for a in axes.flat] == [True] * 4 + [False] * 2 and len(own.axes) == 6
    assert [len(draw().axes) for draw in (plots.levels, plots.calibration)] == [2, 2]
    with pytest.raises(InputError, match="allowed: 2"):
        plots.levels(ax=own.axes[0])
    with pytest.raises(InputError, match="a Figure is no axes"):
        plots.levels(ax=own)


def write(folder, trace: Trace) -> str:
    """A campaign file with the force of a run."""
    np.savetxt(folder / "force.csv", np.column_stack([trace.time, trace.spring_force]), delimiter=",")
    path = folder / "campaign.toml"
    path.write_text(
        'schema = 1\ntitle = "Sawtooth"\n[rig]\nmass = "30 g"\nspring_stiffness = "168 N/m"\n[[trace]]\nname = "saw"\n'
        'file = "force.csv"\ntime = { column = 1, unit = "s" }\nspring_force = { column = 2, unit = "N" }\n'
        'drive_velocity = "42 um/s"\n'
    )
    return str(path)


@pytest.mark.slow
def test_the_command_says_what_the_object_says(tmp_path, capsys):
    path = write(tmp_path, record(150, 7))
    assert run(["forecast", path, "--at", "0.5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    shares: list[float] = []
    found = ss.load_campaign(path).forecast(at=0.5, progress=lambda text, share: shares.append(share))
    assert len(shares) > 10 and shares[0] == 0.0 and max(shares) > 0.9
    assert told["score"] == json.loads(json.dumps(found.score))
    assert {"crps", "crps_mean_recurrence", "coverage_50", "coverage_90", "r2", "mae"} <= set(told["score"])
    assert set(told["methods"]) == {"wandering strength", "mean recurrence", "constant strength", "slip-predictable"}
    assert told["train"]["of"] > 140 and told["train"]["slips"] < told["train"]["of"]
    assert found.next is None or found.next["0.5"] > 0
    assert "wandering strength" in repr(found) and "<table" in found._repr_html_()
    assert found.levels.sizes["slip_number"] == told["train"]["of"]
    assert len(found.wanders) == len(told["laws"])
    for picture in (found.plot.levels(), found.plot.calibration()):
        assert len(picture.axes) == 2


@pytest.mark.slow
def test_the_command_keeps_a_run_folder(tmp_path, capsys):
    path = write(tmp_path, record(150, 7))
    out = tmp_path / "kept"
    assert run(["forecast", path, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "time to the next slip by" in said
    assert "Forecasts are made at times spread evenly over the part after training" in said
    assert read_result(out)["kind"] == "forecast"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Forecast of the next slip" in page and page.count("<img") == 2
    assert run(["forecast", path, "--out", str(out)]) == 2
    assert "exists" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("stage", [("laws", 0.5), ("choosing", 0.0), ("forecasts", 0.9)])
def test_an_interrupted_forecast_resumes(tmp_path, monkeypatch, stage):
    """From the laws that were fitted and what was forecast, with the same answer as one that was never interrupted."""
    campaign, out = ss.load_campaign(write(tmp_path, record(120, 7))), tmp_path / "kept"
    whole = campaign.forecast(progress=lambda text, share: None)

    def stop(text: str, share: float) -> None:
        if text.startswith(stage[0]) and share >= stage[1]:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="finished parts are kept, and the same command resumes"):
        campaign.forecast(out=out, progress=stop)
    assert not out.exists()
    ready = len(list((tmp_path / "kept.partial" / "pieces").glob("*.npz")))
    made = []

    def counting(name: str, made_by: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *given: made.append(name) or made_by(*given)

    for name in ("compared", "choose", "roll"):
        monkeypatch.setattr(forecast, name, counting(name, getattr(forecast, name)))
    said: list[str] = []
    found = campaign.forecast(out=out, progress=lambda text, share: said.append(text))
    assert f"resuming from {ready} finished parts" in said
    laws = len(whole.laws)
    assert made.count("compared") == laws - min(ready, laws)
    assert made.count("choose") == (ready <= laws)
    assert len(made) == laws + 2 + len(SHARES) - ready
    plain, again = (json.loads(json_text({**f.result, "seconds": 0.0})) for f in (whole, found))
    assert plain == again == read_result(out) | {"seconds": 0.0}
    xarray.testing.assert_identical(whole.arrays, found.arrays)
    assert not (out / "pieces").exists()
    assert found.next == whole.next


def test_parts_of_another_forecast_are_not_taken_up(tmp_path):
    campaign, out = ss.load_campaign(write(tmp_path, record(40, 7))), tmp_path / "kept"
    said: list[str] = []

    def stop(text: str, share: float) -> None:
        said.append(text)
        if text.startswith("laws") and share > 0.15:
            raise KeyboardInterrupt

    for train in (0.5, 0.6, 0.6):
        with pytest.raises(KeyboardInterrupt, match="2 finished parts"):
            campaign.forecast(train=train, out=out, progress=stop)
        assert any("resuming" in text for text in said) == (said.count("levels of saw") == 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--train", "1.5"], "between 0 and 1"),
        (["--train", "0.01"], "slips in the part for training"),
        (["--train", "0.999"], "no slip after the part for training is left"),
        (["--at", "-1"], "before the stick begins"),
        (["--at", "50"], "no slip after the part for training is left"),
        (["--run", "sow"], "did you mean 'saw'"),
    ],
)
def test_bad_input_is_told_in_words_by_its_option_and_in_python_by_its_argument(tmp_path, capsys, options, said):
    path, (option, value) = write(tmp_path, record(60, 7)), options
    assert run(["forecast", path, *options]) == 2
    told = capsys.readouterr().err
    assert said in told and f"{option}: " in told
    name = option.removeprefix("--")
    with pytest.raises(ArgumentError, match=rf"(?s)(^|: ){name}: .*{said}"):
        ss.load_campaign(path).forecast(**{name: value if name == "run" else float(value)})


def test_too_few_slips_are_told(tmp_path, capsys):
    path = write(tmp_path, record(10, 7))
    assert run(["forecast", path]) == 2
    said = capsys.readouterr().err
    assert "campaign.toml" in said and "12 or more" in said and "to fix" in said


def test_without_a_slip_or_a_load_point_nothing_is_forecast():
    trace = record(60, 7)
    x = SPEED * (trace.time - trace.time[0]) - trace.spring_force / STIFFNESS
    alone = Trace.from_arrays("alone", time=trace.time, displacement=x)
    with pytest.raises(InputError, match="load point"):
        ss.Campaign.from_traces([alone]).forecast()
    still = Trace.from_arrays("still", time=trace.time, displacement=np.zeros(trace.time.size), drive_velocity=SPEED)
    with pytest.raises(InputError):
        ss.Campaign.from_traces([still]).forecast()


@pytest.mark.slow
def test_a_force_without_a_load_point_is_forecast_in_seconds_of_loading():
    trace = record(120, 9)
    bare = Trace.from_arrays("bare", time=trace.time, spring_force=trace.spring_force)
    found = ss.Campaign.from_traces([bare]).forecast()
    assert found.score["r2"] > 0.5 and found.score["crps"] < found.score["crps_mean_recurrence"]
