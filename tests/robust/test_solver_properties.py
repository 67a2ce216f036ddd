"""The solver over the whole allowed range of parameters: it holds to the laws, or says that it cannot go on.

One compiled program for all examples: everything that hypothesis draws is an array of a fixed shape.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stickslip.errors import SolveError
from stickslip.physics.contact import Bank
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.physics.params import specs
from stickslip.simulation.solve import Tolerance, integrate

N = 16
MOST = 30_000  # steps of one example
EXAMPLES = {"deadline": None, "derandomize": True, "database": None}


def _spec(cls: type, name: str) -> tuple[float, float]:
    found = specs(cls)[name]
    return found.lower, found.upper


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Evenly over the logarithm, both ends included."""
    return st.one_of(
        st.floats(np.log10(low), np.log10(high)).map(lambda e: float(np.clip(10.0**e, low, high))),
        st.sampled_from([low, high]),
    )


def above_zero(low: float, high: float, least: float) -> st.SearchStrategy[float]:
    return st.one_of(st.just(low), decades(least, high)) if low == 0.0 else decades(low, high)


@st.composite
def rigs(draw) -> tuple[Model, float, float]:
    """A model anywhere in the allowed range, the time to simulate, and the scale of its forces.

    The time is so long that the drive loads the contact a few times over, as far as the steps go.
    """
    mass = draw(decades(*_spec(Block, "mass")))
    spring = draw(decades(*_spec(Block, "spring_stiffness")))
    damping = draw(above_zero(*_spec(Block, "damping"), 1e-6))
    ratio = draw(st.floats(*_spec(Weakening, "ratio")))
    slip_distance = draw(decades(*_spec(Weakening, "slip_distance")))
    healing_time = draw(decades(*_spec(Weakening, "healing_time")))
    strength = draw(decades(1e-6, 1e6))
    u_max = draw(decades(1e-10, 1e-3))
    velocity = draw(decades(1e-9, 10.0)) * draw(st.sampled_from([1.0, -1.0]))
    share = np.array(draw(st.lists(st.floats(0.0, 1.0), min_size=N, max_size=N)))
    share[0] = max(share[0], 1e-3)
    caps = strength * share / share.sum()
    bank = Bank(jnp.asarray(caps / (u_max * (np.arange(N) + 1) / N)), jnp.asarray(caps))
    period = 2.0 * np.pi * np.sqrt(mass / (float(np.sum(bank.stiffness)) + spring))
    loading = max((strength / spring + u_max) / abs(velocity), 2.0 * period)
    end = 3.0 * loading
    times = jnp.asarray([0.0, 2.0 * loading, 2.5 * loading, 1e3 * loading])
    positions = velocity * jnp.asarray([0.0, 2.0, 1.0, 999.5]) * loading  # forwards, back, forwards
    model = Model(
        Block(mass, spring, damping), bank, Weakening(ratio, slip_distance, healing_time), LoadPoint(times, positions)
    )
    return model, end, strength


def run(model: Model, end: float, tighter: float = 1.0, t0: float = 0.0, state=None):
    """Integrate with tolerances that fit the rig's own scale: how far all springs together carry the full strength."""
    mass, k = float(model.block.mass), float(np.sum(model.bank.stiffness) + model.block.spring_stiffness)
    u = float(np.sum(model.bank.strength)) / k
    tolerance = Tolerance(*(part / tighter for part in (3e-3, 3e-6 * u, 3e-6 * u * np.sqrt(k / mass))))
    kinks = tuple(np.asarray(model.load_point.times[1:3]))
    return integrate(
        model, end, t0=t0, state=state, tolerance=tolerance, stops=kinks, largest_step=end / 50, most_steps=MOST
    )


def within_caps(model: Model, state) -> None:
    force, cap = np.abs(state.force), np.asarray(state.cap)
    assert np.all(force <= cap * (1 + 1e-12))
    assert np.all(cap <= np.asarray(model.bank.strength) * (1 + 1e-12))


def imbalance(model: Model, s) -> float:
    """Largest energy that is missing or too much, over the work of the spring.

    Left out are single steps that go over a whole stick and slip: longer than the contact takes to answer, and farther
    than it holds, weakened as it is then. What happens within such a step has no balance.
    """
    strength, k = float(np.sum(model.bank.strength)), float(np.sum(model.bank.stiffness) + model.block.spring_stiffness)
    answer = max(2.0 * np.pi * np.sqrt(float(model.block.mass) / k), float(model.block.damping) / k)
    ratio = float(model.weakening.ratio)
    held = strength * (ratio + (1.0 - ratio) * np.minimum(s.psi[1:], s.psi[:-1]))
    leap = (np.diff(s.t) > answer) & (np.abs(np.diff(s.x)) > held / k)
    gap = np.diff(s.spring_work + s.body_work - s.stored - s.friction_work - s.viscous_work)
    scale = np.max(np.abs(s.spring_work)) + np.max(np.abs(s.stored))
    return float(np.max(np.abs(np.cumsum(np.where(leap, 0.0, gap)))) / scale) if scale > 0 else 0.0


@pytest.mark.slow
def test_the_laws_hold_wherever_the_solver_gets_which_is_most_of_the_range():
    finished: list[bool] = []
    excused: list[bool] = []
    coarse: list[bool] = []
    looked: list[float] = []

    @settings(max_examples=150, **EXAMPLES)
    @given(rigs(), st.lists(st.floats(0.01, 0.99), min_size=5, max_size=5, unique=True))
    def laws(rig, moments):
        model, end, strength = rig
        try:
            trajectory, state = run(model, end)
        except SolveError as error:
            # refused steps end in words: when, how fast, and what to change
            finished.append(False)
            assert "the integration stopped at t = " in str(error)
            assert "loosen the tolerance" in str(error) or "parameter" in str(error)
            return
        finished.append(True)
        s = trajectory.steps
        assert all(np.isfinite(part).all() for part in s)
        assert s.t[-1] == end
        assert np.all(np.diff(s.t) > 0)
        # |f_i| <= cap of every element, at most its full strength, whenever one looks
        within_caps(model, state)
        now, state = 0.0, None
        for moment in sorted(moments):
            try:
                _, state = run(model, moment * end, t0=now, state=state)
            except SolveError:
                break
            now = moment * end
            within_caps(model, state)
            looked.append(moment)
        assert np.all(np.abs(s.contact_force) <= strength * (1 + 1e-9))
        assert np.all((s.psi >= 0.0) & (s.psi <= 1.0 + 1e-12))
        # friction and damping only take energy
        scale = np.max(np.abs(s.spring_work)) + np.max(np.abs(s.stored))
        assert np.all(np.diff(s.friction_work) >= -1e-9 * scale)
        assert np.all(np.diff(s.viscous_work) >= -1e-9 * scale)
        # the balance is kept, or a tighter tolerance keeps it
        off = imbalance(model, s)
        excused.append(off <= 0.02 < trajectory.stats.energy_error)
        coarse.append(off > 0.02)
        if off > 0.02:
            try:
                finer, _ = run(model, end, 30.0)
            except SolveError:  # of too many steps
                return
            assert imbalance(model, finer.steps) < 0.3 * off

    laws()
    # else the laws would hold of nothing
    assert len(finished) > 100
    assert np.mean(finished) > 0.5
    assert len(looked) > 4 * sum(finished)
    assert np.mean(excused) < 0.1
    assert np.mean(coarse) < 0.05, (np.mean(finished), np.mean(excused), np.mean(coarse))


@pytest.mark.slow
@settings(max_examples=100, **EXAMPLES)
@given(
    mass=decades(*_spec(Block, "mass")),
    spring=decades(*_spec(Block, "spring_stiffness")),
    strength=decades(1e-6, 1e6),
    u_max=decades(1e-10, 1e-3),
    slowness=decades(200.0, 1e5),
)
def test_creep_is_monotone_under_a_load_that_grows(mass, spring, strength, u_max, slowness):
    """Quasi-static: constant friction, critical damping of the contact, up to 95 % of full friction."""
    i = np.arange(N) + 1
    caps = jnp.asarray(np.full(N, strength / N))
    bank = Bank(caps / jnp.asarray(u_max * i / N), caps)
    k = float(np.sum(bank.stiffness)) + spring
    damping = 2.0 * np.sqrt(k * mass)
    assume(damping <= _spec(Block, "damping")[1])
    seconds = max(slowness * damping / k, 0.01)
    velocity = (strength / spring + u_max) / seconds
    points = LoadPoint(jnp.asarray([0.0, 1.0, 2.0, 3.0]), velocity * jnp.asarray([0.0, 1.0, 2.0, 3.0]))
    model = Model(Block(mass, spring, damping), bank, Weakening(1.0), points)
    trajectory, _ = run(model, 0.9 * seconds)
    s = trajectory.steps
    inside = s.t > 20.0 * damping / k
    assert inside.sum() > 20
    assert np.all(np.diff(s.x[inside]) > 0)
    assert np.all(np.diff(s.contact_force[inside]) > 0)


class _Never(Weakening):
    """A law that is no number as soon as anything moves."""

    def strength(self, psi):
        return super().strength(psi) + jnp.where(psi < 1.0, jnp.nan, 0.0)


@pytest.mark.slow
def test_steps_that_are_refused_for_ever_end_in_words_at_once():
    times = jnp.asarray([0.0, 1.0, 2.0, 3.0])
    bank = Bank(jnp.full(N, 1e5), jnp.full(N, 0.02))
    model = Model(Block(), bank, _Never(0.5, 1e-6, 0.02), LoadPoint(times, 1e-4 * times))
    with pytest.raises(SolveError, match=r"stopped at t = .*(step size fell|no longer|advanced it by only)"):
        integrate(model, 1.0)
