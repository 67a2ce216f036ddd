"""The time integration of the independent simulator against conservation laws and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.blind.generator import Bank, Drive, Result, Rig, Surface, make_bank, simulate
from stickslip.blind.generator import array_layout as S
from stickslip.blind.generator.bank import join
from stickslip.blind.generator.contacts import fresh_lines
from stickslip.errors import InputError, SolveError

LOADS = np.full(4, 0.31)
FAST = Drive.constant(4e-4)


@pytest.fixture(scope="module")
def bank() -> Bank:
    return make_bank(Surface(points=4096), LOADS, 1, groups=64)


def effect(**slots: float) -> np.ndarray:
    out = np.zeros(S.EFFECT_SIZE)
    for name, value in slots.items():
        out[S.EFFECT_SLOTS[name]] = value
    return out


def four_slips(bank: Bank, dt: float, new_lines: bool = False) -> Result:
    """From a virgin contact, in equal steps."""
    return simulate(Rig(), FAST, bank, duration=1.2, dt=dt, quiet=False, rate=1e3, new_lines=new_lines)


def missing_work(r: Result) -> float:
    """Largest imbalance over the work of the drive."""
    return float(np.abs(r.imbalance).max() / r.drive_work[-1])


@pytest.mark.slow
@pytest.mark.parametrize(("groups", "new_lines"), [(64, False), (None, False), (None, True)])
def test_energy_balance_is_of_second_order_in_the_step(groups: int | None, new_lines: bool) -> None:
    """In groups and with every spring by itself (some 2000), and where each slip gets new lines."""
    bank = make_bank(Surface(points=4096), LOADS, 1, groups=groups, pool=6 if new_lines else 1)
    error = {}
    for dt in (4e-5, 2e-5, 1e-5):
        r = four_slips(bank, dt, new_lines)
        assert r.event_columns["onset"].size == 4
        error[dt] = missing_work(r)
        assert np.diff(r.dissipated).min() > -1e-12 * r.dissipated[-1]
    assert error[1e-5] < 1e-8
    assert error[4e-5] / error[2e-5] == pytest.approx(4, rel=0.1)
    assert error[2e-5] / error[1e-5] == pytest.approx(4, rel=0.1)


def test_dissipation_of_steady_sliding_is_friction_times_path(bank: Bank) -> None:
    r = simulate(Rig(mu_k=0.21), FAST, bank, duration=2.0, dt=2e-5, quiet=False, rate=1e3)
    late = r.time > 1.5
    assert np.polyfit(r.displacement[late], r.dissipated[late], 1)[0] == pytest.approx(0.21 * 1.24, rel=1e-9)
    assert r.spring_force[-1] == pytest.approx(0.21 * 1.24 + 10.0 * 4e-4, rel=1e-9)


def test_events_converge_with_the_step(bank: Bank) -> None:
    onsets = {dt: simulate(Rig(), FAST, bank, duration=1.2, dt=dt, quiet=False).event_columns["onset"]
              for dt in (2.5e-6, 1e-5, 2e-5, 8e-5)}  # fmt: skip
    error = {dt: np.abs(onset - onsets[2.5e-6]).max() for dt, onset in onsets.items()}
    assert error[2e-5] < 3e-6
    assert error[1e-5] < error[8e-5] / 4


def test_implicit_steps_agree_with_small_ones() -> None:
    bank = make_bank(Surface(points=4096), LOADS, 6, groups=64)
    drive = Drive.pieces([(1.6, 2e-4), (2.6, 0.0), (4.0, 2e-4)])
    small, mixed = (simulate(Rig(), drive, bank, duration=4.0, dt=2e-5, quiet=quiet) for quiet in (False, True))
    assert small.quiet_steps == 0
    assert mixed.steps < 0.5 * small.steps
    a, b = small.event_columns["onset"], mixed.event_columns["onset"]
    assert a.size == b.size >= 4
    assert np.abs(a - b).max() < 1e-4
    assert np.abs(np.diff(a) - np.diff(b)).max() < 4e-5
    hold = (small.time > 1.65) & (small.time < 2.6)
    assert np.abs(small.displacement - mixed.displacement)[hold].max() < 5e-9
    assert np.abs(mixed.imbalance).max() < 1e-6 * mixed.drive_work[-1]


def test_slip_event_of_a_block_on_a_spring(bank: Bank) -> None:
    """Slip dF (1 + e^(-pi zeta)) / c_s less what weakening costs, duration pi sqrt(m/c_s), peak dF / sqrt(m c_s)."""
    rig = Rig(damping=0.5)
    drop, root = (rig.mu_s - rig.mu_k) * 1.24, np.sqrt(rig.mass * rig.spring_stiffness)
    zeta = rig.damping / (2 * root)
    r = simulate(rig, Drive.constant(5e-5), bank, duration=8.3, dt=2e-5)
    e = {key: column[1:] for key, column in r.event_columns.items()}
    assert e["onset"].size == 2
    size = e["arrest_position"] - e["onset_position"]
    expected = drop * (1 + np.exp(-np.pi * zeta)) / rig.spring_stiffness - 2 * rig.slip_length
    assert size == pytest.approx(expected, rel=0.05)
    assert e["arrest"] - e["onset"] == pytest.approx(np.pi * np.sqrt(rig.mass / rig.spring_stiffness), rel=0.05)
    assert e["peak_velocity"] == pytest.approx(drop / root * np.exp(-np.pi * zeta / 2), rel=0.1)
    assert np.diff(e["onset"]) == pytest.approx(size[0] / 5e-5, rel=0.02)
    settled = r.contact_force[np.searchsorted(r.time, e["arrest"][0] + 0.3)]
    assert settled == pytest.approx(2 * rig.mu_k * 1.24 - rig.capacity + 0.3 * 5e-5 * 1e3, rel=0.1)


def test_ring_down_has_the_frequency_of_the_virgin_contact(bank: Bank) -> None:
    rig = Rig(damping=1.0)
    r = simulate(rig, FAST, bank, duration=0.95, dt=1e-5, rate=4e4)
    first = np.searchsorted(r.time, r.event_columns["arrest"][0]) + 400
    v = r.velocity[first : first + 1600]
    crossings = np.flatnonzero(np.diff(np.sign(v - np.convolve(v, np.ones(400) / 400, "same"))))[4:-8]
    frequency = (crossings.size - 1) / 2 / ((crossings[-1] - crossings[0]) / 4e4)
    expected = np.sqrt((bank.stiffness[0].sum() + rig.spring_stiffness) / rig.mass) / (2 * np.pi)
    assert frequency == pytest.approx(expected, rel=0.02)


def test_constant_friction_does_not_slip(bank: Bank) -> None:
    r = simulate(Rig(mu_k=0.21, damping=1.0), FAST, bank, duration=3.0, dt=2e-5)
    assert r.event_columns["onset"].size == 0
    assert r.velocity[-1] == pytest.approx(4e-4, rel=1e-5)


@pytest.mark.parametrize("quiet", [False, True])
def test_slow_loading_follows_the_static_curve(bank: Bank, quiet: bool) -> None:
    """t = (F_t(u)/c_s + u)/v0 while u < u_max/2, with constant friction."""
    rig = Rig(mu_k=0.21)
    r = simulate(rig, Drive.constant(5e-5), bank, duration=5.0, dt=2e-5, quiet=quiet, rate=100.0)
    pull = bank.stiffness[0] * r.displacement[:, None]
    static = np.minimum(pull, rig.mu_s * bank.normal[0]).sum(axis=1)
    part = (r.displacement < 0.4e-6) & (r.time > 0.2)  # starting from rest it rings a little first
    assert part.sum() > 300
    force = rig.spring_stiffness * (5e-5 * r.time - r.displacement)
    assert np.abs(force - static)[part].max() < 1e-5 * rig.capacity


def test_every_spring_gives_the_events_of_the_groups() -> None:
    surface = Surface(points=2048)
    onsets = [
        simulate(Rig(), FAST, make_bank(surface, LOADS, 1, groups=g), duration=1.2, dt=2e-5, quiet=False).event_columns
        for g in (None, 128)
    ]
    assert onsets[0]["onset"].size == 4
    assert np.abs(onsets[0]["onset"] - onsets[1]["onset"]).max() < 5e-6
    size = [e["arrest_position"] - e["onset_position"] for e in onsets]
    assert size[0] == pytest.approx(size[1], rel=1e-4)


def test_new_lines_keep_force_and_share_of_the_cap() -> None:
    surface = Surface(points=2048)
    bank = make_bank(surface, np.array([0.25, 0.3, 0.33, 0.36]), 5, pool=2, groups=None)
    rng = np.random.default_rng(1)
    f = np.zeros((4, bank.normal.shape[1]))
    f[0] = 0.21 * bank.normal[0] * rng.uniform(0.2, 1.0, bank.normal.shape[1])
    moved = fresh_lines(f, bank.normal[0], bank.normal[1], bank.count[0], bank.count[1], bank.start)
    for j in range(4):
        part = slice(bank.start[j], bank.start[j + 1])
        assert moved[0, part].sum() == pytest.approx(f[0, part].sum(), rel=1e-12)
    full = f.copy()
    full[0] = 0.21 * bank.normal[0]
    moved = fresh_lines(full, bank.normal[0], bank.normal[1], bank.count[0], bank.count[1], bank.start)
    assert np.allclose(moved[0], 0.21 * bank.normal[1], rtol=1e-12, atol=0)


def test_new_lines_scatter_events_and_keep_the_force_continuous() -> None:
    bank = make_bank(Surface(points=4096), LOADS, 1, pool=6, groups=64)
    same, new = (
        simulate(Rig(), FAST, bank, duration=1.6, dt=2e-5, rate=5e4, quiet=False, new_lines=flag)
        for flag in (False, True)
    )
    sizes = [(r.event_columns["arrest_position"] - r.event_columns["onset_position"])[1:] for r in (same, new)]
    assert sizes[0].size >= 4
    assert np.ptp(sizes[0]) < 1e-3 * sizes[0].mean() < np.ptp(sizes[1]) < 0.05 * sizes[0].mean()
    step = np.abs(np.diff(new.contact_force))
    for arrest in new.event_columns["arrest"]:
        near = np.abs(new.time[1:] - arrest) < 2e-3
        at = np.abs(new.time[1:] - arrest) < 5e-5
        assert step[near & at].max() <= step[near].max()
        assert step[at].max() < 1e-3 * Rig().capacity


def test_stop_ends_after_the_wanted_events(bank: Bank) -> None:
    full = simulate(Rig(), FAST, bank, duration=2.0, dt=2e-5)
    cut = simulate(Rig(), FAST, bank, duration=2.0, dt=2e-5, stop=(3, 0.5))
    arrest = full.event_columns["arrest"]
    assert cut.event_columns["onset"].size == 3
    assert cut.time[-1] == pytest.approx(arrest[2] + 0.5 * (arrest[2] - arrest[1]), abs=1e-3)
    assert np.array_equal(cut.displacement, full.displacement[: cut.time.size])


def test_added_relaxation_of_a_single_spring_is_exponential() -> None:
    """One spring with a relaxing branch under a fixed load point: the force settles with its time to (1 - g)."""
    bank = join([[(np.array([1e3]), np.array([1e6]))] * 2])
    rig = Rig(loads=(1e3, 1e3), damping=200.0)
    drive = Drive.pieces([(0.05, 1e-3), (2.0, 0.0)])
    stiff = replace(rig, spring_stiffness=1e9)
    r = simulate(
        stiff, drive, bank, effect(VISCO_G=0.2), duration=1.0, dt=2e-6, rate=1e3, relaxation=(0.1, 0.0), quiet=False
    )
    expected = 0.8 + 0.2 * 0.1 * (1 - np.exp(-0.5)) / 0.05 * np.exp(-(r.time - 0.05) / 0.1)
    late = r.time > 0.06
    assert r.contact_force[late] == pytest.approx(expected[late] * 2e6 * 5e-5, rel=5e-3)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_rate_and_state_reaches_its_steady_friction(bank: Bank, form: float) -> None:
    """mu = mu_s [1 + (a - b) ln(1 + v/v*)] for both laws, and the direct jump of a velocity step."""
    b, ratio, v_star = 0.005, 2.0, 1e-6
    drive = Drive.pieces([(1.2, 4e-4), (1.8, 8e-4)])
    r = simulate(
        Rig(mu_k=0.21), drive, bank, effect(RS_B=b, RS_RATIO=ratio, RS_V=v_star, RS_D=4e-6, RS_FORM=form),
        duration=1.8, dt=2e-5, rate=1e4, quiet=False,
    )  # fmt: skip
    for until, v in ((1.2, 4e-4), (1.8, 8e-4)):
        at = np.searchsorted(r.time, until) - 2
        assert r.velocity[at] == pytest.approx(v, rel=1e-3)
        assert r.contact_force[at] / Rig().capacity == pytest.approx(
            1 + b * (ratio - 1) * np.log1p(v / v_star), rel=1e-4
        )


@pytest.mark.parametrize(("form", "law"), [(0.0, np.log1p), (1.0, lambda r: np.arcsinh(r / 2))])
def test_direct_effect_in_steady_sliding(bank: Bank, form: float, law) -> None:
    r = simulate(
        Rig(mu_k=0.21),
        FAST,
        bank,
        effect(DIRECT_A=0.01, DIRECT_V=1e-8, DIRECT_FORM=form),
        duration=1.5,
        dt=2e-5,
        quiet=False,
    )
    assert r.contact_force[-1] / Rig().capacity == pytest.approx(1 + 0.01 * law(4e-4 / 1e-8), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "x", "share"),
    [(0.0, x, -np.expm1(-x) / x) for x in (0.2, 1.0, 3.0)] + [(1.0, x, 1.0 - x / 2) for x in (0.2, 0.5, 0.9)],
)
def test_junctions_that_die_keep_the_closed_form_share_of_friction(form: float, x: float, share: float) -> None:
    """Equal springs in steady sliding, renewed x times on the way to their cap: mean of min(u/u_y, 1) over the ways u
    since renewal, which are exponential where death is a Poisson process and uniform where lives are fixed."""
    n, mu, reach = 400, 0.21, 1e-6
    bank = join([[(np.full(n, 0.31 / n), np.full(n, mu * 0.31 / n / reach)) for _ in LOADS]])
    rig = Rig(mu_k=mu, damping=50.0)
    dying = effect(RENEW_RATE=x / reach, RENEW_FORM=form)
    r = simulate(rig, FAST, bank, dying, duration=1.6, dt=1e-5, quiet=False, rate=1e3)
    late = r.time > 0.9
    assert r.contact_force[late].mean() / rig.capacity == pytest.approx(share, rel=0.012)


def test_ageing_raises_the_breakaway_with_the_logarithm_of_rest(bank: Bank) -> None:
    forces = [
        simulate(
            Rig(),
            FAST,
            bank,
            effect(AGE_B=0.01, AGE_T0=1e-3, AGE_D=1e-6, AGE_START=age),
            duration=1.2,
            dt=2e-5,
            stop=(1, 0.1),
        ).event_columns["onset_force"][0]
        for age in (10.0, 100.0, 1000.0)
    ]
    gain = 0.01 * np.log(10) * Rig().capacity
    assert np.diff(forces) == pytest.approx(gain, rel=0.15)


def test_large_step_is_refused(bank: Bank) -> None:
    with pytest.raises(SolveError, match="smaller"):
        simulate(
            Rig(), Drive.constant(1.0), bank, effect(EDDY_C=-1e4, EDDY_LENGTH=1e-4), duration=1.0, dt=1e-3, quiet=False
        )


def test_drive_must_go_forward_in_time() -> None:
    with pytest.raises(InputError, match="rising times"):
        Drive((0.0, 1.0, 1.0), (0.0, 1.0, 2.0))
