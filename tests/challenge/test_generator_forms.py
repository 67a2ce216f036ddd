"""Every hidden effect: nothing at zero, something at its size, passive where it must be, and its own signature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from stickslip.blind.generator import (
    CATALOGUED,
    EFFECTS,
    OUTSIDE,
    Drive,
    Result,
    Setup,
    Surface,
    hide,
    make_bank,
    simulate,
)
from stickslip.blind.generator.forms import find
from stickslip.blind.generator.sensor import SILENT, counts, spot
from stickslip.errors import InputError

TAGS = """inertia velocity-weakening slip-weakening contact-ageing rate-and-state direct-effect thermal-creep
viscoelastic-contact contact-damping viscous-drag plasticity adhesion residual-load contact-renewal unequal-contacts
curvature roll-off load-modulation tilt position-dependent-friction wear flash-heating drive-ripple machine-compliance
nonlinear-spring base-vibration sensor-drift sensor-high-pass sensor-low-pass sensor-gain"""
FORMS = [(effect.tag, form.name) for effect in EFFECTS.values() for form in effect.forms]
PASSIVE = {
    "velocity-weakening", "slip-weakening", "contact-ageing", "rate-and-state", "direct-effect", "thermal-creep",
    "viscoelastic-contact", "contact-damping", "contact-renewal", "wear", "flash-heating", "tilt",
    "position-dependent-friction", "load-modulation", "machine-compliance",
}  # fmt: skip


def make(
    effects: list[tuple[str, float, str]], *, duration: float = 1.0, velocity: float = 4e-4, hold: float | None = None,
    quiet: bool = True, rate: float = 1e4, groups: int = 48,
) -> tuple[Setup, Result, np.ndarray]:  # fmt: skip
    setup = Setup(surface=Surface(points=2048), sensor=SILENT)
    for tag, amplitude, form in effects:
        hide(setup, tag, amplitude, np.random.default_rng(7), form)
    bank = make_bank(
        setup.surface, np.asarray(setup.rig.loads), 2, groups=groups, roughness_spread=setup.roughness_spread
    )
    pieces = [(duration, velocity)] if hold is None else [(hold, velocity), (duration, 0.0)]
    result = simulate(
        setup.rig, Drive.pieces(pieces), bank, setup.effects, duration=duration, dt=2e-5, rate=rate, quiet=quiet,
        relaxation=setup.relaxation, seed=3,
    )  # fmt: skip
    seen = spot(setup.sensor, result.displacement, result.contact_force, result.yaw)
    return setup, result, counts(setup.sensor, seen, rate, rate, np.random.default_rng(1))


@pytest.fixture(scope="module")
def base() -> tuple[Setup, Result, np.ndarray]:
    return make([])


def test_the_whole_catalogue_is_there_and_a_third_has_own_forms() -> None:
    assert set(TAGS.split()) == set(CATALOGUED)
    assert len(OUTSIDE) >= 5
    inside = [effect for effect in EFFECTS.values() if effect.inside]
    assert sum(form.own for effect in inside for form in effect.forms) >= sum(len(e.forms) for e in inside) / 3
    assert len({effect.tag for effect in inside if any(form.own for form in effect.forms)}) >= 20


@pytest.mark.slow
@pytest.mark.parametrize(("tag", "form"), FORMS)
def test_zero_amplitude_is_the_base_bit_for_bit(base: tuple, tag: str, form: str) -> None:
    _, result, read = make([(tag, 0.0, form)])
    for name, column in base[1].columns.items():
        assert np.array_equal(result.columns[name], column), name
    assert np.array_equal(read, base[2])


@pytest.mark.slow
@pytest.mark.parametrize(("tag", "form"), FORMS)
def test_plausible_amplitude_can_be_seen_and_still_slips(base: tuple, tag: str, form: str) -> None:
    effect = EFFECTS[tag]
    _, result, read = make([(tag, effect.sign * effect.high, form)])
    assert np.all(np.isfinite(result.displacement))
    assert result.event_columns["onset"].size >= 2
    difference = np.abs(read[: base[2].size] - base[2][: read.size])
    assert difference.max() >= (1 if effect.decoy else 3)


@pytest.mark.slow
@pytest.mark.parametrize(("tag", "form"), [pair for pair in FORMS if pair[0] in PASSIVE])
def test_contacts_never_give_energy(tag: str, form: str) -> None:
    effect = EFFECTS[tag]
    _, result, _ = make([(tag, effect.sign * effect.high, form)], quiet=False, rate=1e3)
    assert np.diff(result.dissipated).min() > -1e-8 * result.dissipated[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tag", "form"),
    [pair for pair in FORMS if pair[0] not in ("sensor-drift", "sensor-high-pass", "sensor-low-pass", "sensor-gain")],
)
def test_energy_balances_with_every_effect(tag: str, form: str) -> None:
    effect = EFFECTS[tag]
    _, result, _ = make([(tag, effect.sign * effect.high, form)], quiet=False, rate=1e3, duration=0.8)
    assert np.abs(result.imbalance).max() < 1e-5 * result.drive_work[-1]


def recurrence(result: Result) -> float:
    return float(np.median(np.diff(result.event_columns["onset"])))


def slip(result: Result) -> np.ndarray:
    return result.event_columns["arrest_position"] - result.event_columns["onset_position"]


def ring(result: Result) -> float:
    """Ring frequency after the first arrest, Hz."""
    first = np.searchsorted(result.time, result.event_columns["arrest"][0])
    v = result.velocity[first : first + 300]
    crossings = np.flatnonzero(np.diff(np.sign(v)) > 0)
    exact = crossings - v[crossings] / (v[crossings + 1] - v[crossings])
    return float((exact.size - 1) / (exact[-1] - exact[0]) * 1e4)


@pytest.mark.parametrize(
    ("tag", "amplitude", "form", "feature", "sign"),
    [
        ("contact-ageing", 0.01, "logarithm", lambda r: recurrence(r), 1),
        ("contact-ageing", 0.01, "power", lambda r: recurrence(r), 1),
        ("velocity-weakening", 0.1, "exponent 2", lambda r: slip(r).mean(), 1),
        ("direct-effect", 0.002, "asinh", lambda r: slip(r).mean(), -1),
        ("viscous-drag", 6.0, "sublinear", lambda r: r.event_columns["peak_velocity"].mean(), -1),
        ("wear", 0.02, "logarithm", lambda r: slip(r)[-1] - slip(r)[1], 1),
        ("machine-compliance", 4e-7, "fixture", ring, -1),
        ("inertia", 0.1, "mass of the spring", ring, -1),
        ("nonlinear-spring", 0.05, "cubic", lambda r: -r.event_columns["onset"][0], 1),
        ("tilt", 0.05, "lift", lambda r: r.event_columns["onset_force"].mean(), -1),
        ("adhesion", 0.05, "range", lambda r: r.event_columns["onset_force"].mean(), 1),
        ("slip-weakening", 0.1, "linear", lambda r: r.event_columns["onset_force"][0], -1),
        ("contact-renewal", 1e5, "Poisson", lambda r: r.event_columns["onset_force"][1:].mean(), -1),
        ("loosening-clamp", 0.1, "linear", lambda r: -r.event_columns["onset"][0], -1),
    ],
)
def test_signature(base: tuple, tag: str, amplitude: float, form: str, feature: Callable, sign: int) -> None:
    _, result, _ = make([(tag, amplitude, form)])
    before, after = feature(base[1]), feature(result)
    assert sign * (after - before) > 0.002 * abs(before)


def test_fixture_lowers_the_ring_frequency_by_its_share(base: tuple) -> None:
    """Springs k_t and k_m in series under the drive spring."""
    compliance = 4e-7
    _, result, _ = make([("machine-compliance", compliance, "fixture")])
    setup = base[0]
    k_t = make_bank(setup.surface, np.asarray(setup.rig.loads), 2, groups=48).stiffness[0].sum()
    expected = np.sqrt((1 / (1 / k_t + compliance) + 1e3) / (k_t + 1e3))
    assert ring(result) / ring(base[1]) == pytest.approx(expected, rel=0.01)


def test_thermal_creep_goes_on_during_a_hold() -> None:
    def held(effects: list) -> float:
        _, result, _ = make(effects, hold=0.55, duration=2.0)
        at = np.searchsorted(result.time, [0.8, 2.0 - 1e-3])
        return float(np.diff(result.displacement[at])[0])

    assert abs(held([])) < 1e-11
    for form in ("Eyring", "power"):
        assert held([("thermal-creep", 1e-7, form)]) > 3e-10


def test_stretched_relaxation_is_slower_than_one_exponential_at_late_times() -> None:
    moved = {}
    for form in ("renewed", "stretched"):
        _, result, _ = make([("viscoelastic-contact", 0.06, form)], hold=0.5, duration=3.0, rate=1e3)
        x = result.displacement[result.time > 0.52]
        moved[form] = (x - x[0]) / (x[-1] - x[0])
    early = 20
    assert moved["stretched"][early] > moved["renewed"][early]  # the short times of the spread come first
    half = [int(np.searchsorted(m, 0.5)) for m in moved.values()]
    late = [int(np.searchsorted(m, 0.9)) for m in moved.values()]
    assert late[1] / half[1] > 3.5 > late[0] / half[0]  # ln 10 / ln 2 = 3.3 for one exponential


def test_two_effects_together(base: tuple) -> None:
    _, both, _ = make([("contact-ageing", 0.01, "power"), ("drive-ripple", 1e-6, "two harmonics")])
    _, one, _ = make([("contact-ageing", 0.01, "power")])
    assert recurrence(both) != recurrence(one) != recurrence(base[1])
    z = both.load_point - 4e-4 * both.time
    assert 1e-6 < np.abs(z).max() < 4e-6


def test_truth_says_what_was_hidden() -> None:
    setup = Setup()
    truth = hide(setup, "contact-ageing", None, np.random.default_rng(0))
    assert truth["tag"] == "contact-ageing"
    assert EFFECTS["contact-ageing"].low <= truth["amplitude"] <= EFFECTS["contact-ageing"].high
    assert truth["detections"] == pytest.approx(truth["amplitude"] / 2e-4)
    assert truth["inner"]["AGE_B"] == truth["amplitude"]
    with pytest.raises(InputError, match="contact-ageing"):
        find("contact-aging")
    with pytest.raises(InputError, match="logarithm"):
        hide(setup, "contact-ageing", 0.01, np.random.default_rng(0), "logaritm")
