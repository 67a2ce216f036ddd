"""The fitted model run freely: right where nothing is missing, off where something is, and it says so."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from stickslip.inference.diagnose import free_simulation as confirming
from stickslip.inference.diagnose.final_comparison import settled
from stickslip.inference.diagnose.free_errors import contradiction, errors, predicted, summed
from stickslip.inference.diagnose.free_measures import CHANGES, simulated
from stickslip.inference.diagnose.free_report import cautions, free_variables
from stickslip.inference.diagnose.free_simulation import confirm
from stickslip.inference.diagnose.work import Work
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit_base
from stickslip.inference.force.heldout import halves, points
from stickslip.inference.force.knots import NUCLEATION
from stickslip.inference.force.linearised import moved
from stickslip.inference.force.problem import LEVEL
from stickslip.inference.force.signatures import Explained
from stickslip.physics.effects import catalogue
from stickslip.show.report.free_figures import free_picture
from tests.force.conftest import made, seen

from .free_runs import AGED, BASE, prepared

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Nothing hidden: the data, and the base fitted."""
    case = made(tmp_path_factory.mktemp("plain") / "case", 11, spring_known=True)
    return prepared(case), fit_base(case.problem, case.point)


@pytest.fixture(scope="module")
def confirmed(plain):
    data, base = plain
    return confirm({BASE: base}, BASE, data)


@pytest.fixture(scope="module")
def aged(tmp_path_factory):
    """Contact ageing hidden, ten times what can be seen: the data, the base, and the model with it."""
    folder = tmp_path_factory.mktemp("aged") / "case"
    case = made(folder, 11, (seen("contact-ageing", "logarithm", 10.0),), spring_known=True)
    base = fit_base(case.problem, case.point)
    form = next(iter(catalogue.forms(catalogue.get("contact-ageing"))))
    return prepared(case), base, settled(base, try_effect(base, Explained(base), "contact-ageing", [form])[0])


def of_all(c, parts):
    return errors(c, c.models[parts])


def test_without_a_hidden_effect_the_free_model_does_what_was_measured(confirmed):
    found = of_all(confirmed, BASE)
    assert confirmed.notes == ()
    assert (found["missed"], found["events"]) == (0, 8)
    assert found["recurrence"]["relative"] < 0.003
    assert found["slip"]["relative"] < 0.01
    assert found["creep"]["relative"] < 0.02
    assert found["recurrence"]["scatters"] < 2.5
    assert found["slip"]["scatters"] < 2.5
    assert len(found["by_run"]) == 2


def unsure(base) -> np.ndarray:
    """How far the force in every nucleation differs between draws of the parameters (N), shape (E,)."""
    rng, small, drawn = np.random.default_rng(5), 1e-3, []
    values, turn = np.linalg.eigh(base.covariance)
    for _ in range(150):
        change = small * turn @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(values.size))
        drawn.append(base.problem.forces(moved(base.point, change, base.point.events)).residual - base.residual)
    variance = np.mean(np.square(drawn), axis=0) / small**2
    problem = base.problem
    own = [(problem.of == e) & (problem.phase == NUCLEATION) for e in range(problem.events)]
    return np.sqrt([variance[points].mean() for points in own])


def test_the_scatter_of_the_recurrence_is_that_of_the_force_at_the_onset(plain, confirmed):
    """Of strengths that differ, also from run to run, of the misfit, and of parameters that are not known better."""
    _, base = plain
    size, m = base.scatter.named(), confirmed.measurement
    random = np.sqrt(size["strength"] ** 2 + LEVEL**2 + size["nucleation"] ** 2) * base.strength
    force = np.hypot(random, unsure(base).reshape(2, 4)[:, 1:])
    expected = force / base.values["rig.spring_stiffness"] / np.asarray(m.velocities)[:, None]
    np.testing.assert_allclose(confirmed.scatter.recurrence[:, 1:4], expected, rtol=0.25)


@pytest.fixture
def stronger(plain, monkeypatch):
    """Run with a contact so many times as strong as that of the fit."""
    data, base = plain

    def run(times):
        point = replace(base.point, weights=times * base.point.weights, events=np.zeros_like(base.point.events))
        monkeypatch.setattr(confirming, "points", lambda fit, parts: [point] * len(parts))
        return confirm({BASE: base}, BASE, data)

    return run


def test_sliding_friction_that_differs_in_every_event_is_another_drop(plain):
    data, base = plain
    m, names = data.measurement, [f.name for f in base.free]
    at, ratio = names.index("weakening.drop"), 1.0 - base.values["weakening.drop"]
    z = base.point.z.copy()
    z[at] = base.free[at].inward(1.0 - ratio * np.exp(0.02))
    changes = np.zeros((np.shape(m.cycles.start)[1], len(CHANGES) - 1))
    changes[:, CHANGES.index("ratio")] = 0.02
    _, found, _ = simulated(m, base.problem, base.point, 0, 0, changes)
    _, other, _ = simulated(m, base.problem, replace(base.point, z=z), 0, 0)
    _, as_fitted, _ = simulated(m, base.problem, base.point, 0, 0)
    np.testing.assert_allclose(found, other, rtol=1e-9, atol=1e-15)
    assert np.abs(found - as_fitted).max() > 1e-3 * np.abs(as_fitted).max()


def test_wrong_parameters_show(stronger, confirmed):
    right, wrong = of_all(confirmed, BASE), of_all(stronger(1.05), BASE)
    assert wrong["recurrence"]["relative"] > 5.0 * right["recurrence"]["relative"]
    assert wrong["slip"]["relative"] > 2.0 * right["slip"]["relative"]


def test_a_hidden_effect_makes_the_base_err_and_the_right_one_mends_it(aged):
    data, base, last = aged
    c = confirm({BASE: base, AGED: last}, AGED, data)
    before, after = of_all(c, BASE), of_all(c, AGED)
    for name, times in (("recurrence", 4.0), ("slip", 3.0), ("creep", 1.3)):
        assert before[name]["scatters"] > times * after[name]["scatters"], name
    assert after["recurrence"]["scatters"] < 3.0
    assert cautions(c, {BASE: 5.0, AGED: 1.0}) == []
    swapped = SimpleNamespace(**{**c.__dict__, "models": {BASE: c.models[AGED], AGED: c.models[BASE]}})
    (said,) = cautions(swapped, {BASE: 5.0, AGED: 1.0})
    assert "contradict" in said and "with contact-ageing" in said and "from 5 to 1 floors" in said
    data_set = xarray.Dataset(free_variables(c, data, BASE, AGED))
    labels = [line.get_label() for line in free_picture(data_set).axes[0].get_lines()]
    assert labels == ["measured", "base model", "last model"]


def test_a_contradiction_needs_both_sides_and_more_than_two_standard_errors():
    rng = np.random.default_rng(0)
    without = rng.uniform(1.0, 2.0, 30)
    worse = without + rng.normal(0.5, 0.2, 30)
    assert contradiction((3.0, 1.0), (without, worse)) is not None
    assert contradiction((1.0, 3.0), (without, worse)) is None  # the force does not say it is better
    assert contradiction((3.0, 1.0), (worse, without)) is None
    noisy = without + rng.normal(0.0, 2.0, 30)
    total, error = (noisy - without).sum(), np.sqrt(30) * np.std(noisy - without, ddof=1)
    assert (contradiction((3.0, 1.0), (without, noisy)) is None) == (total <= 2.0 * error)
    assert contradiction((3.0, 1.0), (without, np.where(np.arange(30) == 7, np.nan, worse))) is not None


def test_a_slip_that_does_not_come_is_counted_and_said(stronger):
    c = stronger(3.0)
    found = of_all(c, BASE)
    assert found["missed"] > 0
    assert np.isfinite(found["recurrence"]["relative"])
    assert any("does not slip in time" in text for text in cautions(c, {BASE: 1.0}))
    made_by = predicted(c, c.models[BASE])
    assert np.all(made_by.slip[c.models[BASE].missed & np.isfinite(made_by.slip)] == 0.0)
    assert summed(c, c.models[BASE]).size == made_by.slip.size


def test_a_simulation_that_fails_is_a_note(plain, monkeypatch):
    data, base = plain

    def broken(*args):
        raise RuntimeError("no such law")

    monkeypatch.setattr(confirming, "simulate_freely", broken)
    c = confirm({BASE: base}, BASE, data)
    assert c.models == {}
    assert "no such law" in c.notes[0]
    assert cautions(c, {BASE: 1.0}) == list(c.notes)
    assert free_variables(c, data, BASE, BASE) == {}


def test_without_time_nothing_is_run_and_it_is_said(plain):
    data, base = plain
    c = confirm({BASE: base}, BASE, data, Work(in_time=lambda: False))
    assert c.models == {}
    assert "time limit" in c.notes[0]


def test_finished_pieces_are_taken_up_for_the_same_fit_only(plain, confirmed, monkeypatch):
    data, base = plain
    kept = {}
    work = Work(store=SimpleNamespace(load=kept.get, save=kept.__setitem__))
    first = confirm({BASE: base}, BASE, data, work)
    monkeypatch.setattr(confirming, "simulate_freely", lambda *args: pytest.fail("run again"))
    again = confirm({BASE: base}, BASE, data, work)
    assert errors(again, again.models[BASE]) == errors(first, first.models[BASE])
    other = replace(base, point=replace(base.point, weights=1.01 * base.point.weights))
    with pytest.raises(pytest.fail.Exception):
        confirm({BASE: other}, BASE, data, work)


def test_a_record_that_begins_with_a_stretched_spring_is_followed(tmp_path):
    case = made(tmp_path / "case", 11, spring_known=False, virgin=False)
    base = fit_base(case.problem, case.point)
    c = confirm({BASE: base}, BASE, prepared(case))
    found = of_all(c, BASE)
    assert found["missed"] == 0
    assert found["recurrence"]["relative"] < 0.005
    assert np.isnan(c.data.recurrence[:, 0]).all()  # where the first cycle began is not known


def test_parameters_without_a_fold_stay_within_their_bounds(plain):
    _, base = plain
    for point in points(base, halves(base)):
        assert np.all(point.weights >= 0.0)
        assert not point.events.any()
        assert point.weights.sum() == pytest.approx(base.strength, rel=0.05)
        assert not np.array_equal(point.z, base.point.z)
