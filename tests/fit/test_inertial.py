"""The chain from a trace to fitted parameters: the model finds itself again."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from stickslip.effects import catalogue
from stickslip.fit.inertial import fit
from stickslip.fit.problem import Problem
from stickslip.floors import EVENT_WIDTHS, event_widths, floors, scatter_factor, uncertain
from stickslip.residual import misfit

from . import synthetic


@pytest.fixture(scope="module")
def campaign():
    found = synthetic.traces()
    return synthetic.measured(found)


@pytest.fixture(scope="module")
def problem(campaign):
    return Problem(synthetic.composition(), campaign)


def test_cycles_begin_at_the_arrests(campaign):
    used = np.asarray(campaign.cycles.used)
    assert used.sum(axis=1).min() >= 3
    recurrence = campaign.values[:, 1:, 0][used[:, 1:]]
    assert np.all((recurrence > 0.15) & (recurrence < 0.8))
    # the slip size of a damped block on a spring: F_s (1 - r)(1 + exp(-pi zeta))/c_s, weakening not quite complete
    size = campaign.values[..., 1][used]
    assert np.all((size > 30e-6) & (size < 90e-6))


def test_features_of_data_and_model_agree_at_the_truth(campaign, problem):
    events = np.zeros((*campaign.values.shape[:2], 2))
    model = problem.features(synthetic.truth(), events)
    floor = floors(campaign)
    error = misfit(campaign, model, floor)
    for phase, value in error.by_phase.items():
        assert value < 1.0, (phase, value)
    # and they do not where a parameter is wrong by a tenth
    wrong = synthetic.truth()
    wrong[0] += 0.1
    assert misfit(campaign, problem.features(wrong, events), floor).total > 10.0


@pytest.mark.parametrize(
    ("tag", "amplitude"),
    [("sensor-low-pass", 3e-4), ("sensor-low-pass", 8e-4), ("sensor-high-pass", 5e-4), ("sensor-gain", 0.02)],
)
def test_they_agree_behind_a_sensor(tag, amplitude):
    """A cycle begins at the top of the reading, as in the data; a late sensor gets there after the block.

    (Begun where the block stands, the model with a low-pass of 0.8 ms was 21 floors off in ring-down, 7 in slips.)
    """
    effect = catalogue.make(tag, **{catalogue.get(tag).amplitude: amplitude})
    data = synthetic.measured(synthetic.traces(effect=effect))
    family = synthetic.composition().with_effect(effect, ())
    events, floor = np.zeros((*data.values.shape[:2], 2)), floors(data)
    model = Problem(family, data).features(synthetic.truth(), events)
    for phase, value in misfit(data, model, floor).by_phase.items():
        assert value < 1.0, (phase, value)
    bare = Problem(synthetic.composition(), data).features(synthetic.truth(), events)
    assert misfit(data, bare, floor).total > 1.5


def test_differences_of_the_jacobian_follow_the_features(campaign, problem):
    z, events = synthetic.truth(), np.zeros((*campaign.values.shape[:2], 2))
    base = problem.features(z, events)
    columns = problem.columns(z, events, [0, 1], base)
    moved = z.copy()
    moved[0] += 0.01
    moved[1] += 0.01
    change = problem.features(moved, events) - base
    predicted = 0.01 * columns[..., 0] + 0.01 * columns[..., 1]
    for feature in (0, 1):  # recurrence, slip size
        got, want = change[..., feature], predicted[..., feature]
        scale = np.abs(want).max()
        assert np.abs(got - want)[campaign.valid[..., feature]].max() < 0.05 * scale


def test_event_wise_factor_acts_on_its_own_cycle(campaign, problem):
    z, events = synthetic.truth(), np.zeros((*campaign.values.shape[:2], 2))
    base = problem.features(z, events)
    events[0, 2, 0] = 0.05
    moved = problem.features(z, events) - base
    creep = campaign.layout.slices()["creep"]
    own = np.abs(moved[0, 2, creep]).max()
    assert own > 1e-9
    assert np.abs(moved[0, :2]).max() == 0.0  # nothing before it changes
    assert np.abs(moved[1]).max() == 0.0  # nor another run


def test_lines_said_to_be_new_widen_floors_and_what_events_may_vary(campaign):
    assert scatter_factor(campaign) == 0.5  # three slips tell nothing of it
    same, new = replace(campaign, new_lines=0.0), replace(campaign, new_lines=1.0)
    size = campaign.layout.slices()["size"]
    assert np.all(floors(new)[:, 1:, size] > 1.5 * floors(same)[:, 1:, size])
    assert event_widths(new)[1, 2] == pytest.approx(EVENT_WIDTHS)
    assert np.all(event_widths(same)[1, 2] < 0.2 * event_widths(new)[1, 2])
    assert np.mean(uncertain(new)) < np.mean(uncertain(same))  # every event has lines of its own to tell of
    assert new.take([1]).new_lines == 1.0


def test_progress_names_iteration_and_error(campaign, problem):
    told = []
    fit(problem, floors(campaign), z=synthetic.truth(), stages=((30.0, 1),), progress=told.append)
    first = re.fullmatch(r"iteration (\d+), error (\S+)", told[0])
    assert first is not None, told[0]
    assert float(first[2]) < 2.0  # it starts at the truth


@pytest.mark.slow
def test_fit_recovers_the_truth(campaign):
    start = {name: value * f for (name, (_, value)), f in zip(synthetic.TRUTH.items(), START, strict=True)}
    problem = Problem(synthetic.composition(start), campaign)
    found = fit(problem, floors(campaign))
    for name, (_, value) in synthetic.TRUTH.items():
        tolerance = {"contact.spread": 0.6, "contact.p": 0.1, "contact.u_max": 0.15}.get(name, 0.05)
        assert found.values[name] == pytest.approx(value, rel=tolerance), name


START = (1.03, 0.85, 0.8, 1.3, 0.8, 1.1, 1.0, 1.2)
