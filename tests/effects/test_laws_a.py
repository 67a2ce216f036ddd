"""The laws of contact, friction and geometry, each against its analytic or an independent value."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from marching import bank_of, march, spread_out, still_model
from scipy.integrate import solve_ivp

from stickslip.physics.contact import mixture, power_law_backbone, power_law_bank
from stickslip.physics.effects import contact_renewal
from stickslip.physics.effects.adhesion import Adhesion
from stickslip.physics.effects.contact_ageing import ContactAgeing
from stickslip.physics.effects.contact_damping import ContactDamping
from stickslip.physics.effects.contact_renewal import ContactRenewal
from stickslip.physics.effects.curvature import Curvature
from stickslip.physics.effects.direct_effect import DirectEffect
from stickslip.physics.effects.flash_heating import FlashHeating
from stickslip.physics.effects.plasticity import Plasticity
from stickslip.physics.effects.position_dependent_friction import PositionDependentFriction
from stickslip.physics.effects.residual_load import ResidualLoad
from stickslip.physics.effects.roll_off import RollOff
from stickslip.physics.effects.slip_weakening import SlipWeakening
from stickslip.physics.effects.thermal_creep import ThermalCreep
from stickslip.physics.effects.unequal_contacts import UnequalContacts
from stickslip.physics.effects.velocity_weakening import VelocityWeakening
from stickslip.physics.effects.viscoelastic_contact import ViscoelasticContact
from stickslip.physics.effects.viscous_drag import ViscousDrag
from stickslip.physics.effects.wear import Wear
from stickslip.simulation.solve import Tolerance, integrate

STRENGTH = 0.26
ONE = bank_of(1e6, STRENGTH)  # a single element, threshold 0.26 um
BANK = power_law_bank(STRENGTH, 0.95e-6, 3.6, n=64)


def total(force):
    return force.sum(axis=1)


# --- friction: factors on the caps ---------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 40])
def test_ageing_grows_by_its_rate_per_e_fold_of_hold_time(steps):
    """Peak force on reloading after holds of 10 s and 10e s; a slide before wipes the first age out."""
    effect = ContactAgeing(rate=0.01, onset_time=0.01, slip_distance=1e-5, first_age=1e4)
    peaks = []
    for hold in (10.0, 10.0 * np.e):
        parts = [(0.05, 1e-2, 50), (1e-4, -1e-2, 5), (hold, 0.0, steps), (1e-4, 1e-2, 400)]
        peaks.append(total(march(ONE, [effect], *spread_out(parts))[0])[-400:].max())
    assert peaks[1] - peaks[0] == pytest.approx(0.01 * STRENGTH, rel=1e-3)


def test_ageing_forgets_over_its_slip_distance():
    """theta -> D/v + (theta_1 - D/v) exp(-s/D) at constant speed, whatever the step."""
    effect = ContactAgeing(rate=0.01, slip_distance=2e-6, first_age=50.0)
    v, way = 1e-4, 5e-6
    for n in (1, 7, 100):
        state = march(ONE, [effect], *spread_out([(way / v, v, n)]))[2].memory[0]
        steady = 2e-6 / v
        assert float(state) == pytest.approx(steady + (50.0 - steady) * np.exp(-way / 2e-6), rel=1e-10)


def steady_pull(effect, v):
    """Force of a stiff spring (N) after the block has slid at the drive's velocity for many times its stretch."""
    model = still_model(ONE, effect, velocity=v, spring=1e5)
    trajectory, _ = integrate(model, 3e-5 / v, state=model.rest(v=v))
    return trajectory.steps.spring_force[-1]


@pytest.mark.slow
@pytest.mark.parametrize("form", ["shifted", "asinh"])
def test_direct_effect_in_steady_sliding_of_the_block(form):
    """The spring shows F_s (1 + a ln(v/v*)); a decade of velocity is worth a ln(10)."""
    effect = DirectEffect(strengthening=0.02, cutoff_velocity=1e-8, form=form)
    slow, fast = (steady_pull(effect, v) for v in (1e-5, 1e-4))
    assert fast - slow == pytest.approx(0.02 * STRENGTH * np.log(10.0), rel=2e-3)
    assert slow == pytest.approx(STRENGTH * (1 + 0.02 * np.log(1e3)), rel=1e-4)


@pytest.mark.parametrize("form", ["shifted", "asinh"])
def test_direct_effect_is_static_far_below_its_cutoff(form):
    effect = DirectEffect(strengthening=0.1, cutoff_velocity=1e-7, form=form)
    force = total(march(ONE, [effect], *spread_out([(1e5, 1e-11, 10)]))[0])[-1]
    assert force == pytest.approx(STRENGTH, rel=2e-5)


@pytest.mark.parametrize(
    ("form", "q", "left"),
    [
        ("exponential", 1.0, np.exp(-2.0)),
        ("exponential", 2.0, np.exp(-4.0)),
        ("exponential", 0.5, np.exp(-(2.0**0.5))),
        ("hyperbolic", 1.0, 1 / 3),
        ("hyperbolic", 2.0, 1 / 5),
    ],
)
def test_stribeck_curve_at_twice_its_velocity(form, q, left):
    effect = VelocityWeakening(drop=0.2, velocity=1e-3, exponent=q, form=form)
    force = total(march(ONE, [effect], 1e-3, np.full(5, 2e-3))[0])[-1]
    # what the rounding at rest takes from s is 1e-3**q
    assert force / STRENGTH == pytest.approx(1 - 0.2 * (1 - left), abs=0.2 * 1e-3**q)


def test_stribeck_weakening_needs_no_small_step():
    """Implicit in the end velocity: an accelerating block ends where it does at a finer tolerance."""
    effect = VelocityWeakening(drop=0.3, velocity=1e-4)
    model = still_model(ONE, effect, velocity=5e-3, damping=20.0)
    ends = [integrate(model, 0.08, tolerance=Tolerance(r, 1e-9 * r, 1e-5 * r))[0] for r in (1e-2, 1e-3)]
    assert ends[0].steps.x[-1] == pytest.approx(ends[1].steps.x[-1], rel=1e-3)
    assert ends[1].steps.x[-1] > 1e-4


def slip_weakened(bank, u, drop, distance):
    """Force (N) at displacements u of a bank whose elements weaken with the way beyond their threshold."""
    k, c, reach = (np.asarray(a)[None, :] for a in (bank.stiffness, bank.strength, bank.threshold))
    beyond = np.maximum(u[:, None] - reach, 0.0)
    return np.minimum(k * u[:, None], c * (1 - drop * -np.expm1(-beyond / distance))).sum(axis=1)


def test_slip_weakening_changes_the_static_curve_whatever_the_drive():
    effect = SlipWeakening(drop=0.3, distance=2e-7)
    u = np.linspace(0, 1.5e-6, 301)[1:]
    for duration in (1e-3, 1e5):
        force = total(march(BANK, [effect], np.full(300, duration / 300), 1.5e-6 / duration)[0])
        np.testing.assert_allclose(force, slip_weakened(BANK, u, 0.3, 2e-7), rtol=2e-3)
    assert force.max() < 0.97 * STRENGTH


def test_slip_weakening_is_forgotten_by_sticking():
    """After a return by the whole threshold the element starts anew; after a return by a third of the recovery, not."""
    effect = SlipWeakening(drop=0.3, distance=2e-7, recovery_distance=3e-8)
    state = march(ONE, [effect], *spread_out([(1.0, 3e-6, 50)]))[2]
    assert float(state.force[0]) == pytest.approx(0.7 * STRENGTH, rel=1e-4)
    little = march(ONE, [effect], *spread_out([(1.0, -1e-8, 7)]), state=state)[2].memory[0]
    assert float(little[0] / state.memory[0][0]) == pytest.approx(np.exp(-1 / 3), rel=1e-9)
    long = march(ONE, [effect], *spread_out([(1.0, -3e-7, 7)]), state=state)[2].memory[0]
    assert float(long[0] / state.memory[0][0]) < 1e-4


def test_flash_temperature_follows_the_power():
    effect = FlashHeating(softening=8.0, time=0.01)
    v = 4e-3
    power = STRENGTH * v
    for n in (10, 400):
        force = total(march(ONE, [effect], *spread_out([(0.02, v, n)]))[0])
        assert force[-1] == pytest.approx(STRENGTH * np.exp(-8.0 * power * (1 - np.exp(-2.0))), rel=1e-12)


@pytest.mark.parametrize(
    ("course", "grown"), [("linear", 3.0), ("logarithmic", np.log(4.0)), ("saturating", 1 - np.exp(-3.0))]
)
def test_wear_follows_the_path_not_the_displacement(course, grown):
    back_and_forth = spread_out([(1.0, 1e-3, 7), (1.0, -1e-3, 7), (1.0, 1e-3, 7)])
    friction = Wear(drift=-0.1, path=1e-3, course=course)
    force = total(march(ONE, [friction], *back_and_forth)[0])[-1]
    assert force == pytest.approx(STRENGTH * (1 - 0.1 * grown), rel=1e-12)
    thresholds = Wear(drift=-0.1, path=1e-3, course=course, changes="thresholds")
    state = march(ONE, [thresholds], *back_and_forth)[2]
    assert float(state.force[0]) == pytest.approx(STRENGTH, rel=1e-12)
    back = march(ONE, [thresholds], 1e-6, [-1e-2], state=state)[2]  # 10 nm
    assert float(state.force[0] - back.force[0]) == pytest.approx(1e-8 * 1e6 / (1 - 0.1 * grown), rel=1e-4)


def test_friction_that_depends_on_position_is_the_same_on_the_way_back():
    wave = PositionDependentFriction(depth=0.1, wavelength=1e-3, phase=0.3)
    x = np.linspace(0, 2.5e-3, 101)[1:]
    out, _, state = march(ONE, [wave], np.full(100, 1.0), 2.5e-5)
    np.testing.assert_allclose(total(out), STRENGTH * (1 + 0.1 * np.sin(2 * np.pi * x / 1e-3 + 0.3)), rtol=1e-9)
    home = march(ONE, [wave], np.full(100, 1.0), -2.5e-5, state=state, x0=2.5e-3)[0]
    np.testing.assert_allclose(total(home)[:-1], -total(out)[-2::-1], rtol=1e-9)
    trend = PositionDependentFriction(depth=0.1, wavelength=1e-3, form="trend")
    assert total(march(ONE, [trend], 1.0, [2e-3])[0])[-1] == pytest.approx(STRENGTH * np.exp(0.2), rel=1e-12)


# --- the contact: flow, residual load, renewal -----------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 50])
def test_viscoelastic_relaxation_is_exponential(steps):
    effect = ViscoelasticContact(share=0.3, time=0.5)
    loaded = march(ONE, [effect], 1e-9, [100.0])[2]  # 0.1 um at once
    for t in (0.1, 0.5, 3.0):
        force = total(march(ONE, [effect], np.full(steps, t / steps), 0.0, state=loaded)[0])[-1]
        assert force == pytest.approx(0.1 * (0.7 + 0.3 * np.exp(-t / 0.5)), rel=1e-7)


@pytest.mark.parametrize("sliding", ["kept", "renewed"])
def test_viscoelastic_load_after_a_slow_slide(sliding):
    """While an element slides for 20 relaxation times its branch relaxes away, unless its contacts are replaced."""
    effect = ViscoelasticContact(share=0.3, time=0.1, sliding=sliding, renewal_distance=1e-8)
    slid = march(ONE, [effect], *spread_out([(2.0, 1e-5, 400)]))[2]
    assert float(slid.force[0]) == pytest.approx(STRENGTH, rel=1e-12)
    held = march(ONE, [effect], 10.0, [0.0], state=slid)[2]
    left = 1.0 if sliding == "kept" else 0.7
    assert float(held.force[0]) == pytest.approx(STRENGTH * left, rel=1e-2 if sliding == "renewed" else 1e-6)


def test_viscoelastic_element_with_a_slider_against_a_fine_explicit_integration():
    """Maxwell branch, spring and slider under a cycle that slides both ways; the reference takes 2e5 Euler steps."""
    g, tau, k, cap = 0.4, 0.3, 1e6, STRENGTH
    effect = ViscoelasticContact(share=g, time=tau, sliding="kept")
    n, fine = 400, 500
    t = np.linspace(0, 2.0, n * fine + 1)
    u = 5e-7 * np.sin(2 * np.pi * t) + 1e-7 * np.sin(7 * t)
    e = b = 0.0
    reference = np.empty(t.size)
    reference[0] = 0.0
    for i, (dt, du) in enumerate(zip(np.diff(t), np.diff(u), strict=True)):
        b_trial = b * (1 - dt / tau) + g * k * du
        f = (1 - g) * k * (e + du) + b_trial
        slip = np.sign(f) * max(abs(f) - cap, 0.0) / k
        e, b = e + du - slip, b_trial - g * k * slip
        reference[i + 1] = (1 - g) * k * e + b
    coarse = u[::fine]
    force = total(march(ONE, [effect], np.full(n, 2.0 / n), np.diff(coarse) / (2.0 / n))[0])
    np.testing.assert_allclose(force, reference[fine::fine], atol=5e-3 * cap)


def eyring(v1, alpha, parts, f=0.0, k=1e6, cap=STRENGTH):
    """Force (N) at the end of (duration, velocity) parts, from Eyring's equation by scipy."""
    for duration, v in parts:

        def rate(t, f, v=v):
            over = (np.exp((f / cap - 1) / alpha) - np.exp((-f / cap - 1) / alpha)) * v1
            return k * (v - over)

        f = solve_ivp(rate, (0, duration), [f], method="LSODA", rtol=1e-11, atol=1e-15).y[0, -1]
    return f


@pytest.mark.parametrize("alpha", [0.01, 0.03, 0.1])
def test_eyring_relaxation_in_one_step_is_exact(alpha):
    effect = ThermalCreep(velocity=1e-8, activation=alpha)
    loaded = march(ONE, [ThermalCreep(velocity=0.0, activation=alpha)], 1e-9, [240.0])[2]
    for steps in (1, 30):
        force = total(march(ONE, [effect], np.full(steps, 1e3 / steps), 0.0, state=loaded)[0])[-1]
        start = float(loaded.force[0])
        expected = eyring(1e-8, alpha, [(1e3, 0.0)], start)
        assert force == pytest.approx(expected, rel=1e-8)
        assert force < 0.995 * start


def test_eyring_creep_is_logarithmic_in_time():
    effect = ThermalCreep(velocity=1e-7, activation=0.03)
    loaded = march(ONE, [ThermalCreep(velocity=0.0)], 1e-9, [255.0])[2]
    force = [total(march(ONE, [effect], t, [0.0], state=loaded)[0])[-1] for t in (10.0, 100.0, 1000.0)]
    assert -np.diff(force) == pytest.approx(0.03 * STRENGTH * np.log(10.0), rel=0.02)


def test_eyring_creep_under_a_drive():
    """Loading at constant velocity, in steps that each raise f/(alpha c) by 1.3, ends where scipy does."""
    effect = ThermalCreep(velocity=1e-7, activation=0.03)
    parts = [(20.0, 2e-8), (5.0, -4e-9)]
    force = total(march(ONE, [effect], *spread_out([(20.0, 2e-8, 40), (5.0, -4e-9, 10)]))[0])
    assert force[39] == pytest.approx(eyring(1e-7, 0.03, parts[:1]), rel=1e-3)
    assert force[-1] == pytest.approx(eyring(1e-7, 0.03, parts), rel=1e-3)
    assert force[39] < 0.97 * STRENGTH  # the drive does not bring it to its cap


def test_residual_load_keeps_its_share_after_a_slip_only():
    effect = ResidualLoad(lost=0.6, slip_length=1e-6, settling_time=1e-3)
    for n in (20, 400):
        fast = march(BANK, [effect], *spread_out([(1e-3, 1.0, n)]))[2]
        assert float(fast.force.sum()) == pytest.approx(STRENGTH, rel=1e-12)  # nothing is shed in motion
        kept = march(BANK, [effect], *spread_out([(0.05, 0.0, n)]), state=fast)[2]
        np.testing.assert_allclose(kept.force / fast.force, 0.4, rtol=2e-3)
    creep, plain = (
        float(march(BANK, [law], *spread_out([(5.0, 1e-7, 50), (1.0, 0.0, 5)]))[2].force.sum())
        for law in (effect, ResidualLoad(lost=0.0))
    )
    assert plain > 0.8 * STRENGTH  # most of it slides, and sheds nothing while the rest sticks
    assert creep == pytest.approx(plain, rel=1e-3)


def renewed_steadily(ratio, step):
    """Forces (in caps) at the end of long sliding; yield displacement over the mean life, and step over the former."""
    reach = float(ONE.threshold[0])
    n = round(30 * max(1, 1 / ratio) / step)
    forces = march(ONE, [ContactRenewal(rate=ratio / reach)], 1e-3, np.full(n, step * reach / 1e-3))[0]
    return total(forces)[-round(1 + 1 / step) :] / STRENGTH


@pytest.mark.parametrize("ratio", [0.02, 0.2, 1.0, 3.0])
def test_renewal_steady_force(ratio):
    """The cap times (l/u_y)(1 - exp(-u_y/l)), whatever the step, wherever the block is."""
    for step in (0.02, 0.5, 2.0):  # in units of the threshold
        assert renewed_steadily(ratio, step) == pytest.approx(-np.expm1(-ratio) / ratio, rel=1e-6)


def test_renewal_converges_with_the_places_of_birth(monkeypatch):
    """Third order: the distance between two places, cubed."""
    errors = []
    for nodes in (6, 12, 24):
        monkeypatch.setattr(contact_renewal, "NODES", nodes)
        jax.clear_caches()
        errors.append(np.abs(renewed_steadily(1.0, 0.013) + np.expm1(-1.0)).max())
    jax.clear_caches()
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(3.0, abs=0.2)


REBOUND = [(1.0, -0.2, 20), (1.0, 3.0, 150)]
RINGING = [(1.0, s * 0.3, 20) for s in (-1.0, 1.0) * 15] + [(1.0, 3.0, 150)]


@pytest.mark.slow
@pytest.mark.parametrize(("back", "life", "number"), [(REBOUND, 2.0, 200_000), (RINGING, 30.0, 500_000)])
def test_renewal_against_many_junctions(back, life, number):
    """Virgin peak, loss of coherence, then a rebound, or ringing on whose way a fourth of all are replaced, and return.

    The reference has junctions with random lives, each a slider of its own.
    """
    reach, k = float(ONE.threshold[0]), 1e6
    life = life * reach
    rng = np.random.default_rng(3)
    parts = [(t, v * reach, n) for t, v, n in [(1.0, 4.0, 200), *back]]
    dt, v = spread_out(parts)
    force = total(march(ONE, [ContactRenewal(rate=1 / life)], dt, v)[0])
    f = np.zeros(number)
    mean = []
    for dx in dt * v:
        f = np.clip(f + k * dx, -STRENGTH, STRENGTH)
        dies = np.flatnonzero(rng.random(f.size) < -np.expm1(-abs(dx) / life))
        f[dies] = k * dx * rng.random(dies.size)
        mean.append(f.mean())
    chance = 4.0 * 0.5 / np.sqrt(number)  # of the reference's mean, whose junctions differ by half a cap at most
    assert np.max(np.abs(force - mean)) < chance * STRENGTH
    plain = total(march(ONE, [ContactRenewal(rate=0.0)], dt, v)[0])
    assert np.max(np.abs(plain - mean)) > 40 * chance * STRENGTH


# --- forces on the block ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("q", [0.5, 1.0, 2.0])
def test_drag_is_a_power_of_the_speed(q):
    effect = ViscousDrag(drag=3e-3, exponent=q)
    body = march(ONE, [effect], 1e-3, [1e-3, 4e-3, -4e-3, 0.0])[1]
    assert body[0] == pytest.approx(-3e-3, rel=1e-6)
    assert body[1] == pytest.approx(-3e-3 * 4**q, rel=1e-6)
    assert body[2] == pytest.approx(-body[1], rel=1e-12)
    assert body[3] == 0.0


@pytest.mark.slow
def test_contact_damping_of_a_stuck_block_is_exponential():
    """Free ringing far below every threshold decays at eta k/(2 m)."""
    stiff = bank_of([5e5, 5e5], [1.0, 1.0])
    eta, m, k = 2e-6, 0.0894, 1e6
    model = still_model(stiff, ContactDamping(time=eta))
    start = 1e-5  # m/s, 3 nm
    trajectory, _ = integrate(model, 0.04, state=model.rest(v=start), tolerance=Tolerance(3e-3, 1e-13, 1e-9))
    s = trajectory.steps
    energy = 0.5 * m * s.v**2 + 0.5 * (k + 1000.0) * s.x**2
    for t in (0.02, 0.04):
        left = np.interp(t, s.t, np.log(energy / energy[0]))
        assert left == pytest.approx(-eta * k / m * t, rel=0.02)


def test_contact_damping_is_that_of_contacts_that_stick():
    effect = ContactDamping(time=1e-5)
    force, body, _ = march(ONE, [effect], 1e-6, np.full(400, 1e-3))
    sticks = force[:, 0] < (1.0 - 1e-9) * STRENGTH
    assert 0.2 < sticks.mean() < 0.8
    np.testing.assert_allclose(body, np.where(sticks, -1e-5 * 1e-3 * 1e6, 0.0), atol=1e-15)


# --- geometry: what the bank becomes ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "effect",
    [
        Plasticity(hardness_ratio=2.0, sharpness=4.0),
        UnequalContacts(spread=0.3),
        Curvature(share=0.5),
        RollOff(share=0.5),
    ],
)
def test_shape_is_changed_and_total_strength_kept(effect):
    shaped = effect.reshape(BANK)
    assert float(shaped.total_strength) == pytest.approx(STRENGTH, rel=1e-12)
    u = jnp.linspace(0, 2e-6, 50)
    assert float(jnp.max(jnp.abs(shaped.backbone(u) - BANK.backbone(u)))) > 0.02 * STRENGTH


def test_full_curvature_is_cattaneo_and_mindlin():
    shaped = Curvature(share=1.0).reshape(BANK)
    end = 1.5 * STRENGTH / float(BANK.total_stiffness)
    u = jnp.linspace(0, 1.2 * end, 60)
    expected = power_law_backbone(u, end, STRENGTH, 1.5)
    np.testing.assert_allclose(shaped.backbone(u), expected, atol=3e-3 * STRENGTH)


def test_full_roll_off_is_exponential():
    shaped = RollOff(share=1.0).reshape(BANK)
    length = STRENGTH / float(BANK.total_stiffness)
    u = jnp.linspace(0, 6 * length, 60)
    np.testing.assert_allclose(shaped.backbone(u), STRENGTH * -np.expm1(-u / length), atol=3e-3 * STRENGTH)


def test_hardness_limits_the_deepest():
    """A sharp limit at a third of the deepest load: thresholds up to it keep their ratios, those beyond are equal."""
    shaped = Plasticity(hardness_ratio=3.0, sharpness=8.0).reshape(BANK)
    share = BANK.threshold / BANK.threshold.max()
    raised = shaped.threshold / BANK.threshold
    low, high = share < 0.15, share > 0.6
    assert float(jnp.ptp(raised[low]) / raised[0]) < 1e-3
    assert float(jnp.ptp(shaped.threshold[high]) / shaped.threshold[-1]) < 2e-3
    assert float(shaped.threshold[-1] / raised[0]) == pytest.approx(float(BANK.threshold.max()) / 3, rel=1e-3)


def test_adhesion_loads_every_length_equally():
    shaped = Adhesion(attraction=0.1).reshape(BANK)
    assert float(shaped.total_strength) == pytest.approx(1.1 * STRENGTH, rel=1e-12)
    raised = shaped.threshold - BANK.threshold
    np.testing.assert_allclose(raised, raised[0], rtol=1e-9)


def test_unequal_contacts_are_a_mixture():
    fine = power_law_bank(STRENGTH, 0.95e-6, 3.6, n=256)
    shaped = UnequalContacts(spread=0.4).reshape(fine)
    mixed, _ = mixture(lambda u: power_law_backbone(u, 0.95e-6, STRENGTH, 3.6), 0.4, 4)
    u = jnp.linspace(0, 2e-6, 80)
    np.testing.assert_allclose(shaped.backbone(u), mixed(u), atol=6e-3 * STRENGTH)
