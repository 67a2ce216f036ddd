"""Records that do not begin virgin: where the spring stands at their first slip, and what the sensor shows there."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.diagnose.begin import begun
from stickslip.diagnose.heldout import held_out
from stickslip.effects import catalogue
from stickslip.fit.inertial import fit
from stickslip.fit.problem import COARSE, Problem
from stickslip.floors import floors
from stickslip.forward import _in_stick
from stickslip.residual import misfit

from . import synthetic

CUT = 2.85e-4  # m of the drive's way, in the second stick


def records(effect=None, zero=0.0):
    made = synthetic.traces(slips=5.6, effect=effect)
    return synthetic.measured([synthetic.begun_later(t, CUT, zero) for t in made])


def begun_with(effect, data):
    """The model with an effect and the true parameters of the base, its runs begun as the data's are."""
    family = synthetic.with_starts(synthetic.composition(), data.runs)
    events = np.zeros((*data.values.shape[:2], 2))
    use = np.asarray(data.cycles.used)
    z = np.concatenate([synthetic.truth(), np.zeros(data.runs)])
    base = Problem(family, data, tolerance=COARSE)
    columns = base.columns(z, events, range(z.size - data.runs, z.size), base.features(z, events))
    columns = np.concatenate([np.zeros((*data.values.shape, z.size - data.runs)), columns], axis=-1)
    problem = base if effect is None else Problem(family.with_effect(effect, ()), data, tolerance=COARSE)
    return begun(problem, z, events, columns, family.free, data.values, use)


@pytest.fixture(scope="module")
def tilted():
    effect = catalogue.make("tilt", coupling=-0.1)
    data = records(effect)
    return data, *begun_with(effect, data)


def test_runs_begin_where_their_slips_come_when_they_do(tilted):
    """A tilt of -0.1 has the block slip at 10/11 of its strength."""
    data, z, features = tilted
    at = data.layout.slices()["recurrence"].start
    seen = np.asarray(data.cycles.used) & data.valid[..., at]
    late = (features - data.values)[..., at][seen] / data.values[..., at][seen]
    assert seen.sum() > 5
    assert np.max(np.abs(late)) < 2e-3
    shift = z[-data.runs :] * 0.01 * 0.26 / 1000.0
    assert shift == pytest.approx(np.full(data.runs, (1 / 1.1 - 1) * 0.26 / 1000.0), abs=1e-6)


def test_the_model_describes_what_was_recorded_from_within_a_run(tilted):
    data, _, features = tilted
    error = misfit(data, features, floors(data))
    assert error.by_phase["creep"] < 1.0
    assert error.by_phase["slip"] < 1.0
    assert error.by_phase["recurrence"] < 1.0


def test_nothing_is_moved_where_all_begin_virgin():
    data = synthetic.measured(synthetic.traces())
    problem = Problem(synthetic.composition(), data, tolerance=COARSE)
    events = np.zeros((*data.values.shape[:2], 2))
    z = synthetic.truth()
    columns = np.zeros((*data.values.shape, z.size))
    found, features = begun(problem, z, events, columns, synthetic.composition().free, data.values, data.valid[..., 0])
    assert found is z
    assert np.array_equal(features, problem.features(z, events))


def test_a_cycle_begins_where_the_sensor_shows_what_was_measured_also_the_first():
    """Of a record that begins elsewhere than its sensor's zero: else the first slip comes at another time."""
    data = records(catalogue.make("sensor-gain", gain=0.04), zero=1e-4)
    _, features = begun_with(catalogue.make("sensor-gain", gain=0.04), data)
    at = data.layout.slices()["recurrence"].start
    late = (features - data.values)[..., at] / data.values[..., at]
    seen = np.asarray(data.cycles.used) & data.valid[..., at]
    assert np.asarray(data.cycles.position)[:, 0] == pytest.approx([1e-4, 1e-4], abs=1e-7)
    assert np.max(np.abs(late[seen])) < 2e-3
    assert not seen[:, 0].any()  # it is no feature of a record that does not begin virgin, but it is there
    assert np.max(np.abs(late[:, 0])) < 0.03


@pytest.mark.parametrize(
    ("tag", "values"),
    [
        ("plasticity", {"sharpness": 3.0}),
        ("roll-off", {"share": 0.5}),
        ("machine-compliance", {"compliance": 2e-7, "where": "series"}),
    ],
)
@pytest.mark.parametrize("share", [-0.3, 0.5, 0.95])
def test_a_contact_rests_under_any_pull_also_one_that_an_effect_has_shaped(tag, values, share):
    family = synthetic.composition().with_effect(catalogue.make(tag, **values), ())
    nodes = (jnp.array([0.0, 1.0]), jnp.array([0.0, 1e-4]))
    model = family.model(synthetic.truth(), jnp.zeros(2), nodes, jnp.asarray(np.nan))
    pull = share * float(np.sum(model.shaped().strength))
    force = _in_stick(model, pull)
    assert float(np.sum(force)) == pytest.approx(pull, rel=1e-6)
    assert np.all(np.abs(force) <= np.asarray(model.shaped().strength) * (1 + 1e-12))


def test_a_run_that_no_fit_has_seen_begins_like_those_it_has(tilted):
    """Tilt moves every start by 24 um: from none, an unseen run slips at another time and is taken for a failure."""
    data, z, _ = tilted
    family = synthetic.with_starts(synthetic.composition(), data.runs).with_effect(
        catalogue.make("tilt", coupling=-0.1), ()
    )
    problem = Problem(family, data, tolerance=COARSE)
    floor = floors(data)
    seen = np.asarray(data.cycles.used).copy()
    seen[1] = False
    apart = z.copy()
    apart[-1] = 0.0
    found = fit(problem, floor, z=apart, stages=((1.0, 2),), use=seen)
    assert found.z[-1] == pytest.approx(z[-1], abs=0.1)
    assert held_out(problem, found, floor, ~seen).by_phase["recurrence"] < 1.0
