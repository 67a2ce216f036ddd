"""The scalar laws of the independent simulator against exact solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stickslip.blind.generator import Rig
from stickslip.blind.generator import array_layout as S
from stickslip.blind.generator.implicit import kick
from stickslip.blind.generator.laws import advance, decay, load_point, rate_factor, spring_force, wave
from stickslip.blind.generator.springs import Springs, clip, creep_rate, plain

V_STAR, LENGTH, RIG = 1e-6, 2e-6, Rig().vector()


def effect(**slots: float) -> np.ndarray:
    out = np.zeros(S.EFFECT_SIZE)
    for name, value in slots.items():
        out[S.EFFECT_SLOTS[name]] = value
    return out


def springs(k: np.ndarray, normal: np.ndarray, start: list[int], eff: np.ndarray | None = None) -> Springs:
    return Springs(k, normal, np.ones(k.size), np.array(start), False, effect() if eff is None else eff)


@pytest.mark.parametrize("speed", [0.0, 1e-9, 1e-6, 1e-3])
def test_age_follows_its_equation(speed: float) -> None:
    """theta' = 1 - v theta / L."""
    solved = solve_ivp(lambda t, y: 1 - speed * y / LENGTH, (0, 0.01), [0.3], rtol=1e-11, atol=1e-14, method="Radau").y[
        0, -1
    ]
    assert decay(0.3, speed, LENGTH, 0.01) == pytest.approx(solved, rel=1e-8)


@pytest.mark.parametrize(
    ("form", "law"),
    [
        (0.0, lambda phi, v: (1 - (v + V_STAR) * np.exp(phi) / V_STAR) * V_STAR / LENGTH / np.exp(phi)),
        (1.0, lambda phi, v: -(v + V_STAR) / LENGTH * (phi + np.log((v + V_STAR) / V_STAR))),
    ],
)
@pytest.mark.parametrize("v", [0.0, 1e-5])
def test_state_follows_the_ageing_and_the_slip_law(form: float, law, v: float) -> None:
    """phi = ln(theta v*/L) of theta' = 1 - V theta/L, or theta' = -(V theta/L) ln(V theta/L), with V = v + v*."""
    eff = effect(RS_B=0.01, RS_V=V_STAR, RS_D=LENGTH, RS_FORM=form)
    old = np.array([0.8, 0.0, -1.5, 0.0, 0.0, 0.0])
    new = old.copy()
    advance(old, new, v, 0.2, RIG, eff, 0.0)
    solved = solve_ivp(lambda t, y: law(y, v), (0, 0.2), [-1.5], rtol=1e-11, atol=1e-13, method="Radau").y[0, -1]
    assert new[S.LOG_STATE] == pytest.approx(solved, rel=1e-7)


def test_weakening_state_follows_its_equation() -> None:
    """dpsi/dt = (1 - psi)/t_h - v psi/D_c."""
    old = np.array([0.9, 0.0, 0.0, 0.0, 0.0, 0.0])
    new = old.copy()
    advance(old, new, -3e-4, 2e-3, RIG, effect(), 0.0)
    solved = solve_ivp(lambda t, y: (1 - y) / 1e-2 - 3e-4 * y / 1e-6, (0, 2e-3), [0.9], rtol=1e-11, atol=1e-14).y[0, -1]
    assert new[S.PSI] == pytest.approx(solved, rel=1e-8)
    assert new[S.PATH] == pytest.approx(6e-7)


@pytest.mark.parametrize("form", [0.0, 1.0, 2.0, 3.0])
def test_waves_have_unit_size_and_no_mean(form: float) -> None:
    values = np.array([wave(c, form) for c in np.linspace(0, 500, 100_001)])
    assert 0.9 < np.abs(values).max() <= 1.41
    assert abs(values.mean()) < 0.01


@pytest.mark.parametrize("q", [0.0, 0.5, 1.0, 2.0])
def test_stribeck_forms_fall_by_their_amplitude(q: float) -> None:
    eff, state = effect(STRIBECK_EPS=0.1, STRIBECK_V=1e-3, STRIBECK_Q=q), np.zeros(S.STATE_SIZE)
    assert rate_factor(0.0, state, eff) == 1.0
    assert rate_factor(1e3, state, eff) == pytest.approx(0.9, abs=1e-6)
    at = rate_factor(1e-3, state, eff)
    assert at == pytest.approx(1 - 0.1 * (0.5 if q == 0.0 else 1 - np.exp(-1)))


def test_creep_rates_meet_at_the_cap_with_one_slope() -> None:
    """Both forms give v1 at the cap and fall e-fold per alpha below it."""
    for form in (0.0, 1.0):
        eff = effect(CREEP_V=1e-8, CREEP_ALPHA=0.02, CREEP_FORM=form)
        assert creep_rate(1.0, eff) == pytest.approx(1e-8, rel=1e-9)
        assert creep_rate(-1.0, eff) == -creep_rate(1.0, eff)
        assert creep_rate(0.98, eff) == pytest.approx(1e-8 / np.e, rel=0.02)
        assert creep_rate(0.3, eff) == 0.0


def test_return_map_of_a_bank_with_odd_length() -> None:
    rng = np.random.default_rng(0)
    n = 23
    old, k, normal = rng.normal(0, 0.05, n), rng.uniform(0.5, 2, n), rng.uniform(0.1, 1, n)
    new = np.zeros(n)
    force, stuck = plain(old, new, springs(k, normal, [0, n]), 2, n, 0.1, 0.2, 0.15)
    trial = old + k * 0.1
    expected = np.clip(trial, -0.15 * normal, 0.2 * normal)
    assert np.array_equal(new[2:], expected[2:])
    assert not new[:2].any()
    assert force == pytest.approx(expected[2:].sum(), rel=1e-13)
    assert stuck == pytest.approx(k[2:][expected[2:] == trial[2:]].sum(), rel=1e-13)
    assert clip(-1.0, 1.0, 0.2, 0.15) == -0.15


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_kick_takes_the_rate_of_the_cap_it_slides_at(sign: float) -> None:
    """m (v+ - v-)/h = -sign mu f_n g(|v|) with v the mean of both."""
    eff, state = effect(DIRECT_A=0.05, DIRECT_V=1e-6, DIRECT_FORM=0.0), np.zeros(S.STATE_SIZE)
    normal, k = np.array([0.3, 0.4]), np.array([1e6, 1e6])
    f, g = np.zeros((4, 2)), np.zeros((4, 2))
    f[0] = sign * 0.2 * normal
    h, v_in = 1e-5, sign * 1e-3
    v, force, _, stuck = kick(
        f, g, springs(k, normal, [0, 1, 2], eff), 1.0, state, RIG,
        v_in * h * 100, 0.0, h, 0.2, 0.0, 0.0, 0.0, 0.0, v_in, v_in,
    )  # fmt: skip
    assert stuck == 0.0
    assert force == pytest.approx(sign * 0.2 * 0.7 * (1 + 0.05 * np.log1p(abs(v) / 1e-6)), rel=1e-9)
    assert 2 * Rig().mass * (v - v_in) / h == pytest.approx(-force, rel=1e-6)


def test_load_point_and_ripple() -> None:
    times, positions = np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 1e-4, 1e-4, 5e-4])
    at = [load_point(t, times, positions, effect()) for t in (0.5, 1.5, 3.0, 5.0)]
    assert at == pytest.approx([5e-5, 1e-4, 3e-4, 7e-4])
    eff = effect(RIPPLE_A=1e-6, RIPPLE_PITCH=2e-4, RIPPLE_PHASE=0.3, RIPPLE_FORM=0.0)
    assert load_point(0.0, times, positions, eff) == 0.0
    moved = load_point(0.7, times, positions, eff) - load_point(0.7, times, positions, effect())
    assert moved == pytest.approx(1e-6 * (np.sin(2 * np.pi * 0.65) - np.sin(2 * np.pi * 0.3)), rel=1e-9)
    held = [load_point(t, times, positions, eff) for t in (1.1, 1.9)]
    assert held[0] == held[1]  # locked to the position, not to time


def test_spring_forms() -> None:
    y = 2e-4
    assert spring_force(y, 0.0, 0.0, 0.0, 1e-5, RIG, effect())[0] == pytest.approx(0.2)
    square = spring_force(y, 0.0, 0.0, 0.0, 1e-5, RIG, effect(NLS_EPS=0.05, NLS_Y0=2.5e-4, NLS_FORM=1.0))[0]
    cubic = spring_force(y, 0.0, 0.0, 0.0, 1e-5, RIG, effect(NLS_EPS=0.05, NLS_Y0=2.5e-4, NLS_FORM=2.0))[0]
    assert square == pytest.approx(0.2 * (1 + 0.05 * 0.8))
    assert cubic == pytest.approx(0.2 * (1 + 0.05 * 0.64))
    loose = spring_force(y, 0.0, 0.0, 5.0, 1e-5, RIG, effect(LOOSE_EPS=0.1, LOOSE_TIME=10.0, LOOSE_FORM=0.0))[0]
    assert loose == pytest.approx(0.2 * 0.95)
    eff = effect(ANEL_G=0.1, ANEL_TAU=0.1)
    fast, branch = spring_force(y, 0.0, 0.0, 0.0, 1e-9, RIG, eff)
    assert fast == pytest.approx(0.2)
    slow, _ = spring_force(y, y, branch, 0.0, 10.0, RIG, eff)
    assert slow == pytest.approx(0.18)
