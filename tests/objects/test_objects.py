"""Objects for Python: what they say is what the records and an independent computation say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure

import stickslip as ss
from stickslip.errors import InputError, RunFolderError
from stickslip.inference.diagnose.decide import Judge
from stickslip.inference.force.heldout import unseen
from stickslip.inference.force.linearised import moved, prior_rows
from stickslip.inference.force.noise import left_out
from stickslip.inference.force.problem import Problem
from stickslip.objects.compare import on_the_same_points
from stickslip.system.runstore import read_result

pytestmark = pytest.mark.slow

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"
RIG = {"mass": "89.4 g", "spring_stiffness": "980.2 N/m", "contacts": 4, "normal_force": "0.31 N",
       "friction_coefficient": 0.21}  # fmt: skip


@pytest.fixture(scope="module")
def campaign():
    return ss.load_campaign(SHIPPED)


@pytest.fixture(scope="module")
def base(campaign):
    return campaign.fit()


@pytest.fixture(scope="module")
def aged(base):
    return base.add("contact-ageing")


def test_the_right_effect_makes_the_unseen_error_fall_to_one(base, aged):
    ladder = aged.ladder
    assert list(ladder["step"]) == ["static", "+ inertia", "+ contact-ageing"]
    assert ladder["unseen error"].iloc[1] > 2.0 and 0.85 < ladder["unseen error"].iloc[2] < 1.1
    assert ladder["gain"].iloc[2] > 500.0
    assert base.effects == () and aged.effects == ("contact-ageing",)


def test_taking_it_out_again_is_the_base(base, aged):
    again = aged.remove("contact-ageing")
    for name, value in base.values.items():
        assert again.values[name] == pytest.approx(value, abs=max(3.0 * base.std.get(name, 0.0), 1e-3 * abs(value)))


def test_the_measured_force_is_newtons(campaign, base):
    """Where the block creeps its inertia is nothing: the contact holds what the spring pulls."""
    data = base.force
    creeping = data.isel(point=np.flatnonzero((data.phase == "creep").values))
    pull = creeping.spring_force.values - base.values["rig.damping"] * creeping.velocity.values
    off = creeping.measured.values - pull
    # the event's own offset moves the force by the tangent times some nanometres
    assert np.abs(np.median(off)) < 2e-3 * base.values["contact.strength"]
    assert np.corrcoef(creeping.measured.values, pull)[0, 1] > 0.999


def test_errors_are_those_of_the_residuals(base):
    data = base.force
    kept = ~data.left_out.values
    z = base.residuals.values
    for run in np.unique(data.run.values):
        for phase in np.unique(data.phase.values):
            own = kept & (data.run.values == run) & (data.phase.values == phase)
            assert base.errors.loc[phase, run] == pytest.approx(np.sqrt(np.mean(z[own] ** 2)), rel=1e-12)


def test_deviations_of_errors_are_those_of_leaving_out_events(base):
    """Against the jackknife over events."""
    data = base.force
    kept = ~data.left_out.values
    z, event = base.residuals.values[kept], base.force_fit.problem.of[kept]
    left = np.array([np.sqrt(np.mean(z[event != e] ** 2)) for e in np.unique(event)])
    jackknife = np.sqrt((left.size - 1) / left.size * np.sum((left - left.mean()) ** 2))
    assert base.error_deviations.loc["all", "all"] == pytest.approx(jackknife, rel=0.1)
    assert base.ladder["error std"].iloc[-1] == base.error_deviations.loc["all", "all"]


def test_a_model_set_by_hand_has_no_error_on_unseen_runs(base):
    moved = base.with_values({"weakening.drop": 0.2})
    assert np.isnan(moved.unseen_error) and "none on unseen runs, for nothing is fitted" in repr(moved)


def test_values_set_by_hand_move_the_force_as_the_derivatives_say(base):
    """A step in a parameter, small against where the force bends, against the slopes of the fit."""
    name, step = "weakening.drop", 1e-6
    moved = base.with_values({name: base.values[name] + step})
    i = [f.name for f in base.free].index(name)
    f = base.free[i]
    slope = base.force_fit.slopes.shared[:, i] / f.slope(float(base.force_fit.point.z[i]))
    change = moved.force.residual.values - base.force.residual.values
    assert np.linalg.norm(change - slope * step) < 1e-3 * np.linalg.norm(slope * step)
    assert moved.by_hand and moved.values["rig.damping"] == base.values["rig.damping"]
    assert moved.errors.notna().any(axis=None) and moved.error > 0.0
    assert "slopes" not in vars(moved.force_fit)  # which take most of the time, and a hand does not wait for
    assert moved.covariance.shape == base.covariance.shape


def test_the_deviation_of_the_residual_is_that_of_draws_of_the_parameters(base):
    """Forces of draws from the covariance, so near that no weight of an element is drawn below zero."""
    found, size, draws = base.force_fit, 1e-3, 400
    scale = np.sqrt(np.diag(found.covariance))  # of newtons and of nanometres
    values, vectors = np.linalg.eigh(found.covariance / np.maximum(np.outer(scale, scale), 1e-300))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = []
    for z in np.random.default_rng(3).standard_normal((draws, values.size)):
        point = moved(found.point, size * root @ z, found.point.events)
        drawn.append(found.problem.forces(point).residual)
    ratio = base.residual_std.values / (np.std(drawn, axis=0) / size)
    assert np.abs(ratio - 1.0).max() < 5.0 / np.sqrt(2.0 * draws)
    assert base.residual_std.attrs["units"] == "N" and (base.residual_std.run == base.force.run).all()


def test_statistics_are_those_of_independent_residuals_and_determined_parameters(base, aged):
    data, found, told = base.force, base.force_fit, base.statistics
    assert told["points"] == (~data.left_out).sum()
    assert told["events"] == len(set(zip(data.run.values.tolist(), data.event.values.tolist(), strict=True)))
    assert told["free parameters"] == len(base.free) and told["evaluations"] == found.evaluations
    # the events' own as they are found, not marginalised
    squares = found._system.plain.squares(found.blocks(found.residual), found.point.events)
    assert told["chi-square"] == pytest.approx(squares, rel=1e-4)
    # of what can move, less what the priors determine of it
    prior, target = prior_rows(found.problem, found.point)
    assert told["cost"] - told["-2 log-likelihood"] == pytest.approx(
        target @ target + found.known.prior(found.scatter.sizes)
    )
    determined = np.count_nonzero(np.diag(found.covariance)) - np.trace(prior @ found.covariance @ prior.T)
    assert told["effective parameters"] == pytest.approx(determined, rel=2e-3)
    counted = told["effective parameters"] + told["sizes"]
    assert told["AIC"] == pytest.approx(told["-2 log-likelihood"] + 2.0 * counted)
    assert told["BIC"] == pytest.approx(told["-2 log-likelihood"] + np.log(told["events"]) * counted)
    better = aged.statistics - told
    assert better["free parameters"] == 4 and better["AIC"] < better["BIC"] < -1000.0
    off = aged.with_values({"weakening.drop": 1.02 * aged.values["weakening.drop"]}).statistics
    assert 0.8 < aged.statistics["reduced chi-square"] < 1.2 and off["reduced chi-square"] > 2.0


def test_a_printed_fit_says_in_whose_floors_its_error_is_and_which_parameters_were_fitted(base, aged):
    """The same base has an error of 1.3 of its own floors, and of 2.8 of those of a better model."""
    for text in (repr(base), base._repr_html_()):
        assert f"error: {base.error:.3g} floors of this model on fitted runs, {base.unseen_error:.3g} on unseen" in text
        assert "Models are compared in floors of one of them: ladder, ss.compare" in text
        assert text.count("fitted") == 1 + len(base.free) and "given" in text and "measured" in text
    assert aged.ladder["error"].iloc[1] > 1.5 * base.error
    whole = ["points", "events", "free parameters", "sizes", "evaluations"]
    assert all(isinstance(base.statistics[name], int) for name in whole)
    assert repr(base.statistics[["free parameters"]]).splitlines()[1].endswith(f" {len(base.free)}")


def test_a_fit_comes_back_from_where_a_hand_left_it(base):
    name = "weakening.slip_distance"
    away = base.with_values({name: "1.3 um"})
    assert away.error > 1.5 * base.error
    back = away.refit()
    assert back.values[name] == pytest.approx(base.values[name], abs=4.0 * base.std[name])


def test_what_is_locked_stays(base):
    held = base.with_values({"weakening.drop": 0.2}).refit(locked=["weakening.drop"])
    assert held.values["weakening.drop"] == pytest.approx(0.2, abs=1e-7)
    drop, std = base.values["weakening.drop"], base.std["weakening.drop"]
    assert held.refit().values["weakening.drop"] == pytest.approx(drop, abs=4.0 * std)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"weakening.dorp": 0.2}, "weakening.drop"),
        ({"weakening.drop": 2.0}, "out of range"),
        ({"rig.damping": "3 m"}, "not one of"),
        ({"contact.strength": 0.0}, "more than 0 N"),
    ],
)
def test_a_value_that_cannot_be_set_is_refused_in_words(base, values, said):
    with pytest.raises(InputError, match=said):
        base.with_values(values)


def test_an_effect_is_added_once_and_taken_out_once(aged, base):
    with pytest.raises(InputError, match="already"):
        aged.add("contact-ageing")
    with pytest.raises(InputError, match="not in the model"):
        base.remove("contact-ageing")


def test_covariance_is_that_of_the_deviations(aged):
    c = aged.covariance
    assert c.attrs["units"] == "unit * other_unit"
    for f in aged.free:
        assert c.sel(parameter=f.name).unit == f.unit and c.sel(other=f.name).other_unit == f.unit
        assert np.sqrt(float(c.sel(parameter=f.name, other=f.name))) == pytest.approx(aged.std[f.name], rel=1e-9)
    assert np.linalg.eigvalsh(c.values / np.sqrt(np.outer(np.diag(c), np.diag(c)))).min() > -1e-9


def test_the_strength_follows_a_locked_parameter_as_the_covariance_says(base):
    """Where everything else is best for a given value, a normal distribution has its mean given that value."""
    name, c = "weakening.slip_distance", base.covariance
    assert c.parameter.values.tolist() == list(base.std) and c.sel(parameter="contact.strength").unit == "N"
    there, held = (base.with_values({name: base.values[name] + k * base.std[name]}).refit(name) for k in (0.0, 0.3))
    step = held.values[name] - there.values[name]
    expected = step * float(c.sel(parameter="contact.strength", other=name)) / base.std[name] ** 2
    assert abs(expected) > 0.2 * base.std["contact.strength"]
    assert held.values["contact.strength"] - there.values["contact.strength"] == pytest.approx(expected, rel=0.1)


def test_what_is_saved_is_what_is_shown(aged, tmp_path):
    folder = aged.save(tmp_path / "run")
    kept = read_result(folder)
    assert kept["ladder"][-1]["train_error"] == pytest.approx(aged.error, rel=1e-9)
    assert kept["ladder"][-1]["heldout_error"] == pytest.approx(aged.unseen_error, rel=1e-9)
    again = ss.load_run(folder)
    assert again.parameters.loc["contact-ageing.rate", "value"] == pytest.approx(aged.values["contact-ageing.rate"])
    free = aged.predict()
    assert kept["ladder"][-1]["free"]["recurrence"]["relative"] == pytest.approx(free.loc["all", "recurrence"])
    assert (folder / "report.html").stat().st_size > 10_000


def test_a_fit_that_was_saved_goes_on(aged, campaign, tmp_path):
    moved = aged.with_values({"contact-ageing.rate": 1.1 * aged.values["contact-ageing.rate"]})
    for number, fit in enumerate((aged, moved)):
        folder = fit.save(tmp_path / str(number))
        again = ss.load_fit(folder, SHIPPED)
        assert again.effects == ("contact-ageing",) and again.by_hand == fit.by_hand
        assert again.values == fit.values and again.error == fit.error
        assert np.array_equal(again.unseen_error, fit.unseen_error, equal_nan=True)
        np.testing.assert_array_equal(again.covariance, fit.covariance)
        pd.testing.assert_frame_equal(again.ladder, fit.ladder)
    assert ss.load_fit(folder, campaign).remove("contact-ageing").effects == ()


def test_a_diagnosis_goes_on_from_its_folder(campaign, tmp_path):
    """Its best model is there again with the folder; without one its result alone can be kept."""
    made = campaign.diagnose(candidates=["wear"], max_effects=1, jobs=1, out=tmp_path / "run")
    kept = ss.Diagnosis(campaign, None, made.result, made.variables, tmp_path / "run")
    assert kept.best.values == made.best.values
    assert ss.load_fit(made.save(tmp_path / "again"), campaign).values == made.best.values
    alone = ss.Diagnosis(campaign, None, made.result, made.variables)
    assert not (alone.save(tmp_path / "alone") / "models.npz").exists()
    with pytest.raises(RunFolderError, match="only the result"):
        _ = alone.best


def test_a_fit_goes_on_with_its_own_data_only(aged, campaign, tmp_path):
    folder = aged.save(tmp_path / "run")
    with pytest.raises(InputError, match="other data"):
        ss.load_fit(folder, ss.Campaign.from_traces(campaign.traces[:2], {"mass": "89.4 g"}))
    models = folder / "models.npz"
    models.write_bytes(models.read_bytes()[:500])
    with pytest.raises(RunFolderError, match="damaged"):
        ss.load_fit(folder, campaign)
    models.unlink()
    with pytest.raises(RunFolderError, match="keeps no fit"):
        ss.load_fit(folder, campaign)


@pytest.mark.parametrize("kind", ["numpy", "pandas", "xarray"])
def test_a_campaign_of_arrays_is_the_campaign_of_files(campaign, base, kind):
    """The same numbers by hand: the same fit, whatever they came in."""

    def given(values, unit):
        if kind == "pandas":
            return pd.Series(values)
        if kind == "xarray":
            return xr.DataArray(values * 1e6, attrs={"units": f"u{unit}"})
        return values

    traces = [
        ss.Trace.from_arrays(
            t.name, time=t.time if kind != "pandas" else pd.Series(t.time), displacement=given(t.displacement, "m"),
            drive_velocity=f"{t.drive_velocity * 1e6:.9g} um/s" if len(t.drive.times) == 2 else None,
            drive_position=None if len(t.drive.times) == 2 else t.drive.position(t.time),
            resolution=t.resolution, noise=t.noise, virgin=t.virgin,
        )
        for t in campaign.traces
    ]  # fmt: skip
    made = ss.Campaign.from_traces(traces, RIG, "by hand")
    assert [len(e.events) for e in made.events] == [len(e.events) for e in campaign.events]
    if kind == "numpy":
        found = made.fit()
        for name, value in base.values.items():
            assert found.values[name] == pytest.approx(value, abs=max(base.std.get(name, 0.0), 1e-3 * abs(value)))
        assert {record["file"] for record in found.result["inputs"]} == set(made.names)


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"time": [0.0, 1.0, 2.0]}, "no signal"),
        ({"time": [0.0, 1.0, 1.0], "displacement": [0.0, 1.0, 2.0]}, "does not increase"),
        ({"time": [0.0, 1.0], "displacement": [0.0, 1.0, 2.0]}, "samples"),
        ({"time": [0.0, 1.0, 2.0], "displacement": ["a", "b", "c"]}, "no numbers"),
        ({"time": [0.0, 1.0, 2.0], "displacement": [0.0, 1.0, 2.0], "drive_velocity": "3 N"}, "drive_velocity"),
        ({"time": [0.0, 1.0, 2.0], "displacement": [0.0, 1.0, 2.0], "drive_velocity": 1e-5,
          "drive_position": [0.0, 1.0, 2.0]}, "more than once"),
    ],
)  # fmt: skip
def test_arrays_that_cannot_be_used_are_refused_in_words(arrays, said):
    with pytest.raises(InputError, match=said):
        ss.Trace.from_arrays(**arrays)


def test_times_are_those_that_the_signal_carries():
    x = np.array([0.0, 1.0, 3.0, 4.0]) * 1e-6
    seconds = 0.5 * np.arange(4)
    dates = pd.Timestamp("2026-01-01") + pd.to_timedelta(seconds, unit="s")
    in_ms = {"t": ("t", 1e3 * seconds, {"units": "ms"})}
    for signal in (
        pd.Series(x, index=seconds), pd.Series(x, index=dates), pd.Series(x, index=pd.to_timedelta(seconds, unit="s")),
        xr.DataArray(x, dims="t", coords=in_ms), xr.DataArray(x, dims="t", coords={"t": dates}),
    ):  # fmt: skip
        made = ss.Trace.from_arrays(displacement=signal, resolution=1e-6, noise=1e-7)
        np.testing.assert_allclose(made.time, seconds, atol=1e-12)
        np.testing.assert_array_equal(made.displacement, x)
    for signal in (x, list(x), pd.Series(x), xr.DataArray(x, dims="t")):
        with pytest.raises(InputError, match="time: no times are given"):
            ss.Trace.from_arrays(displacement=signal)


def test_a_rig_that_cannot_be_used_is_refused_in_words(campaign):
    with pytest.raises(InputError, match="unknown key 'masss'"):
        ss.Campaign.from_traces(campaign.traces, {"masss": "1 kg"})
    with pytest.raises(InputError, match="same name"):
        ss.Campaign.from_traces([campaign.traces[0]] * 2, RIG)


def test_notebooks_show_tables_and_escape_what_comes_from_files(campaign, base):
    for made in (campaign, base):
        html = made._repr_html_()
        assert html.count("<table") >= 1 and "</div>" in html
    named = ss.Campaign.from_traces([campaign.traces[0].replace(name="<script>x</script>")], RIG, "<b>t</b>")
    assert "<script>" not in named._repr_html_() and "<b>" not in named._repr_html_()


def test_a_fit_says_which_parameters_are_tied(base):
    """Of draws from its covariance."""
    found = base.correlations
    names = list(base.covariance.parameter.values)
    scale = np.sqrt(np.diag(base.covariance.values))
    whitened = base.covariance.values / np.outer(scale, scale)
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(len(names)), whitened, 40_000)
    for _, one, other, r in found.itertuples():
        at = [names.index(one), names.index(other)]
        assert r == pytest.approx(np.corrcoef(draws[:, at].T)[0, 1], abs=0.02)
    assert len(found) == len(names) * (len(names) - 1) / 2 and found.correlation.abs().is_monotonic_decreasing
    strongest = found.iloc[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("stickslip.objects.fit.TIED", abs(strongest.correlation) - 1e-6)
        assert (
            f"determined only together: {strongest['of']} and {strongest['and']} ({strongest.correlation:.2f})"
            in repr(base)
        )
        patch.setattr("stickslip.objects.fit.TIED", 1.0)
        assert "determined only together" not in repr(base)


def test_fits_are_compared_by_what_they_predict(campaign, base, aged):
    found = ss.compare({"base": base, "aged": aged})
    assert list(found.index) == ["aged", "base"] and found.loc["aged", ["behind", "+-"]].tolist() == [0.0, 0.0]
    columns = ["error", "error std", "unseen error", "unseen std"]  # all in floors of the better one, as its ladder has
    assert np.allclose(found.loc[["base", "aged"], columns], aged.ladder[columns].iloc[1:], rtol=1e-9)
    # as a diagnosis judges the effect beside the base, on common points
    same = on_the_same_points({"base": base.force_fit, "aged": aged.force_fit})
    judged = Judge(same["base"], 1).beside(same["aged"], 1)
    assert found.loc["base", "behind"] == pytest.approx(judged.unseen.sum(), rel=1e-9)
    assert 0.0 < found.loc["base", "+-"] < 0.2 * found.loc["base", "behind"]
    assert found.weight.sum() == pytest.approx(1.0) and found.loc["aged", "weight"] > 0.95
    with pytest.raises(InputError, match="'holds' is a fit of other runs than 'all'"):
        ss.compare({"all": base, "holds": campaign.fit(holdout=["v050", "v100", "v200"])})
    with pytest.raises(InputError, match="nothing to compare"):
        ss.compare({})


def test_another_set_of_outliers_is_no_difference_of_models(base):
    """A point left out costs likelihood: two fits of one model with other outliers are still equally good."""
    found = base.force_fit
    dropped = found.dropped.copy()
    dropped[np.flatnonzero(~dropped)[::400]] = True
    known = found.known.without(found.blocks(left_out(found.problem, dropped)))
    fewer = replace(found, known=known, dropped=dropped)
    one, other = on_the_same_points({"all": found, "fewer": fewer}).values()
    assert unseen(fewer).cost.sum() - unseen(found).cost.sum() > 30.0
    assert unseen(one).cost == pytest.approx(unseen(other).cost, rel=1e-9)


def test_pictures_have_units(aged):
    for name in ("trace", "force", "creep", "residual", "backbone", "errors"):
        made = getattr(aged.plot, name)()
        labels = [a.get_xlabel() + a.get_ylabel() for a in made.axes]
        assert name == "errors" or any(" / " in label for label in labels), name
    with pytest.raises(InputError, match="age"):
        aged.plot.residual("agee")


def test_pictures_are_drawn_in_axes_of_ones_own(base):
    """In a figure with other things, as for a paper."""
    for name in ("trace", "force", "creep", "residual", "backbone", "errors"):
        own = Figure()
        axes = own.subplots(3, 1)
        ax = axes[:2] if name == "force" else axes[0]
        assert getattr(base.plot, name)(ax=ax) is own and len(own.axes) == 3 and not own.legends
        assert [a.has_data() for a in axes] == [True, name == "force", False], name
    with pytest.raises(InputError, match="allowed: 2"):
        base.plot.force(ax=Figure().subplots())


def test_a_value_set_by_hand_costs_one_evaluation_without_derivatives(base):
    """A slider asks for ten a second."""
    calls = []
    evaluated = Problem._evaluated

    def counted(self, point, whole):
        calls.append(whole)
        return evaluated(self, point, whole)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Problem, "_evaluated", counted)
        _ = base.with_values({"weakening.drop": 0.2}).error
    assert calls == [False]


def test_a_drive_in_pieces_is_that_of_the_file(campaign):
    """The last run of the campaign was held twice."""
    run = campaign["holds"]
    ends = [*run.drive.breakpoints, run.time[-1]]
    speeds = run.drive.velocity(np.array([run.time[0], *run.drive.breakpoints]))
    made = ss.Trace.from_arrays(
        "x", time=run.time, displacement=run.displacement,
        drive=[(f"{end:.6f} s", f"{v * 1e6:.6f} um/s") for end, v in zip(ends, speeds, strict=True)],
    )  # fmt: skip
    assert np.abs(made.drive.position(run.time) - run.drive.position(run.time)).max() < 1e-9


def test_with_the_hidden_effect_slips_come_when_they_were_measured(base, aged):
    """Those of the base come too early or late, those of the model with ageing in time; sizes agree.

    The way of the drive until then is the error of the spring's force.
    """
    way: dict[str, list[np.ndarray]] = {"base": [], "aged": []}
    for run in ("v050", "v100", "v200", "v400"):
        for name, fit in (("base", base), ("aged", aged)):
            found = fit.simulate_cycles(run)
            late = (found.half - found.measured_half).values[1:]  # the first is that of a virgin contact
            way[name].append(1e-6 * float(run[1:]) * late)
            np.testing.assert_allclose(found.slip[1:], found.measured_slip[1:], rtol=0.02)
            assert (found.measured_half > found.measured_onset).all()
            assert (found.measured_half < found.measured_arrest).all()
    before, after = (np.sqrt(np.mean(np.concatenate(way[name]) ** 2)) for name in ("base", "aged"))
    assert before > 2e-7
    assert after < 0.1 * before


def test_every_cycle_begins_at_the_measured_arrest(base):
    found = base.simulate_cycles("v200")
    np.testing.assert_allclose(found.time[1:, 0], found.measured_arrest[:-1], atol=1e-3)  # the top of the ringing
    assert (np.diff(found.time, axis=1) >= 0.0).all()


def test_a_run_that_is_none_is_refused(base):
    with pytest.raises(InputError, match="v050"):
        base.simulate_cycles("v51")
