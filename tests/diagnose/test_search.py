"""What a search begins with (the linear step of everything, periods that residuals hint at, plausible amplitudes), and
how long a leader is followed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.diagnose import refit, search
from stickslip.diagnose.candidate import Candidate
from stickslip.diagnose.linear import Linear
from stickslip.diagnose.periods import periods, phasor, within_record
from stickslip.diagnose.recurrences import told
from stickslip.diagnose.search import Search, starts
from stickslip.effects import catalogue
from stickslip.features.layout import Layout
from stickslip.features.measurement import Measurement
from stickslip.fit.inertial import Fit
from stickslip.fit.parameters import Free, effect_parameters
from stickslip.floors import EVENT_WIDTHS
from stickslip.forward import Cycles


def measurement(velocities=(5e-5, 1e-4, 2e-4, 4e-4, 1e-4), cycles=6, hold_runs=(4,)) -> Measurement:
    """Nothing but shapes, velocities and holds (in the fourth and sixth cycle of the hold runs)."""
    layout = Layout(0.06, 0.004)
    runs = len(velocities)
    used = np.ones((runs, cycles), bool)
    valid = np.ones((runs, cycles, layout.size), bool)
    valid[..., layout.slices()["hold"]] = False
    for r in hold_runs:
        valid[r, [3, 5], layout.slices()["hold"]] = True
    c = Cycles(*([jnp.zeros((runs, cycles))] * 4), jnp.asarray(used), jnp.asarray(used), *([jnp.zeros((runs, 2))] * 2),
               jnp.full(runs, jnp.nan), jnp.ones(runs, bool))  # fmt: skip
    zero = np.zeros((runs, cycles, layout.size))
    names = tuple(f"run{r}" for r in range(runs))
    anchors = SimpleNamespace(
        ring_period=np.full((runs, cycles), 2e-3),
        creep=np.broadcast_to(np.geomspace(1.0, 4e-3, 16), (runs, cycles, 16)),
    )
    return Measurement(layout, c, anchors, zero, valid, zero + 1, names, np.array(velocities))


def made(seed: int = 0):
    """A linear world of two parameters and one direction, with unit floors."""
    data = measurement((5e-5, 1e-4), 3, ())
    data = replace(data, valid=np.ones_like(data.valid))
    rng = np.random.default_rng(seed)
    shape = data.values.shape
    columns, line = rng.standard_normal((*shape, 2)), rng.standard_normal(shape)
    free = tuple(Free(n, "1", "log", 1.0, 1.0, 1e3, 1e-9, 1e9) for n in ("a", "b"))
    fit = Fit(np.zeros(2), np.zeros((*shape[:2], 2)), 0, 0, np.zeros(shape), np.zeros(shape), np.eye(2), free, columns,
              np.ones(shape[:2], bool), 1, 1)  # fmt: skip
    problem = SimpleNamespace(event_columns=lambda columns, z, events: np.zeros((*shape, 2)))
    return data, columns, line, fit, problem


def test_the_linear_step_finds_what_was_moved_and_by_how_much():
    data, columns, line, fit, problem = made()
    data = replace(data, values=columns @ np.array([0.03, -0.05]) + 0.02 * line)
    linear = Linear(problem, fit, data, np.ones_like(data.values), data.valid)
    step = linear.step([line])
    assert step.sizes == pytest.approx([0.02], rel=1e-6)
    assert step.z == pytest.approx([0.03, -0.05], rel=1e-6)
    assert step.share == pytest.approx(1.0, abs=1e-6)
    assert step.events == pytest.approx(np.zeros_like(step.events), abs=1e-12)
    assert step.events.shape == (*data.values.shape[:2], len(EVENT_WIDTHS))


def test_a_direction_that_the_base_covers_explains_nothing():
    data, columns, line, fit, problem = made(1)
    data = replace(data, values=columns @ np.array([0.03, -0.05]) + 0.02 * line)
    linear = Linear(problem, fit, data, np.ones_like(data.values), data.valid)
    assert linear.step([columns @ np.array([1.0, 2.0])]).share == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("variable", "scale"), [("time", 1.0), ("load point", 1e-4), ("displacement", 1e-4)])
def test_a_period_in_the_residual_is_found(variable, scale):
    data = measurement((1e-4,), 30, ())
    n = data.values.shape[1]
    rng = np.random.default_rng(3)
    recurrence = rng.uniform(0.8, 1.2, n)
    slips = np.cumsum(recurrence)
    start = slips - recurrence
    nodes = np.array([[0.0, 1.0]]), np.array([[0.0, 1e-4]])
    position = 1e-4 * start
    cycles = data.cycles._replace(
        start=start[None], position=position[None], load_times=nodes[0], load_positions=nodes[1]
    )
    values = data.values.copy()
    values[0, :, 0] = recurrence
    data = replace(data, cycles=cycles, values=values)
    at = {"time": slips, "load point": 1e-4 * slips, "displacement": position}[variable]
    true = 5.3 * scale
    off = np.zeros_like(values)
    off[0, :, 0] = 3.0 * np.sin(2 * np.pi * at / true + 0.7) + 0.3 * rng.standard_normal(n)
    off[0, :, 1] = 2.0 * np.cos(2 * np.pi * at / true) + 0.3 * rng.standard_normal(n)
    off[0, 7] = 40.0  # one slip that went astray
    model = values - 1e-3 * off
    found = periods(variable, data, model, np.ones((1, n), bool), (1.5 * scale, 100 * scale))
    assert found[0] == pytest.approx(true, rel=0.05)
    assert len(found) <= 5


@pytest.mark.parametrize("seed", range(6))
def test_sizes_that_tell_nothing_do_not_hide_a_period_of_the_onsets(seed):
    """Few slips at even distances, so that many waves go through scattered sizes; a ripple moves the onsets alone."""
    velocities, n, true = (5e-5, 1e-4, 4e-4), 7, 4.34e-4
    rng = np.random.default_rng(seed)
    data = measurement(velocities, n, ())
    start = np.zeros(data.values.shape[:2])
    values, off = data.values.copy(), np.zeros_like(data.values)
    for r, v in enumerate(velocities):
        distance = (6.9e-5 + 1e-6 * r) * (1.0 + 0.002 * rng.standard_normal(n))
        start[r], values[r, :, 0] = (np.cumsum(distance) - distance) / v, distance / v
        off[r, :, 0] = 1.4e-6 / v * np.sin(2 * np.pi * np.cumsum(distance) / true + 2.0 * r)
        off[r, :, 0] += 1.4e-8 / v * rng.standard_normal(n)
        off[r, :, 1] = 1e-7 * rng.standard_normal(n)
    nodes = np.tile([0.0, 1.0], (3, 1)), np.array([[0.0, v] for v in velocities])
    cycles = data.cycles._replace(start=start, load_times=nodes[0], load_positions=nodes[1])
    data = replace(data, cycles=cycles, values=values)
    found = periods("load point", data, values - off, np.ones((3, n), bool), (1e-6, 1e-2))
    assert found[0] == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize(
    ("tag", "name"),
    [
        ("position-dependent-friction", "wavelength"),
        ("drive-ripple", "pitch"),
        ("load-modulation", "frequency"),
        ("base-vibration", "frequency"),
    ],
)
def test_no_wave_is_longer_than_one_and_a_half_records(tag, name):
    effect = catalogue.make(tag)
    assert effect.periodic is not None
    data = measurement((1e-4,), 7, ())
    n = data.values.shape[1]
    values = data.values.copy()
    values[0, :, 0], values[0, :, 1] = 0.4, 4e-5  # a recurrence, a slip
    start = 0.4 * np.arange(n)[None]
    nodes = np.array([[0.0, 1.0]]), np.array([[0.0, 1e-4]])
    cycles = data.cycles._replace(
        start=start, position=4e-5 * np.arange(n)[None], load_times=nodes[0], load_positions=nodes[1]
    )
    data = replace(data, cycles=cycles, values=values)
    cycles_used = int(np.asarray(cycles.used).sum())
    record = {"time": 0.4 * cycles_used, "load point": 4e-5 * cycles_used, "displacement": 4e-5 * cycles_used}
    longest = 1.5 * record[effect.periodic[1]]
    own, limited = effect_parameters(effect), within_record(effect, effect_parameters(effect), data)
    for before, after in zip(own, limited, strict=True):
        if not after.name.endswith(name):
            assert after == before
        elif name == "frequency":
            assert after.lower == pytest.approx(max(1.0 / longest, before.lower), rel=1e-6)
            assert after.upper == before.upper
        else:
            assert after.upper == pytest.approx(min(longest, before.upper), rel=1e-6)
            assert after.lower == before.lower
        assert after.lower <= after.start <= after.upper
    limits = next((f.lower, f.upper) for f in limited if f.name.endswith(name))
    for values_ in starts(effect, [], limits):
        assert limits[0] <= values_[name] <= limits[1]


def test_too_few_slips_hint_at_nothing():
    data = measurement((1e-4,), 3, ())
    assert periods("time", data, np.zeros_like(data.values), np.ones((1, 3), bool), (0.1, 10.0)) == []


PHASES = (0.66, -1.9)  # no two records begin at the same moment of an oscillation


def locked(velocities=(7e-5, 2e-4), n=12, frequency=10.25, size=3e-6, phases=PHASES):
    """Onsets where the load point has caught up with a threshold that swings: up to half a period late, and locked."""
    data = measurement(velocities, n, ())
    values, valid = data.values.copy(), np.ones_like(data.valid)
    start = np.zeros(values.shape[:2])
    expected = values.copy()
    rng = np.random.default_rng(8)
    for r, v in enumerate(velocities):
        now = 0.0
        for i in range(n):
            start[r, i] = now
            due = now + 5e-5 / v * rng.uniform(0.99, 1.01)
            t = np.linspace(due - 1.2 * size / v, due + 1.2 * size / v, 20001)
            over = v * (t - due) - size * np.sin(2 * np.pi * frequency * t + phases[r])
            at = t[np.argmax(over >= 0)]
            expected[r, i, 0], values[r, i, 0] = due - now, at - now
            now = at + 0.005
    data = replace(data, values=values, valid=valid, cycles=data.cycles._replace(start=start))
    return data, expected, np.ones(start.shape, bool)


def test_onsets_locked_to_a_period_tell_it_with_amplitude_and_phase():
    frequency, size = 10.25, 3e-6
    data, model, use = locked()
    late = (data.values - model)[..., 0] * np.array(data.velocities)[:, None]
    assert np.ptp(late / np.array(data.velocities)[:, None]) * frequency > 0.5  # far beyond what a linear step sees
    found = periods("time", data, model, use, (1 / 50.0, 10.0))
    assert 1.0 / found[0] == pytest.approx(frequency, abs=0.3 / np.ptp(data.cycles.start))
    same, expected, _ = locked(phases=(0.66, 0.66))
    coherent = periods("time", same, expected, use, (1 / 50.0, 10.0), together=True)
    assert 1.0 / coherent[0] == pytest.approx(frequency, abs=0.3 / np.ptp(data.cycles.start))
    told = phasor("time", data, data.values, data.values - model, 1.0 / frequency, use)
    assert np.abs(told) == pytest.approx(size, rel=0.02)
    assert np.angle(told) == pytest.approx(PHASES, abs=0.02)
    # at the onsets that the base expects it is quite another one
    wrong = phasor("time", data, model, data.values - model, 1.0 / frequency, use)
    assert np.abs(wrong[0] * np.exp(-1j * PHASES[0]) - size) > 0.3 * size


class Invented:
    """A problem whose features are a line times the amplitude: what a search asks of one."""

    def __init__(self, data, line) -> None:
        self.measurement, self.line = data, line

    def features(self, z, events):
        return self.measurement.values + z[-1] * self.line

    def columns(self, z, events, which, base):
        return np.repeat(self.line[..., None], len(list(which)), axis=-1)


@pytest.mark.parametrize(("tag", "signs"), [("tilt", {-1.0, 1.0}), ("machine-compliance", {1.0})])
def test_an_amplitude_that_may_have_two_signs_is_tried_with_both(tag, signs, monkeypatch):
    data, _, line, fit, _ = made(2)
    monkeypatch.setattr(search, "fit", lambda problem, floor, *, z, events, **_: replace(fit, z=z, events=events))
    effect = catalogue.make(tag)
    free = effect_parameters(effect)
    floor = 1e-4 * np.ones_like(data.values)
    problem = Invented(data, line * (1e-4 if tag == "tilt" else 1e2))
    begun = Search(problem, fit, floor, data.valid, 1.0, free, 2, effect)
    begun.best = (np.inf, fit.z, fit.events, data.values)
    for sign in (1.0, -1.0):
        begun.push({}, sign, search.PLAUSIBLE, np.ones(data.values.shape[:2], bool))
    pushed = [z[-1] for _, z, *_ in begun.plausible]
    assert sorted(float(np.sign(a)) for a in pushed) == sorted(signs)
    assert begun.best in begun.plausible
    # a leader is begun from the plausible amplitudes that are not the best before any that is near none
    begun.each = [(0.0, fit.z, fit.events, data.values)] * 3
    assert begun.others()[: len(pushed) - 1] == [o for o in begun.plausible if o is not begun.best]
    assert len(begun.others()) == search.OTHERS


def test_recurrences_tell_the_amplitude_whatever_runs_and_single_slips_are_off_by():
    rng = np.random.default_rng(5)
    rate = 1e-3 * np.cumsum(rng.uniform(0.5, 1.5, (3, 9)), axis=1)  # s
    floor = np.full((3, 9), 1e-3)
    floor[:, 0] *= 26.0  # a virgin cycle is hardly known
    off = 7.0 * rate + rng.standard_normal((3, 1)) * 0.2 + 0.5 * floor * rng.standard_normal((3, 9))
    off[1, 4] = 3.0  # a slip that went astray
    valid = np.ones((3, 9), bool)
    valid[2, 3:] = False
    off[2, 3:] = np.nan
    size, _ = told(off, rate, floor, valid)
    assert size == pytest.approx(7.0, rel=0.03)
    valid[1, 4] = False
    assert told(off, rate, floor, valid)[1] > 0.85
    # noise, and what is the same in all cycles of a run, tell nothing
    every = np.ones((3, 9), bool)
    assert told(floor * rng.standard_normal((3, 9)), rate, floor, every)[1] < 0.3
    assert told(off, np.ones((3, 9)), floor, valid) == (0.0, 0.0)
    assert told(np.full((3, 9), 50.0) + floor, rate, floor, every)[1] < 0.3
    valid[0] = False
    valid[1, 2:] = False
    assert told(off, rate, floor, valid) == (0.0, 0.0)


@pytest.mark.parametrize(("other", "size", "tag"), [
    (0.0, 30.0, "sensor-gain"),
    (400.0, 30.0, "sensor-gain"),
    (0.0, 80.0, "sensor-gain"),  # beyond its range
    (0.0, -30.0, "machine-compliance"),  # which has one sign
])  # fmt: skip
def test_what_the_recurrences_tell_is_begun_at(other, size, tag, monkeypatch):
    """Only where it is most of what makes them differ, and possible; with what the data say of when runs begin."""
    data, _, line, fit, _ = made(6)
    aims = []

    def set_begins(problem, z, events, columns, known, aim, use):
        aims.append(aim)
        return z, problem.features(z, None)

    monkeypatch.setattr(search, "fit", lambda problem, floor, *, z, events, **_: replace(fit, z=z, events=events))
    monkeypatch.setattr(search, "begun", set_begins)
    effect = catalogue.make(tag)
    at = data.layout.slices()["recurrence"].start
    floor = 1e-4 * np.ones_like(data.values)
    problem = Invented(data, 1e-4 * line)
    start = Search(problem, fit, floor, data.valid, 1.0, effect_parameters(effect), 2, effect)
    start.best = (np.inf, fit.z, fit.events, data.values)
    # inner values that tell nothing come first and last
    start.rates = [({"a": 1.0}, 0.0 * line), ({}, 1e-4 * line), ({"b": 1.0}, 0.0 * line)]
    values = data.values + size * 1e-4 * line
    values[..., at] += 1e-4 * other * np.random.default_rng(7).standard_normal(values.shape[:2])
    problem.measurement = replace(data, values=values)
    start.bare = data.values
    start.by_recurrences(np.ones(data.values.shape[:2], bool))
    possible = other == 0.0 and size == 30.0
    assert [z[-1] for _, z, *_ in start.plausible] == ([pytest.approx(30.0)] if possible else [])
    assert all(aim is values for aim in aims)
    assert len(aims) == possible


def test_a_leader_in_a_bent_valley_is_followed_by_way_of_wide_floors_until_it_stands(monkeypatch):
    """Straight on, the fit stands still; from floors that are widened it takes a third of the way to 100 each time."""
    data, columns, _, fit, _ = made(3)
    fit = replace(fit, cost=1000.0, columns=columns)
    taken = []

    def step(problem, floor, *, z, events, stages, **_):
        taken.append(stages)
        now = now_cost[0]
        now_cost[0] = 100.0 + (now - 100.0) * 2 / 3 if len(stages) > 1 else now
        return replace(fit, cost=now_cost[0])

    now_cost = [1000.0]
    monkeypatch.setattr(refit, "fit", step)
    monkeypatch.setattr(refit, "Problem", lambda *a, **k: None)
    monkeypatch.setattr(refit, "certain", lambda problem, floor, found: found)
    monkeypatch.setattr(refit, "ease", lambda *a: 1.0)
    monkeypatch.setattr(refit, "with_fit", lambda c, found, *a: replace(c, fit=found))
    begun = Candidate("tilt", {}, catalogue.make("tilt"), 0.1, 0.1, composition="invented", fit=fit)
    hopeless = refit.settle(begun, data, np.ones_like(data.values), data.valid, 900.0)
    assert hopeless.cost == 1000.0
    assert taken == [((1.0, refit.MOST),)]
    taken.clear()
    found = refit.settle(begun, data, np.ones_like(data.values), data.valid)
    assert found.cost == pytest.approx(100.0 + 900.0 * (2 / 3) ** refit.AGAIN)
    assert taken[1:] == [refit.WIDELY] * refit.AGAIN


@pytest.mark.parametrize(("best", "expected"), [(0.055, 0.06), (0.012, 0.01), (0.3, 0.3)])
def test_a_leader_is_tried_at_larger_amplitudes_as_long_as_they_lead_on(best, expected, monkeypatch):
    """Where each fit stands still at the amplitude it began with, and the least cost is at another one."""
    data, _, _, fit, _ = made(3)
    (free,) = effect_parameters(catalogue.make("tilt"))
    begun = []

    def step(problem, floor, *, z, events, stages, **_):
        anew = stages == refit.FAR
        assert np.any(events) != anew, "what is begun elsewhere begins with events of its own"
        begun.append(free.outward(z[-1]))
        return replace(fit, z=z, cost=1000.0 + 1e4 * abs(np.log(free.outward(z[-1]) / best)))

    monkeypatch.setattr(refit, "fit", step)
    monkeypatch.setattr(refit, "Problem", lambda *a, **k: SimpleNamespace(measurement=data, seeing=lambda use: None))
    monkeypatch.setattr(refit, "with_starts", lambda problem, z, *a: z)
    monkeypatch.setattr(refit, "certain", lambda problem, floor, found: found)
    monkeypatch.setattr(refit, "ease", lambda *a: 1.0)
    monkeypatch.setattr(refit, "with_fit", lambda c, found, *a: replace(c, fit=found))
    at = np.append(fit.z, free.inward(0.01))
    columns = np.zeros((*data.values.shape, at.size))
    fit = replace(fit, z=at, events=np.ones_like(fit.events), cost=1e6, free=(*fit.free, free), columns=columns)
    small = Candidate("tilt", {}, catalogue.make("tilt"), 0.1, 0.1, composition="invented", fit=fit)
    found = refit.settle(small, data, np.ones_like(data.values), data.valid[..., 0])
    assert found.fit.values["tilt.coupling"] == pytest.approx(expected)
    assert max(begun) <= free.upper
    assert found.settled


def strangers(monkeypatch, costs):
    """A candidate of tilt, and fits that stay where they begin, at costs by the sign of the amplitude."""
    data, columns, line, optimum, _ = made(2)
    effect = catalogue.make("tilt")
    (free,) = effect_parameters(effect)
    optimum = replace(optimum, events=np.ones_like(optimum.events), columns=columns)
    at = replace(optimum, z=np.append(optimum.z, free.inward(1e-5)), free=(*optimum.free, free), cost=1000.0)
    problem = Invented(data, line * 1e-3)
    problem.coarser = lambda: problem
    problem.seeing = lambda use: problem
    taken = []

    def step(problem, floor, *, z, events, stages, **_):
        taken.append((float(z[-1]), stages))
        assert not np.any(events)
        return replace(at, z=z, events=events, cost=costs[np.sign(z[-1])])

    for module in (refit, search):
        monkeypatch.setattr(module, "Problem", lambda *a, **k: problem)
    monkeypatch.setattr(refit, "fit", step)
    monkeypatch.setattr(refit, "with_fit", lambda c, found, *a: replace(c, fit=found))
    small = Candidate("tilt", {}, effect, 0.1, 0.1, composition="invented", fit=at)
    return small, (optimum, data, 1e-4 * np.ones_like(data.values), data.valid[..., 0]), taken


@pytest.mark.parametrize(("costs", "expected"), [({1: 900.0, -1: 400.0}, 400.0), ({1: 1200.0, -1: 1100.0}, 1000.0)])
def test_from_afar_either_sign_is_begun_at_a_plausible_amplitude_and_the_best_is_kept(costs, expected, monkeypatch):
    small, ground, taken = strangers(monkeypatch, costs)
    found = refit.afar(small, *ground)
    assert found.cost == expected
    assert found.fit is small.fit or found.fit.z[-1] == taken[2][0] < 0.0
    *tried, onward = taken
    assert [stages for _, stages in tried] == [refit.FAR[:2]] * 4
    assert onward == (tried[2][0], refit.FAR[2:])
    assert np.array([at for at, _ in tried]) / tried[0][0] == pytest.approx([1.0, 2.5, -1.0, -2.5])
    _, data, floor, _ = ground
    moved = abs(taken[0][0]) * np.sqrt(np.mean(np.square(1e-3 * made(2)[2] / floor)[data.valid]))
    assert 0.6 * search.PLAUSIBLE < moved < 1.6 * search.PLAUSIBLE


@pytest.mark.parametrize(("near", "expected"), [(1300.0, 1100.0), (1050.0, 1050.0)])
def test_what_was_not_refitted_yet_is_from_near_as_well_as_from_afar(near, expected, monkeypatch):
    small, ground, _ = strangers(monkeypatch, {1: 1200.0, -1: 1100.0})

    def from_near(candidate, data, floor, train, most, **_):
        assert most == refit.FEW + refit.MORE
        return replace(candidate, note="", fit=replace(candidate.fit, cost=near))

    monkeypatch.setattr(refit, "refine", from_near)
    found = refit.afar(replace(small, note="not refitted"), *ground)
    assert found.cost == expected
    assert not found.note


def test_a_periodic_effect_is_not_begun_afar(monkeypatch):
    small, ground, taken = strangers(monkeypatch, {1: 1.0, -1: 1.0})
    wave = replace(small, tag="drive-ripple", effect=catalogue.make("drive-ripple"))
    assert refit.afar(wave, *ground) is wave
    monkeypatch.setattr(refit, "refine", lambda c, *a, **k: replace(c, note=""))
    near = refit.afar(replace(wave, note="not refitted"), *ground)  # what was not refitted yet is so from near alone
    assert not near.note
    assert near.fit is wave.fit
    assert not taken


def test_derivatives_of_a_periodic_effect_are_carried_on_where_the_last_run_is_held_out(monkeypatch):
    """Its last parameter is the phase of that run, in which nothing is known of any slope."""
    data, columns, _, fit, _ = made(4)
    base = tuple(fit.free)
    own = tuple(Free(n, "1", 1.0, 0.0, 0.0, 1.0, -9.0, 9.0) for n in ("wave.size", "wave.phase.0", "wave.phase.1"))
    known = np.concatenate([columns, columns[..., :1], columns[..., :1], np.zeros_like(columns[..., :1])], axis=-1)
    begun = replace(fit, free=base + own, z=np.zeros(5), cost=1000.0, columns=known)
    given = []

    def step(problem, floor, *, z, events, columns=None, **_):
        given.append(columns)
        return replace(begun, cost=900.0)

    monkeypatch.setattr(refit, "fit", step)
    monkeypatch.setattr(refit, "Problem", lambda *a, **k: None)
    monkeypatch.setattr(refit, "ease", lambda *a: 1.0)
    monkeypatch.setattr(refit, "with_fit", lambda c, found, *a: replace(c, fit=found))
    floor, train = np.ones_like(data.values), data.valid.any(axis=-1)
    candidate = Candidate("wave", {}, catalogue.make("tilt"), 0.1, 0.1, composition="invented", fit=begun)
    refit.refine(candidate, data, floor, train, 9)
    nothing_known = replace(begun, columns=np.where(np.arange(5) < 2, known, 0.0))
    refit.refine(replace(candidate, fit=nothing_known), data, floor, train, 9)
    assert given[0] is known
    assert given[1] is None
