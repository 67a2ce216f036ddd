"""Effects of block, drive and sensor against independent calculations."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.random import default_rng
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from stickslip.physics.contact import Bank, power_law_bank
from stickslip.physics.effects import lag
from stickslip.physics.effects.base import Contact, Motion
from stickslip.physics.effects.catalogue import make
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.simulation.solve import Tolerance, integrate

BANK = power_law_bank(0.2604, 0.95e-6, 3.6, n=24)


def pulled(effects: tuple, t1: float, relative: float = 1e-2, velocity: float = 1e-3):
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, velocity]))
    model = Model(Block(damping=20.0), BANK, Weakening(), drive, effects)
    return integrate(model, t1, tolerance=Tolerance(relative, 1e-9 * relative, 1e-5 * relative))[0].steps


def motion(dt: float, x: float, v: float, dx: float) -> Motion:
    zero = jnp.zeros(())
    return Motion(zero, jnp.asarray(dt), jnp.asarray(x), jnp.asarray(v), zero, jnp.asarray(dx), zero)


@pytest.mark.parametrize("rate_dt", [1e-9, 1e-3, 0.3, 0.999, 1.001, 3.0, 50.0])
def test_filters_are_exact_for_a_parabola(rate_dt: float) -> None:
    dt, x0, v0, v1 = 1e-3, 2e-6, -3e-3, 5e-3
    dx = 0.5 * dt * (v0 + v1)
    rate, start = rate_dt / dt, 0.7e-6

    def x(t):
        return x0 + v0 * t + 0.5 * (v1 - v0) / dt * t * t

    follow = solve_ivp(lambda t, y: rate * (x(t) - y), (0, dt), [start], rtol=1e-12, atol=1e-18, method="DOP853")
    trail = solve_ivp(
        lambda t, y: v0 + (v1 - v0) / dt * t - rate * y, (0, dt), [start], rtol=1e-12, atol=1e-18, method="DOP853"
    )
    step = motion(dt, x0 + dx, v1, dx)
    assert float(lag.follow(jnp.asarray(start), rate, step)) == pytest.approx(follow.y[0, -1], rel=1e-9)
    if rate_dt >= 1e-3:
        assert float(lag.trail(jnp.asarray(start), 1.0 / rate, step)) == pytest.approx(trail.y[0, -1], rel=1e-8)


def test_low_pass_loses_nothing_in_the_shortest_steps() -> None:
    """Ten thousand steps of 0.1 ns against one of 1 us, of the same uniform acceleration."""
    tau, dt, n, a = 2e-3, 1e-10, 10_000, 3.0
    behind = jnp.zeros(())

    def body(k, behind):
        t = (k + 1.0) * dt
        zero = jnp.zeros(())
        return lag.trail(behind, tau, Motion(t, dt + zero, a * t * t / 2, a * t, zero, a * (t - dt / 2) * dt, zero))

    behind = jax.lax.fori_loop(0, n, body, behind)
    whole = lag.trail(jnp.zeros(()), tau, motion(n * dt, a * (n * dt) ** 2 / 2, a * n * dt, a * (n * dt) ** 2 / 2))
    assert abs(float(behind - whole)) < 1e-15


def test_filters_at_their_nulls_have_the_right_derivative() -> None:
    step = motion(1e-3, 5e-6, 4e-3, 3e-6)
    value, slope = jax.jvp(lambda tau: lag.trail(jnp.zeros(()), tau, step), (jnp.zeros(()),), (jnp.ones(()),))
    assert float(value) == 0.0 and float(slope) == pytest.approx(4e-3, rel=1e-12)
    value, slope = jax.jvp(lambda rate: lag.follow(jnp.asarray(1e-6), rate, step), (jnp.zeros(()),), (jnp.ones(()),))
    parabola = [2e-6, 2 * 3e-6 / 1e-3 - 4e-3, (4e-3 - 3e-6 / 1e-3) / 1e-3]
    area = sum(c * 1e-3 ** (k + 1) / (k + 1) for k, c in enumerate(parabola))
    assert float(value) == 1e-6 and float(slope) == pytest.approx(area - 1e-6 * 1e-3, rel=1e-12)


@pytest.mark.slow
def test_low_pass_and_high_pass_over_a_slip() -> None:
    """The readings of a run are those of the filters' differential equations on the run's displacement."""
    tau, cutoff = 1e-3, 2.0
    low = pulled((make("sensor-low-pass", time_constant=tau),), 0.33, 1e-3)
    high = pulled((make("sensor-high-pass", cutoff=cutoff),), 0.33, 1e-3)
    assert np.array_equal(low.x, high.x)
    x = CubicHermiteSpline(low.t, low.x, low.v)

    def filtered(rate):
        return solve_ivp(
            lambda t, y: rate * (x(t) - y),
            (0, low.t[-1]),
            [0.0],
            t_eval=low.t,
            rtol=1e-7,
            atol=1e-13,
            max_step=2e-4,
        ).y[0]

    assert np.max(low.x) > 50e-6
    assert np.max(np.abs(low.reading - filtered(1 / tau))) < 2e-4 * np.max(low.x)
    assert np.max(np.abs(low.reading - low.x)) > 1e-2 * np.max(low.x)
    assert np.max(np.abs(high.x - high.reading - filtered(2 * np.pi * cutoff))) < 2e-4 * np.max(low.x)


@pytest.mark.slow
def test_sensors_leave_the_motion_alone() -> None:
    plain = pulled((), 0.2)

    def sensors(gain: float = 0.0, compliance: float = 0.0, rate: float = 0.0) -> tuple:
        return (
            make("sensor-gain", gain=gain),
            make("machine-compliance", compliance=compliance),
            make("sensor-drift", rate=rate),
        )

    drift, gain, spot = (
        pulled(sensors(**{k: v}), 0.2) for k, v in (("rate", 2e-8), ("gain", -0.02), ("compliance", 1e-7))
    )
    for other in (drift, gain, spot):
        assert np.allclose(other.x, plain.x, rtol=0, atol=1e-13)
    assert np.allclose(drift.reading - drift.x, 2e-8 * drift.t, rtol=0, atol=1e-20)
    assert np.allclose(gain.reading, 0.98 * gain.x, rtol=1e-14)
    assert np.allclose(spot.reading - spot.x, 1e-7 * spot.contact_force, rtol=1e-12)


def in_series(bank: Bank, compliance: float, path: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Total force (N) of a bank behind a spring at the displacements ``path`` (m), caps times ``factors``: by roots."""
    stiffness, strength = np.asarray(bank.stiffness), np.asarray(bank.strength)
    force, out, u = np.zeros_like(stiffness), [], 0.0

    def after(du, factor):
        return np.clip(force + stiffness * du, -factor * strength, factor * strength)

    for x, factor in zip(path, factors, strict=True):
        gap = lambda new, x=x, factor=factor, u=u: new + compliance * np.sum(after(new - u, factor)) - x  # noqa: E731
        reach = abs(x) + compliance * np.sum(strength) + 1e-7
        new = brentq(gap, -reach, reach, xtol=1e-22, rtol=1e-15)
        force, u = after(new - u, factor), new
        out.append(force.sum())
    return np.array(out)


def march(bank: Bank, path: np.ndarray, factors: np.ndarray) -> np.ndarray:
    force, before, out = jnp.zeros_like(bank.stiffness), 0.0, []
    for x, factor in zip(path, factors, strict=True):
        cap = factor * bank.strength
        force = jnp.clip(force + bank.stiffness * (x - before), -cap, cap)
        before = x
        out.append(float(jnp.sum(force)))
    return np.array(out)


@pytest.mark.parametrize("compliance", [1e-9, 2e-7, 1e-6])
def test_series_compliance_is_exact_for_any_history(compliance: float) -> None:
    """At constant friction the bank with a spring in series is a bank again; also for contacts that differ."""
    twice = Bank(
        jnp.concatenate([BANK.stiffness, 0.5 * BANK.stiffness[::-1]]),
        jnp.concatenate([BANK.strength, 0.8 * BANK.strength[::-1]]),
    )
    path = np.cumsum(default_rng(1).normal(0, 0.5e-6, 60))
    for bank in (BANK, twice):
        shaped = make("machine-compliance", compliance=compliance, where="series").reshape(bank)
        assert float(shaped.total_strength) == pytest.approx(float(bank.total_strength), rel=1e-12)
        stiffness = float(bank.total_stiffness)
        assert float(shaped.total_stiffness) == pytest.approx(stiffness / (1 + compliance * stiffness), rel=1e-12)
        expected = in_series(bank, compliance, path, np.ones(60))
        assert np.max(np.abs(march(shaped, path, np.ones(60)) - expected)) < 1e-12 * float(bank.total_strength)


def test_series_compliance_while_friction_falls() -> None:
    """Exact on the way forward when all caps fall together; in a reversal off by a share that is stated, not hidden."""
    bank, compliance = BANK, 2e-7
    shaped = make("machine-compliance", compliance=compliance, where="series").reshape(bank)
    forward = np.linspace(0, 3e-6, 40)
    falls = np.linspace(1.0, 0.8, 40)
    full = float(bank.total_strength)
    error = np.abs(march(shaped, forward, falls) - in_series(bank, compliance, forward, falls))
    assert np.max(error) < 1e-12 * full
    back = np.concatenate([forward, 3e-6 - np.linspace(0, 0.03e-6, 20)])
    falls = np.concatenate([np.ones(40), np.linspace(1.0, 0.9, 20)])
    error = np.abs(march(shaped, back, falls) - in_series(bank, compliance, back, falls))
    share = 0.1 * compliance * float(bank.total_stiffness)  # of the fall, over the fixture's share
    assert 0.01 * share * full < np.max(error) < 0.1 * share * full


@pytest.mark.slow
def test_series_compliance_lowers_the_ring_frequency() -> None:
    """Free ringing of the stuck block around zero at small amplitude: (k_t/(1 + k_t/k_m) + c_s)/m."""
    compliance = 3e-7
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.zeros(2))
    periods = []
    for effects in ((), (make("machine-compliance", compliance=compliance, where="series"),)):
        model = Model(Block(damping=1.0), BANK, Weakening(ratio=1.0), drive, effects)
        steps = integrate(
            model, 0.02, state=model.rest(v=1e-7), tolerance=Tolerance(1e-4, 1e-15, 1e-11), largest_step=1e-5
        )[0].steps
        ups = np.flatnonzero((steps.x[:-1] < 0) & (steps.x[1:] >= 0))
        crossings = steps.t[ups] - steps.x[ups] * np.diff(steps.t)[ups] / np.diff(steps.x)[ups]
        periods.append(np.mean(np.diff(crossings)))
    k = float(BANK.total_stiffness)
    expected = np.sqrt((k + 1000.0) / (k / (1 + compliance * k) + 1000.0))
    assert periods[1] / periods[0] == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("by", ["spring", "contact"])
@pytest.mark.parametrize("n", [3, 40])
def test_tilt_takes_the_force_at_the_end_of_a_step(by: str, n: int) -> None:
    """Quasi-static loading, F = sum(min(k x, c (1 + kappa F/F_s))): exact whatever the number of steps."""
    kappa = -0.3
    stiffness, strength = np.asarray(BANK.stiffness), np.asarray(BANK.strength)
    full = strength.sum()

    def equilibrium(x: float) -> float:
        return brentq(
            lambda f: f - np.minimum(stiffness * x, strength * (1 + kappa * f / full)).sum(), 0, full, xtol=1e-15
        )

    model = Model(Block(), BANK, Weakening(ratio=1.0), LoadPoint(jnp.arange(2.0), jnp.arange(2.0)), ())
    model = eqx.tree_at(lambda m: m.effects, model, (make("tilt", coupling=kappa, by=by),))
    bank, state, before, pull = model.shaped(), model.rest(), 0.0, 0.0
    for x in 0.8e-6 * (np.arange(1, n + 1) / n) ** 2:
        force = equilibrium(x)
        step = motion(1e-3, x, 1e-6, x - before)._replace(load_point=jnp.asarray(x + force / 1000.0))
        contact = Contact(state.force, bank.stiffness, bank.strength, jnp.asarray(pull), state.cap, jnp.asarray(0.1))
        state, forces = model.advance(state, bank, contact, step)
        assert float(forces.contact) == pytest.approx(force, rel=1e-10)
        before, pull = x, force


@pytest.mark.parametrize("others", [0, 1])
def test_a_contact_that_is_pulled_open_carries_nothing(others: int) -> None:
    """A pull of twice what takes all load away; two such effects do not make a load again."""
    effects = tuple(make("tilt", coupling=-0.3, by=by) for by in ("spring", "contact")[: others + 1])
    model = Model(Block(), BANK, Weakening(ratio=1.0), LoadPoint(jnp.arange(2.0), jnp.arange(2.0)), ())
    model = eqx.tree_at(lambda m: m.effects, model, effects)
    bank, state = model.shaped(), model.rest()
    step = motion(1e-3, 1e-6, 1e-3, 1e-6)
    pull = 2.0 / 0.3 * float(np.sum(np.asarray(BANK.strength)))
    contact = Contact(state.force, bank.stiffness, bank.strength, jnp.asarray(0.0), state.cap, jnp.asarray(0.1))
    far = step._replace(load_point=jnp.asarray(1e-6 + pull / float(model.block.spring_stiffness)))
    state, forces = model.advance(state, bank, contact, far)
    assert np.all(np.asarray(state.cap) == 0.0)
    assert float(forces.contact) == 0.0


@pytest.mark.slow
def test_tilt_by_the_springs_force_sets_the_breakaway() -> None:
    """Slow loading at constant friction: F = F_s (1 + kappa F/F_s), hence F = (F_s + c v)/(1 - kappa) with damping."""
    for kappa in (-0.2, 0.1):
        drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 1e-3]))
        model = Model(Block(damping=20.0), BANK, Weakening(ratio=1.0), drive, (make("tilt", coupling=kappa),))
        steps = integrate(model, 0.6)[0].steps
        assert steps.spring_force[-1] == pytest.approx((0.2604 + 20.0 * 1e-3) / (1 - kappa), rel=1e-3)


def test_ripple_starts_at_rest_and_repeats_with_the_pitch() -> None:
    effect = make("drive-ripple", ripple=2e-7, pitch=5e-4, phase=0.7)
    at = jnp.linspace(0, 1.5e-3, 301)
    lead = np.asarray(effect.lead(jnp.zeros(()), at))
    assert lead[0] == 0.0
    assert np.allclose(lead[:101], lead[100:201], atol=1e-18)
    assert np.ptp(lead) == pytest.approx(4e-7, rel=1e-3)


@pytest.mark.slow
def test_base_vibration_shakes_a_stuck_block_as_a_spring() -> None:
    """Far below resonance the block follows quasi-statically: x = -m a_b sin(wt)/(k_t + c_s), up to microslip."""
    effect = make("base-vibration", acceleration=0.01, frequency=5.0)
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.zeros(2))
    model = Model(Block(damping=20.0), BANK, Weakening(ratio=1.0), drive, (effect,))
    steps = integrate(model, 0.4, largest_step=2e-3)[0].steps
    expected = -0.0894 * 0.01 * np.sin(2 * np.pi * 5.0 * steps.t) / (float(BANK.total_stiffness) + 1000.0)
    late = steps.t > 0.1
    assert np.max(np.abs(steps.x - expected)[late]) < 0.03 * np.max(np.abs(expected))


def test_load_modulation_and_inertia_scale_what_they_say() -> None:
    zero = jnp.zeros(())
    effect = make("load-modulation", depth=0.04, frequency=10.0, phase=0.3)
    at = motion(1e-3, 0.0, 0.0, 0.0)._replace(t=jnp.asarray(0.0123))
    expected = 1 + 0.04 * np.sin(2 * np.pi * 10.0 * 0.0123 + 0.3)
    assert float(effect.strength((), at, None)) == pytest.approx(expected, rel=1e-14)
    model = Model(
        Block(mass=0.1),
        BANK,
        Weakening(),
        LoadPoint(jnp.arange(2.0), zero + jnp.zeros(2)),
        (make("inertia", share=0.05),),
    )
    assert float(model.mass()) == pytest.approx(0.105, rel=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["quadratic", "cubic"])
def test_nonlinear_spring_moves_the_breakaway(form: str) -> None:
    """Steady sliding at constant friction: the spring holds F_s + c v, wherever its law puts the block."""
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 1e-3]))
    effect = make("nonlinear-spring", curvature=200.0, form=form)
    model = Model(Block(damping=20.0), BANK, Weakening(ratio=1.0), drive, (effect,))
    steps = integrate(model, 0.6)[0].steps
    stretch = 1e-3 * steps.t[-1] - steps.x[-1]
    lever = stretch if form == "quadratic" else stretch**2 / 1e-4
    assert 1000.0 * stretch * (1 + 200.0 * lever) == pytest.approx(0.2604 + 20.0 * 1e-3, rel=1e-3)
