"""The solver as a part of diffrax and as a function: interpolation, repeatability, symmetry, restarts, refusals."""

from __future__ import annotations

import importlib
import inspect
import math
import re
from dataclasses import replace

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError, SolveError
from stickslip.physics.contact import Bank
from stickslip.physics.effects.base import BodyForce
from stickslip.physics.effects.catalogue import make
from stickslip.physics.effects.inertia import AddedMass
from stickslip.physics.model import LoadPoint
from stickslip.simulation.solve import Tolerance, integrate
from stickslip.simulation.solve.by_diffrax import observe, step_control
from stickslip.simulation.solve.limits import PIECE
from stickslip.simulation.solve.stepper import ContactStepper
from stickslip.simulation.solve.trajectory import Steps
from stickslip.system.trace_cache import Program

from .rig import bank, rig


@pytest.fixture(scope="module")
def first_event():
    return integrate(rig(), 5.6)[0]


def test_repeats_bit_for_bit(first_event):
    again, _ = integrate(rig(), 5.6)
    assert all(np.array_equal(a, b) for a, b in zip(first_event.steps, again.steps, strict=True))
    assert np.max(first_event.steps.v) > 1e-3


def test_pulling_the_other_way_mirrors_everything_bit_for_bit(first_event):
    mirrored, _ = integrate(rig(-5e-5), 5.6)
    s, m = first_event.steps, mirrored.steps
    assert np.array_equal(m.t, s.t)
    assert np.array_equal(m.x, -s.x)
    assert np.array_equal(m.contact_force, -s.contact_force)
    assert np.array_equal(m.friction_work, s.friction_work)


def test_goes_on_from_a_state(first_event):
    _, state = integrate(rig(), 4.0)
    rest, _ = integrate(rig(), 5.6, t0=4.0, state=state)
    s = rest.steps
    assert s.t[0] == 4.0
    # another first step is another discretisation, no more
    assert s.t[np.argmax(s.v > 5e-4)] == pytest.approx(
        first_event.steps.t[np.argmax(first_event.steps.v > 5e-4)], abs=5e-4
    )
    assert s.x[-1] == pytest.approx(first_event.steps.x[-1], rel=1e-2)


def test_a_run_ends_where_its_condition_turns_true(first_event):
    """Where the run without it has it true, to a microsecond, and in a state from which it goes on as that does."""
    conditions = [
        (lambda steps: steps.x > 3e-6, first_event.steps.x, 3e-6),
        (lambda steps: steps.x > 2e-7, first_event.steps.x, 2e-7),  # in creep, where steps are longest
        (lambda steps: (steps.v > 5e-4) & (steps.t > 1.0), first_event.steps.v, 5e-4),
        (lambda steps: steps.spring_force - steps.contact_force > 1e-3, None, None),
    ]
    for until, values, level in conditions:
        ended, state = integrate(rig(), 1e3, until=until)
        assert ended.stats.ended == "until" and ended.to_xarray().attrs["ended"] == "until"
        true = until(ended.at(ended.steps.t[-1] + np.array([-1e-6, 0.0])))
        near = until(first_event.at(ended.steps.t[-1] + np.array([-1e-6, 1e-6])))
        assert not true[0] and near.tolist() == [False, True]
        if values is not None:
            i = int(np.argmax(values > level))
            assert first_event.steps.t[i - 1] < ended.steps.t[-1] < first_event.steps.t[i]
        assert float(state.x) == ended.steps.x[-1]
        n = ended.steps.t.size - 1
        assert np.array_equal(ended.steps.x[:n], first_event.steps.x[:n])  # the way there is the same
        rest, _ = integrate(rig(), 5.6, t0=float(ended.steps.t[-1]), state=state)
        assert rest.steps.x[-1] == pytest.approx(first_event.steps.x[-1], rel=1e-3)
    assert first_event.stats.ended == "complete"
    never, _ = integrate(rig(), 5.6, until=lambda steps: steps.x > 1.0)
    assert never.stats.ended == "complete" and np.array_equal(never.steps.x, first_event.steps.x)


def test_one_truth_for_all_steps_ends_a_run_at_the_last_of_them():
    asked = []

    def later(steps):
        asked.append(float(steps.t[-1]))
        return len(asked) == 2

    ended, state = integrate(rig(), 5.6, stops=(2.0, 4.0), until=later)
    assert asked == [2.0, 4.0] and ended.steps.t[-1] == 4.0 and ended.stats.ended == "until"
    without, same = integrate(rig(), 4.0, stops=(2.0,))
    assert np.array_equal(ended.steps.x, without.steps.x) and float(state.x) == float(same.x)


@pytest.mark.slow
def test_a_condition_is_met_after_more_steps_than_are_compiled_as_one():
    ended, state = integrate(rig(), 1e3, until=lambda steps: steps.t > 30.0)
    assert ended.stats.steps + ended.stats.rejected > PIECE and ended.stats.steps == ended.steps.t.size - 1
    assert ended.steps.t[-1] == pytest.approx(30.0, abs=1e-7) and float(state.x) == ended.steps.x[-1]


@pytest.mark.parametrize(
    ("until", "said"),
    [
        (lambda steps: steps.y > 0.0, r"(?s)until: steps have no field 'y'.*x \(m\).*stored \(J\)"),
        (lambda steps: steps.x - 1e-6, r"until: it must give True or False for each step.*float64"),
        (lambda steps: steps.x[1:] > 1e-6, "must give True or False for each step"),
        (lambda steps: steps.x < 1e-6, "true at the start"),
    ],
)
def test_a_condition_that_cannot_end_a_run_is_refused(until, said):
    with pytest.raises(InputError, match=said):
        integrate(rig(), 1.0, until=until)


def test_a_trace_is_read_off_between_the_steps():
    """`SaveAt(ts=...)` of diffrax, `Trajectory.at` on its steps and on those of `integrate`, the velocity as slope.

    Both go on from one state shortly before the slip: over seconds of creep rounding drives the two apart.
    """
    model = rig()
    _, state = integrate(model, 5.14)
    event, _ = integrate(model, 5.26, t0=5.14, state=state)
    ts = np.linspace(5.15, 5.25, 1237)
    subs = [
        diffrax.SubSaveAt(ts=ts, fn=lambda t, y, args: (y.x, y.v, y.psi)),
        diffrax.SubSaveAt(t0=True, steps=True, fn=observe),
    ]
    solution = jax.jit(
        lambda model: diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, args: y), ContactStepper(Tolerance()), 5.14, 5.26, 1e-5, state,
            args=(model, model.shaped()), saveat=diffrax.SaveAt(subs=subs), stepsize_controller=step_control(0.02),
            adjoint=diffrax.ForwardMode(), max_steps=4096,
        )
    )(model)  # fmt: skip
    stock, steps = solution.ys
    count = int(solution.stats["num_accepted_steps"])
    same = replace(event, steps=Steps(*(np.asarray(a)[: count + 1] for a in steps)))
    for name, found in zip(("x", "v", "psi"), map(np.asarray, stock), strict=True):
        size = np.max(np.abs(found))
        assert getattr(same.at(ts), name) == pytest.approx(found, rel=1e-12, abs=1e-14 * size)
        assert getattr(event.at(ts), name) == pytest.approx(found, rel=1e-9, abs=1e-9 * size)
    at = event.at(ts)
    assert not np.any(np.isin(ts, event.steps.t))
    fine = np.linspace(5.15, 5.25, 40_001)
    slope = np.gradient(event.at(fine).x, fine)
    assert slope[1:-1] == pytest.approx(event.at(fine).v[1:-1], abs=1e-3 * np.max(at.v))


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"mass": float("nan")}, "block.mass"),
        ({"mass": -0.0894}, "block.mass"),
        ({"spring_stiffness": float("inf")}, "block.spring_stiffness"),
        ({"damping": -1.0}, "block.damping"),
        ({"ratio": float("nan")}, "weakening.ratio"),
        ({"slip_distance": 0.0}, "weakening.slip_distance"),
        ({"springs": Bank(jnp.array([-1e6]), jnp.array([0.2]))}, "bank.stiffness"),
        ({"springs": Bank(jnp.array([1e6]), jnp.array([jnp.nan]))}, "bank.strength"),
        ({"effects": (AddedMass(share=-2.0),)}, "moving mass"),
    ],
    ids=str,
)
def test_impossible_rigs_are_refused_before_anything_moves(wrong, key):
    with pytest.raises(InputError, match=key):
        integrate(rig(**wrong), 1.0)


def test_an_impossible_drive_is_reported():
    with pytest.raises(SolveError, match=r"stopped at t = .* no longer a number; look for a parameter"):
        integrate(rig(float("nan")), 1.0)


class _Lost(BodyForce):
    """No number beyond a displacement."""

    def force(self, state, motion, contact):
        return jnp.where(motion.x > 1e-7, jnp.nan, 0.0)


class _Jump(BodyForce):
    """A wall that pushes back with a finite force at once: its point of balance does not exist."""

    def force(self, state, motion, contact):
        return jnp.where(motion.x > 1e-7, -10.0, 10.0)


@pytest.mark.slow
def test_a_number_lost_on_the_way_is_reported_with_its_time():
    with pytest.raises(SolveError, match=r"t = [1-3]\.\d+ s .*no longer a number|force that jumps") as told:
        integrate(rig(effects=(_Lost(),)), 4.0)
    way = told.value.trajectory  # up to where the fault is
    assert way.steps.t[0] == 0.0 and way.stats.ended == "failed" and way.stats.steps == way.steps.t.size - 1
    assert np.nanmax(way.steps.x) == pytest.approx(1e-7, rel=0.05)


class _Rattle(BodyForce):
    """Coulomb friction as a bare sign of the velocity: while the block sticks, no velocity balances it."""

    def force(self, state, motion, contact):
        return -0.05 * jnp.sign(motion.v)


class _Push(BodyForce):
    """A force switched on at one moment."""

    def force(self, state, motion, contact):
        return jnp.where(motion.t > 1.0, 0.01, 0.0)


def test_a_force_that_jumps_is_given_up_with_advice():
    with pytest.raises(SolveError, match=r"steps were not enough|force that jumps"):
        integrate(rig(effects=(_Jump(),)), 4.0, most_steps=4000)


@pytest.mark.slow
def test_steps_that_lead_nowhere_are_given_up_at_once():
    seen = []
    with pytest.raises(SolveError, match=r"steps advanced it by only .* force that jumps"):
        integrate(rig(effects=(_Rattle(),)), 4.0, progress=lambda now, piece: seen.append(now))
    assert len(seen) < 4


@pytest.mark.slow
def test_the_trace_of_a_run_is_kept_unless_a_law_is_not_of_this_package(monkeypatch):
    """Code of one's own may change between two starts under the same name."""
    module, names = importlib.import_module("stickslip.simulation.solve.integrate"), []

    def noted(function, name):
        names.append(name)
        return Program(function, name)

    monkeypatch.setattr(module, "Program", noted)
    module._program.cache_clear()
    for effects in ((), (AddedMass(),), (_Push(),)):
        integrate(rig(effects=effects), 1e-3)
    plain, loaded, own = names
    assert plain != loaded
    assert None not in (plain, loaded)
    assert own is None


@pytest.mark.slow
def test_a_single_jump_in_time_is_stepped_over():
    trajectory, _ = integrate(rig(effects=(_Push(),)), 2.0)
    s = trajectory.steps
    moved = trajectory.at(np.array([0.99, 1.2])).x
    assert np.diff(moved)[0] > 0.01 / 1.2e6
    assert s.t[-1] == 2.0


@pytest.mark.parametrize(
    ("times", "positions", "word"),
    [
        ([0.0], [0.0], "two times or more"),
        ([0.0, 1.0, 2.0], [0.0, 1e-4], r"as many positions \(got \(\(3,\), \(2,\)\)\)"),
        ([0.0, 2.0, 2.0], [0.0, 1e-4, 2e-4], "times of the load point must increase"),
    ],
)
def test_a_load_point_refuses_what_is_no_motion(times, positions, word):
    with pytest.raises(InputError, match=word):
        LoadPoint(jnp.array(times), jnp.array(positions))


def test_a_load_point_of_lists_moves():
    assert float(LoadPoint([0.0, 2.0], [0.0, 1e-4])(jnp.array(1.0))) == 5e-5


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        ({"t1": 0.0}, "t1: the end of a run must be after its start"),
        ({"t1": np.nan}, "t1: the end"),
        ({"t1": 1.0, "t0": 2.0}, r"(?s)t1: the end .*allowed: above 2 s"),
        ({"t1": 1.0, "largest_step": 0.0}, "largest_step: the longest step must be positive"),
    ],
)
def test_a_run_without_a_length_is_refused(asked, word):
    with pytest.raises(InputError, match=word):
        integrate(rig(), **asked)


def test_a_state_of_another_model_is_refused():
    other = rig(effects=(make("contact-ageing"),))
    for state in (other.rest(), rig(springs=bank(7)).rest()):
        with pytest.raises(InputError, match=r"(?s)state is not one of this model.*model.rest"):
            integrate(rig(), 0.01, state=state)


def test_a_trajectory_says_what_it_is_and_has_units(first_event):
    text, s = repr(first_event), first_event.steps
    assert len(text) < 400 and f"steps: {first_event.stats.steps}" in text and "to: 5.6 s" in text and "mN" in text
    found = first_event.to_xarray()
    assert [found[name].attrs["units"] for name in ("time", "x", "v", "psi", "friction_work")] == [
        "s",
        "m",
        "m/s",
        "1",
        "J",
    ]
    assert np.array_equal(found.time, s.t) and np.array_equal(found.x, s.x)
    assert found.attrs["energy_error"] == first_event.stats.energy_error
    later = first_event.to_xarray([5.0, 99.0])
    assert later.x[0] == first_event.at(np.array([5.0])).x[0] and later.x[1] == s.x[-1]  # beyond its end: the end


def test_an_attribute_that_a_condition_lacks_of_something_else_is_its_own_error():
    with pytest.raises(AttributeError, match="nothing"):
        integrate(rig(), 1.0, until=lambda steps: math.nothing > steps.x)


def test_the_fields_of_steps_are_told_with_their_units():
    told = inspect.getdoc(Steps)
    assert all(re.search(rf"\b{name}\b.*:", told) for name in Steps._fields)
