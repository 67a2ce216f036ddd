"""Make the figures of docs/verification.md and write its tables: ``python docs/make_verification.py [name ...]``.

One table is of docs/challenge.md: the energy balance of the generator.

Tables go to docs/results/verification.json, each with version, date and command; what they do not have is printed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import jax
import jax.numpy as jnp

from stickslip.blind.generator import Surface, make_bank
from stickslip.physics.contact import (
    RoughLines,
    equal_bodies,
    flat_punch,
    indentation,
    power_law,
    power_law_bank,
    reload_displacement,
    sphere,
    static_contact,
)
from stickslip.show.plots.style import logarithmic
from stickslip.simulation.solve import Tolerance, integrate
from tests.challenge import test_generator_dynamics as dynamics
from tests.contact import test_hysteresis, test_indentation, test_memory, test_tangential
from tests.effects import rate_and_state_errors
from tests.kept_results import keep_table
from tests.solve import (
    comparison,
    convergence,
    derivatives,
    energy_balance,
    ringing,
    slip_differences,
    slip_events,
    static_limit,
    test_events,
    test_rough_derivatives,
)
from tests.solve.rig import STRENGTH, order, rig, tighter

FOLDER = ROOT / "docs" / "verification"
MARKS = ("o-", "s--", "^:", "D-.")  # so that a grey print keeps lines apart
TOLERANCES = {"default": 1.0, "default/10": 10.0, "default/100": 100.0, "default/1000": 1000.0}
DRAW: dict[str, Callable[[], plt.Figure | None]] = {}


def figure(work: Callable[[], plt.Figure | None]) -> Callable[[], plt.Figure | None]:
    """A part of the page: a figure, a table or both."""
    DRAW[work.__name__] = work
    return work


def table(part: str, command: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Write a table of the page; its cells are text."""
    keep_table("verification", f"python docs/make_verification.py {command}", part, columns, rows)


def short(value: float, digits: int = 2) -> str:
    """A small number as 1.9e-5."""
    return f"{value:.{digits - 1}e}".replace("e-0", "e-")


def percent(share: float) -> str:
    return f"{100.0 * share:.{2 if share < 2e-3 else 1}f} %"


def axes(n: int, **options: float) -> tuple[plt.Figure, list[plt.Axes]]:
    fig, ax = plt.subplots(1, n, figsize=(4.6 * n, 3.6), layout="constrained", squeeze=False, **options)
    for a in ax[0]:
        a.grid(alpha=0.3)
    return fig, list(ax[0])


def tidy(fig: plt.Figure) -> None:
    """Numbers at 1, 2 and 5 where a logarithmic axis spans less than two decades; matplotlib's would overlap."""
    for a in fig.axes:
        for which, (low, high) in (("x", a.get_xlim()), ("y", a.get_ylim())):
            if getattr(a, f"get_{which}scale")() == "log" and low > 1e-2 and high < 100.0 * low:
                logarithmic(a, which)


@figure
def contact() -> plt.Figure:
    fig, (left, middle, right) = axes(3)
    w, few = np.linspace(0.0, 1.0, 300), np.linspace(0.0, 1.0, 21)
    length, load, friction = test_tangential.L, 0.31, test_tangential.MU
    analytic = {
        "flat punch": (flat_punch(length / 2, 100), 1.0),
        "sphere (Cattaneo, Mindlin)": (sphere(length, 20_000, 1e-3), 1.5),
        "cone": (power_law(length / 2, 20_000, 1.0, 0.1), 2.0),
        "|x|^0.3": (power_law(length / 2, 400_000, 0.3, 1e-6 / (length / 2) ** 0.3), 13.0 / 3.0),
    }
    for (name, (profile, p)), mark in zip(analytic.items(), MARKS, strict=True):
        made = static_contact(indentation(profile), load, friction)
        left.plot(w, 1.0 - (1.0 - w) ** p, "k", lw=0.8)
        left.plot(few, np.asarray(made.force(few * made.u_max) / made.strength), mark[0], ms=4, label=name)
    left.set(xlabel="u / u_max", ylabel="force / full friction", title="Springs; lines: closed forms")
    left.legend()
    hursts = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 0.9])
    exponents = {}
    for n, lines, mark in ((4096, 100, "o"), (65536, 40, "s")):
        exponents[n] = force, stiffness = np.array([test_indentation.exponents(H, n, lines) for H in hursts]).T
        middle.plot(hursts, force, mark + "-", label=f"force by depth, N = {n}")
        middle.plot(hursts, stiffness, mark + "--", label=f"stiffness by force, N = {n}")
    fine = np.linspace(0.15, 0.95, 100)
    middle.plot(fine, (fine + 1.0) / fine, "k-", lw=0.8, label="(H + 1)/H")
    middle.plot(fine, 1.0 / (fine + 1.0), "k--", lw=0.8, label="1/(H + 1)")
    middle.set(xlabel="H", ylabel="exponent", ylim=(0.0, 7.0), title="Rough lines")
    middle.legend()
    tau = np.linspace(0.0, 1.0, 101)
    for H, mark in zip((0.1, 0.5, 0.9), MARKS, strict=False):
        made = RoughLines(H, 2.86e-6, length).contact(load, friction)
        u = np.asarray(made.displacement(tau[:, None]).mean(axis=1) / made.u_max.mean())
        right.plot(u, tau, mark[1:], label=f"H = {H:g}")
    right.set(xlabel="u / u_max", ylabel="force / full friction", title="Mean of 100 lines, N = 4096")
    right.legend()
    table("contact", "contact", ["statement", "required", "obtained"], contact_rows(hursts, exponents))
    return fig


def contact_rows(
    hursts: np.ndarray, exponents: dict[int, tuple[np.ndarray, np.ndarray]]
) -> Iterable[tuple[str, str, str]]:
    """Statements on the contact: what is required, and what is obtained; exponents are by number of springs."""
    steel, at = equal_bodies(), {float(H): i for i, H in enumerate(hursts)}
    normal, tangential = float(steel.normal) / 1e9, float(steel.tangential) / 1e9
    numbers = f"{normal:.2f} GPa, {tangential:.2f} GPa, {normal / tangential:.5f}"
    yield "E\\*, G\\* and their ratio for steel on steel: 115.38 GPa, 95.02 GPa, 1.21429", "1e-4", numbers
    worst = max(test_tangential.closed_form_error(profile) for profile in test_tangential.profiles().values())
    sums = "closed form F_t(u) = μ [F_n(d) - F_n(d - G\\* u/(μ E\\*))] against the sum over springs, seven profiles"
    yield sums, "1e-12", short(worst)
    powers = ", ".join(short(test_tangential.power_law_error(*power)) for power in test_tangential.POWERS)
    yield "profiles of the form x^n, n = 0.3, 1, 2, 8, against 1 - (1 - w)^((n+1)/n)", "1e-5", powers
    coarse, fine = (
        np.mean([test_tangential.sphere_error(n, a) for a in np.linspace(1.2, 1.25, 11)]) for n in (200, 2000)
    )
    sphere_told = f"{coarse / fine:.0f} ({short(coarse)}, {short(fine)})"
    yield "sphere against Cattaneo and Mindlin: error with 200 over that with 2000 springs", "100 ± 20", sphere_told
    force, stiffness = exponents[65536][0], exponents[4096][1]
    shown = ", ".join(f"{force[at[H]]:.2f} ({(H + 1) / H:.3g})" for H in (0.5, 0.7, 0.9))
    yield "exponent of F_n against d at H = 0.5, 0.7, 0.9, N = 65536: (H + 1)/H", "0.15", shown
    small = f"{exponents[4096][0][at[0.2]]:.2f} (N = 4096), {force[at[0.2]]:.2f} (65536)"
    yield "exponent of F_n against d at H = 0.2: far below (H + 1)/H = 6, rises with N", "no agreement", small
    known = "exponent of stiffness against load at H = 0.1, 0.2, 0.3, 0.5, 0.7, 0.9: 0.80, 0.77, 0.73, 0.65, 0.59, 0.54"
    yield known, "0.05", ", ".join(f"{x:.2f}" for x in stiffness)
    half = [test_tangential.mean_w(H, 2.86e-6, 0.31, 0.5) for H in (0.1, 0.5, 0.9)]
    halves = ", ".join(f"{w:.3f}" for w in half)
    yield "w at half of full friction grows with H: 0.152, 0.218, 0.281 at H = 0.1, 0.5, 0.9", "0.01", halves
    loads = [test_tangential.mean_w(0.3, 2.46e-6, f, 0.5, 16384, 400) for f in (0.03, 0.1, 0.31, 1.0)]
    constant = "w at half of full friction does not depend on the load from 0.03 to 1 N (H = 0.3, N = 16384, 400 lines)"
    yield constant, "0.01", f"{min(loads):.3f} ... {max(loads):.3f}"
    springs = test_hysteresis.rough_springs()
    walks = [test_hysteresis.walk_error(springs, seed, s) for seed in range(8) for s in test_hysteresis.SCALES]
    masing = f"{short(test_hysteresis.masing_error(springs))}, {short(max(walks))}"
    yield f"Masing's rules, and turning points on random walks, {springs.k.size} springs", "1e-12", masing
    bank = power_law_bank(test_memory.F_S, test_memory.U_MAX, test_memory.P, n=1000)
    off = np.array([
        [x / y - 1.0 for x, y in zip(test_memory.after_slip(bank, ratio)[1:3], known, strict=True)]
        for ratio, _, *known, _ in test_memory.TABLE
    ])  # fmt: skip
    yield "rebound and creep left after an undamped slip, four drops of friction", "2 %", percent(np.abs(off).max())


@figure
def rate_and_state() -> None:
    laws = rate_and_state_errors.LAWS
    of_law = {law: list(_rate_and_state(law)) for law in laws}
    about = (
        ("friction after velocity steps: a decade up, one down, two down", "its change in that step", "1e-8"),
        ("steady sliding: change with velocity, -(b - a) F ln((v₂ + v\\*)/(v₁ + v\\*))", "itself", "1e-8"),
        ("slide-hold-slide (1 s, 10 s): spring's force at any time", "its change by the holds", "1e-4"),
        ("slide-hold-slide: by how much the longer hold's peak is higher", "itself", "1e-5"),
        ("stick-slip: onset of each burst, at 20, 100 and 400 µm/s", "time between bursts", "1e-5"),
        ("stick-slip: displacement while slower than 20 µm/s", "slip of a burst", "1e-5"),
        ("stick-slip: force at any time, also in bursts", "its change", "1e-4"),
    )
    rows = [[*words, *(short(of_law[law][i]) for law in laws)] for i, words in enumerate(about)]
    columns = ["error of", "relative to", "required", *(f"{law} law" for law in laws)]
    table("rate and state", "rate_and_state", columns, rows)
    grown = {law: rate_and_state_errors.growth_beside_the_critical_stiffness(law) for law in laws}
    rows = [
        [f"{stability:g}", f"{round(of[0][1].real, 6) + 0.0:.6f}", *(f"{found.real:.6f}" for found, _ in of)]
        for stability, *of in zip(rate_and_state_errors.STABILITIES, *grown.values(), strict=True)
    ]
    columns = ["spring over the critical one", "linearised equations", *(f"{law} law" for law in laws)]
    table("growth", "rate_and_state", columns, rows)


def _rate_and_state(law: str) -> Iterable[float]:
    yield rate_and_state_errors.velocity_steps(law)[0]
    yield rate_and_state_errors.steady_sliding(law)
    yield from rate_and_state_errors.slide_hold_slide(law)[:2]
    yield from rate_and_state_errors.stick_slip(law)[:3]


@figure
def static() -> plt.Figure:
    fig, (left, right) = axes(2)
    fast = np.array([8e-4, 1.6e-3, 3.2e-3])
    constant = np.array([static_limit.constant_friction(v).error.max() for v in fast])
    slow = np.array([2.5e-5, 5e-5, 1e-4, 2e-4])
    seen = [static_limit.base_law(v) for v in slow]
    base = np.array([d.error.max() for d in seen])
    told = np.array([static_limit.base_law_prediction(v, d.w).max() for v, d in zip(slow, seen, strict=True)])
    print(
        "constant friction: order",
        order(fast, constant),
        "base law: order",
        order(slow, base),
        "coefficient",
        base / told,
    )
    left.loglog(fast * 1e6, constant, "o", label="constant friction")
    left.loglog(fast * 1e6, constant[0] * (fast / fast[0]) ** 2, "k--", lw=0.8, label="$v_0^2$")
    left.loglog(slow * 1e6, base, "s", label="base law")
    left.loglog(slow * 1e6, told, "k-", lw=0.8, label=r"$(1-r)\,\Phi_{slip}\,v/v_c$")
    left.set(xlabel="drive velocity (µm/s)", ylabel="departure from the static curve (1)", title="u < u_max/2")
    left.legend()
    for c_s, mark in ((300.0, "^"), (1000.0, "o")):
        v = np.array([2.5e-5, 1e-4, 4e-4, 1.6e-3])
        share = np.array([np.divide(*static_limit.breakaway_lag(a, c_s)) for a in v])
        print("breakaway lag over T*:", c_s, dict(zip(v, share.round(3), strict=True)))
        right.semilogx(v * 1e6, share, mark + "-", label=f"$c_s$ = {c_s:g} N/m")
        lag = ", ".join(f"{a:.2f}" for a in share[1:])  # of the last of the two springs
    table("static", "static", ("statement", "expected", "obtained"), (
        ("constant friction: order of the departure in v₀ (u < u_max/2)", "2", f"{order(fast, constant):.2f}"),
        ("base law: order", "1", f"{order(slow, base):.2f}"),
        ("base law: coefficient (1 - r) Φ_slip v/v_c, 25 ... 200 µm/s", "1",
         ", ".join(f"{a:.2f}" for a in base / told)),
        (r"last element slides late by, in T\*, c_s = 1 kN/m, 100 ... 1600 µm/s", "0.8 ... 1", lag),
    ))  # fmt: skip
    right.axhspan(0.8, 1.0, alpha=0.15, color="k")
    right.set(xlabel="drive velocity (µm/s)", ylabel="lag / T*", title="Lag of the last element")
    right.legend()
    return fig


@figure
def slips() -> plt.Figure:
    fig, (left, middle, right) = axes(3)
    made = slip_events.run(rig(damping=0.5), 8.0)
    s, e = made.trajectory.steps, made.events
    near = (s.t > e.onset[1] - 0.02) & (s.t < e.arrest[1] + 0.06)
    left.plot((s.t[near] - e.onset[1]) * 1e3, s.v[near] * 1e3)
    told = slip_events.classical(1000.0, 0.5)
    left.axhline(told.peak * 1e3, color="k", ls="--", lw=0.8)
    left.axvline(told.duration * 1e3, color="k", ls="--", lw=0.8)
    left.set(xlabel="time since onset (ms)", ylabel="velocity (mm/s)", title="A slip; dashed: block on a spring")
    left.set_ylim(top=1.1e3 * told.peak)
    whole = [e.size / told.slip, (e.arrest - e.onset) / told.duration, e.peak / told.peak]
    rows = [
        (name, *(f"{share[i]:.2f}" for share in whole))
        for name, i in (("second", 1), ("first, which starts from a virgin contact before full friction is reached", 0))
    ]
    table("slip events", "slips", ("event, share of the reference", "slip", "duration", "peak velocity"), rows)
    for c_s, mark in zip((500.0, 1000.0, 2000.0), MARKS, strict=False):
        e = slip_events.run(rig(damping=0.5, spring_stiffness=c_s), 9.0 * np.sqrt(1000.0 / c_s) + 3.0).events
        told = slip_events.classical(c_s, 0.5)
        shares = [e.size / told.slip, (e.arrest - e.onset) / told.duration, e.peak / told.peak]
        print(
            f"c_s {c_s:g}: slip, duration, peak over the classical ones (second event)", [float(q[1]) for q in shares]
        )
        middle.plot(["slip", "duration", "peak velocity"], [q[1] for q in shares], mark, label=f"$c_s$ = {c_s:g} N/m")
    middle.axhspan(0.9, 1.1, alpha=0.15, color="k")
    middle.set(ylabel="seen / classical", title="Second event", ylim=(0.8, 1.2))
    middle.legend()
    critical = slip_events.critical_velocity()
    share = np.array([0.85, 0.9, 0.95, 1.0, 1.05, 1.1])
    rate = [slip_events.growth(a * critical) for a in share]
    print("critical velocity", critical, "seen at", np.interp(0.0, -np.array(rate), share))
    right.plot(share, rate, "o-")
    right.axhline(0.0, color="k", lw=0.8)
    right.set(xlabel="velocity / critical velocity", ylabel="growth rate (1/s)", title="Steady sliding, c = 0.5 N s/m")
    return fig


@figure
def ring_down() -> plt.Figure:
    fig, (left,) = axes(1)
    for amplitude in (10e-9, 20e-9, 50e-9, 100e-9):
        seen, law = ringing.microslip(amplitude)
        print(f"ring-down {amplitude * 1e9:g} nm: largest departure", np.max(np.abs(seen.amplitude / law - 1.0)))
        (line,) = left.semilogy(seen.t * 1e3, seen.amplitude * 1e9, "o", ms=3)
        left.semilogy(seen.t * 1e3, law * 1e9, color=line.get_color(), lw=1)
    print("frequency, seen and expected", [ringing.frequency(spring_stiffness=c) for c in (1e3, 1e5)])
    left.set(xlabel="time (ms)", ylabel="amplitude (nm)", title="Microslip alone; lines: hyperbolic law")
    return fig


@figure
def after_an_event() -> plt.Figure:
    fig, (left, right) = axes(2)
    model = rig(damping=2.0)
    events = slip_events.run(model, 8.0, tighter(10.0)).events
    settled = float(events.arrest[0]) + 0.5
    first, state = integrate(model, settled, tolerance=tighter(10.0))
    later, _ = integrate(model, 8.0, t0=settled, state=state, tolerance=tighter(10.0))
    s = later.steps
    creep = (s.t < events.onset[1]) & (s.spring_force < 0.98 * STRENGTH)
    static = np.asarray(reload_displacement(model.bank, state.force, s.spring_force[creep]))
    virgin = first.steps.t < events.onset[0]
    left.plot(first.steps.x[virgin] * 1e9, first.steps.spring_force[virgin], label="virgin contact")
    left.plot((s.x[creep] - s.x[0]) * 1e9, s.spring_force[creep], label="after the first event")
    left.plot(static * 1e9, s.spring_force[creep], "k--", lw=0.8, label="static, from the same forces")
    left.set(xlabel="creep (nm)", ylabel="spring force (N)", xlim=(-20, 800))
    left.legend()
    print("creep after an event against the static curve, nm:", np.max(np.abs(s.x[creep] - s.x[0] - static)) * 1e9)
    static_factor = {0.95: 21.0, 0.90: 9.2, 0.85: 5.7, 0.70: 2.6}
    found = []
    for damping, mark in ((0.5, "o"), (2.0, "s")):
        factors = {}
        for ratio in static_factor:
            virgin_creep, *creeps = slip_events.creep_to(slip_events.run(rig(damping=damping, ratio=ratio), 9.0), 1e-6)
            factors[ratio] = virgin_creep / creeps[-1]
        found.append(factors)
        right.semilogy(list(factors), list(factors.values()), mark, label=f"simulated, c = {damping:g} N s/m")
    columns = ("μ_k/μ_s", "static, after an undamped slip", "simulated, c = 0.5 N s/m", "c = 2 N s/m")
    rows = [
        (f"{r:.2f}", f"{known:g}", *(f"{f[r]:.{1 if f[r] < 100 else 0}f}" for f in found))
        for r, known in static_factor.items()
    ]
    table("after an event", "after_an_event", columns, rows)
    values = list(static_factor.values())
    right.semilogy(list(static_factor), values, "k_", ms=20, label="static, after an undamped slip")
    right.set(xlabel=r"$\mu_k/\mu_s$", ylabel="virgin creep / later creep", title="Creep up to 1 µm/s")
    right.legend()
    return fig


@figure
def brute_force() -> plt.Figure:
    fig, (left, middle, right) = axes(3)
    stiffness, cap, binned = comparison.rough_contact(4, 4096, 0.3, 2.46e-6, bins=256)
    both = comparison.pair(stiffness, cap, binned, 7.2, tighter(10.0))
    period = np.mean(both.reference.recurrence)
    print("springs", len(cap), "onset error over the period", (both.made.events.onset - both.reference.onset) / period)
    onset = both.reference.onset[1]
    t = np.linspace(onset - 0.02, onset + 0.1, 6000)
    left.plot((t - onset) * 1e3, np.interp(t, both.path.t, both.path.x) * 1e6, lw=3, alpha=0.4, label="brute force")
    left.plot((t - onset) * 1e3, both.made.trajectory.at(t).x * 1e6, "k", lw=0.8, label="solver")
    left.set(xlabel="time since onset (ms)", ylabel="displacement (µm)", title=f"Second slip, {len(cap)} springs")
    left.legend()
    for number, (t, gap) in enumerate(comparison.creep_gaps(both)):
        print("creep, nm:", np.max(np.abs(gap)) * 1e9)
        middle.plot(t, gap * 1e9, lw=(0.8, 2.2, 0.8)[number % 3], label=f"stick phase {number + 1}")
    middle.set(xlabel="time since its start (s)", ylabel="solver - brute force (nm)", title="Creep up to 1 µm/s")
    middle.legend()
    bins = (64, 128, 256, 512, 1024)
    worst, rows = [], []
    for n in bins:
        made = slip_events.run(rig(springs=comparison.rough_contact(4, 4096, 0.3, 2.46e-6, n)[2]), 7.2, tighter(10.0))
        gaps = comparison.creep_gaps(comparison.Pair(both.path, both.reference, made))
        worst.append([np.max(np.abs(g)) * 1e9 for _, g in gaps])
        late = (made.events.onset - both.reference.onset)[0] / period
        rows.append((str(n), *(f"{nm:.1f} nm" if nm < 1000 else f"{nm / 1000:.1f} µm" for nm in worst[-1][:2]),
                     short(late, 1) if abs(late) < 1e-3 else f"{late:.2g}"))  # fmt: skip
    columns = ("elements", "virgin creep", "later creep", "first onset, share of the period")
    table("elements", "brute_force", columns, rows)
    for phase in (0, 1):
        right.loglog(bins, np.array(worst)[:, phase], MARKS[phase], label=f"stick phase {phase + 1}")
    right.axhline(1.0, color="k", lw=0.8)
    right.set(xlabel="elements of the bank", ylabel="largest difference (nm)", title="Four rough lines")
    right.legend()
    return fig


@figure
def converge() -> plt.Figure:
    fig, (left, middle, right) = axes(3)
    fine = np.array([250, 500, 1000, 2000])
    slip = convergence.slip_errors(fine) / 4e-5
    print("order within a slip", order(1.0 / fine, slip))
    left.loglog(3e4 / fine, slip, "s-", label="within a slip (share of slip)")
    left.loglog(3e4 / fine, slip[-1] * (fine[-1] / fine) ** 2.0, "k--", lw=0.8, label="$h^2$")
    left.set(xlabel="fixed step (µs)", ylabel="error")
    left.legend()
    factors = np.array([1.0, 3.0, 10.0, 30.0, 100.0, 300.0])
    exact = convergence.second_event(factor=3000.0)
    by_tolerance = np.abs(np.array([convergence.second_event(factor=f) for f in factors]) / exact - 1.0)
    bins = np.array([32, 64, 128, 256, 512])
    exact = convergence.second_event(2048, 30.0)
    by_bins = np.abs(np.array([convergence.second_event(int(n), 30.0) for n in bins]) / exact - 1.0)
    for i, name in enumerate(convergence.QUANTITIES):
        middle.loglog(factors, by_tolerance[:, i], MARKS[i], label=name)
        right.loglog(bins, by_bins[:, i], MARKS[i], label=name)
    columns = ("relative error of", "default", "/10", "/100", "32 elements", "128", "512")
    rows = [
        ("first onset" if name == "onset" else name.replace("peak", "peak velocity"),
         *(short(by_tolerance[k, i]) for k in (0, 2, 4)), *(short(by_bins[k, i]) for k in (0, 2, 4)))
        for i, name in enumerate(convergence.QUANTITIES)
    ]  # fmt: skip
    table("convergence", "converge", columns, rows)
    middle.set(xlabel="default tolerance divided by", ylabel="relative error")
    right.set(xlabel="elements of the bank", ylabel="relative error")
    middle.legend()
    return fig


@figure
def orders() -> None:
    steps = (1e-4, 5e-5, 2.5e-5, 1.25e-5)
    columns = ("error of", "order", *(f"{1e6 * step:g} µs" for step in steps))
    found = convergence.event_orders(steps)
    rows = [(name, f"{power:.2f}", *map(short, errors)) for name, (power, errors) in found.items()]
    table("orders", "orders", columns, rows)


@figure
def times() -> None:
    exact = slip_differences.brute_slips(np.zeros(len(derivatives.BASE)), 5e-7)
    rows = []
    for name, factor in TOLERANCES.items():
        trajectory, _ = integrate(rig(), slip_differences.END, tolerance=tighter(factor))
        made, t = test_events.events(trajectory), trajectory.steps.t
        at = np.searchsorted(t, made.arrest)
        lasts = np.abs((made.arrest - made.onset) - (exact.arrest - exact.onset)).max()
        sizes = (
            np.abs(a / b - 1.0).max() for a, b in ((made.slip, exact.slip), (made.peak_velocity, exact.peak_velocity))
        )
        late = 1e6 * np.abs(made.onset - exact.onset)
        onsets = ", ".join(f"{t:.0f}" if t >= 10.0 else f"{t:.2g}" for t in late)
        rows.append(
            (
                name,
                f"{1e3 * (t[at] - t[at - 1]).max():.2g} ms",
                f"{1e6 * lasts:.2g} µs",
                *map(short, sizes),
                f"{onsets} µs",
            )
        )
    columns = ("tolerance", "step at an arrest", "arrest - onset", "slip", "peak velocity", "onset")
    table("times of events", "times", columns, rows)


@figure
def scatter() -> plt.Figure:
    fig, (left, right) = axes(2)
    kicks, rows = np.linspace(0.0, 2e-6, 12), []
    exact = {}
    for damping, mark in zip((0.0, 1.0, 10.0), MARKS, strict=False):
        exact[damping] = onsets = convergence.brute_onsets(damping, kicks)
        left.plot(kicks * 1e6, (onsets[:, 1] - onsets[:, 1].mean()) * 1e3, mark, label=f"c = {damping:g} N s/m")
        moved, wrong = [], []
        for (name, factor), own in zip(TOLERANCES.items(), MARKS, strict=True):
            found = convergence.onset_scatter(damping, kicks, tighter(factor))
            moved.append(np.ptp(found, axis=0).max())
            wrong.append(np.abs(found - onsets[:, : found.shape[1]]).max())
            if damping == 1.0:
                right.plot(kicks * 1e6, (found - onsets)[:, 1] * 1e3, own, label=name)
        ranges = [np.ptp(onsets, axis=0).max(), *moved]
        rows.append((f"{damping:g} N s/m", "range", *(f"{m * 1e3:.2g}" for m in ranges)))
        if damping:
            rows.append(("", "error", "", *(f"{w * 1e3:.2g}" for w in wrong)))
    left.set(xlabel="kick at the start (µm/s)", ylabel="second onset, from its mean (ms)", title="Leapfrog")
    right.set(xlabel="kick at the start (µm/s)", ylabel="second onset, error (ms)", title="Solver, c = 1 N s/m")
    left.legend()
    right.set_yscale("log")
    right.set_ylim(top=20.0)
    right.legend(loc="upper right", ncols=2)
    columns = ("damping", "of the onsets, ms", "leapfrog", *(f"solver, {name}" for name in TOLERANCES))
    table("kicks", "scatter", columns, rows)
    return fig


@figure
def roughness() -> None:
    found = [percent(error) for error in test_rough_derivatives.against_brute_force(2e-3).values()]
    columns = ("", "first onset", "recurrence", "slip", "peak velocity")
    table("derivatives in the roughness", "roughness", columns, [("error over the largest of their kind", *found)])


@figure
def generator() -> None:
    bank = make_bank(Surface(points=4096), dynamics.LOADS, 1)
    missing = {dt: dynamics.missing_work(dynamics.four_slips(bank, dt)) for dt in (4e-5, 2e-5, 1e-5)}
    rows = [(f"{dt * 1e6:g} µs", short(share)) for dt, share in missing.items()]
    table("energy of the generator", "generator", ("step", "share of the work that is missing"), rows)


@figure
def ladder() -> None:
    k = derivatives.NAMES.index("spring_stiffness")
    rungs = {"3 · 10⁻⁴": 3e-4, "10⁻⁴": 1e-4, "10⁻⁵": 1e-5, "10⁻⁶": 1e-6, "10⁻⁷": 1e-7}
    found: list[list[float]] = []
    for grids in (1, 4):
        slips = slip_differences.on_tied_steps(10.0, 2, grids)
        values = []
        for step in rungs.values():
            move = step * np.eye(len(derivatives.BASE))[k]
            there, back = (slip_differences.table(slips(m))["recurrence"][0] for m in (move, -move))
            values.append(float(there - back) / (2.0 * step))
        found.append([*values, float(slip_differences.solved(10.0, 2, grids)[1]["recurrence"][k][0])])
    rows = [(name, *(f"{values[i]:.6f}" for values in found)) for i, name in enumerate([*rungs, "derivative"])]
    table("ladder of differences", "ladder", ("differences over", "one grid, s", "mean of four grids, s"), rows)


@figure
def energy() -> plt.Figure:
    fig, (left, middle, right) = axes(3)
    worst, steps, spent = [], [], []
    levels = {"default": 1.0, "default/3, of a scenario": 3.0} | TOLERANCES
    for f in levels.values():
        slip_events.run(rig(), 8.0, tighter(f))  # compiles
        start = time.process_time()
        made = slip_events.run(rig(), 8.0, tighter(f))
        spent.append(time.process_time() - start)
        worst.append(np.max(np.abs(energy_balance.imbalance(made.trajectory.steps))))
        steps.append(made.trajectory.stats.steps)
    rows = [
        (name, short(worst[k]), f"{steps[k]:,}".replace(",", " "), f"{spent[k]:.2f} s") for k, name in enumerate(levels)
    ]
    table("energy", "energy", ("tolerance", "imbalance", "steps", "processor time"), rows)
    s = made.trajectory.steps
    for name, style in zip(("spring_work", "friction_work", "viscous_work", "stored"), MARKS, strict=True):
        left.plot(s.t, getattr(s, name) * 1e6, style[1:], label=name.replace("_", " "))
    left.set(xlabel="time (s)", ylabel="energy (µJ)")
    left.legend()
    middle.loglog(steps, worst, "o-")
    middle.axhline(1e-6, color="k", lw=0.8)
    middle.set(xlabel="steps for 8 s with four events", ylabel="largest imbalance / work of the spring")
    cycle = energy_balance.slow_cycle()
    s = cycle.steps
    print("hysteresis: largest departure over strength", np.max(np.abs(s.contact_force - cycle.force)) / STRENGTH)
    right.plot(s.x * 1e6, s.contact_force, lw=2.5, alpha=0.4, label="solver")
    right.plot(s.x * 1e6, cycle.force, "k", lw=0.8, label="Masing, turning points")
    right.set(xlabel="displacement (µm)", ylabel="contact force (N)")
    right.legend()
    return fig


@figure
def derivative() -> plt.Figure:
    fig, (left, right) = axes(2)
    size = len(derivatives.BASE)
    start, early, end = 5.13, 5.16, 5.23
    _, state = integrate(derivatives.build(jnp.zeros(size)), start, tolerance=tighter(100.0))
    n = round((end - start) / 2e-5)

    def outcomes(theta: jax.Array) -> jax.Array:
        trace = derivatives.trace(jnp.asarray(theta), state, start, end, Tolerance(), n, False)
        return jnp.stack(derivatives.outcome(*trace, early))

    zero = jnp.zeros(size)
    exact = np.stack([np.asarray(jax.jvp(outcomes, (zero,), (e,))[1]) for e in jnp.eye(size)])
    scale = np.max(np.abs(exact), axis=0)
    rungs = 10.0 ** -np.arange(2.0, 9.5, 1.0)
    gaps = np.array([np.max(np.abs(derivatives.differences(outcomes, h) - exact) / scale, axis=0) for h in rungs])
    for i, name in enumerate(derivatives.Outcome._fields):
        left.loglog(rungs, gaps[:, i], MARKS[i], label=name)
        print(
            name, "differences against the derivative, by step", dict(zip(rungs, np.round(gaps[:, i], 5), strict=True))
        )
    left.set(
        xlabel="step of the difference (1)", ylabel="disagreement / largest derivative", title="One slip, fixed steps"
    )
    left.legend()
    which = derivatives.NAMES.index("spring_stiffness")
    direction = jnp.eye(size)[which]
    plain = []
    for name, factor, colour in (("default tolerance", 1.0, "C0"), ("default/100", 100.0, "C1")):
        function = derivatives.two_events(tighter(factor), most=32768)
        moves = np.linspace(-0.02, 0.02, 41)
        t = np.array([np.asarray(function(m * np.asarray(direction))) for m in moves])[:, 1]
        slope = float(jax.jvp(function, (zero,), (direction,))[1][1])
        wide = np.polyfit(moves, t, 1)[0]
        plain.append((f"adaptive steps, {name}", f"{slope:.3f}", f"{wide:.3f}"))
        right.plot(moves * 100, t, ".-", color=colour, lw=0.6, label=name)
        near = np.array([-0.004, 0.004])
        right.plot(near * 100, t[20] + slope * near, color=colour, lw=2.5, alpha=0.5)
    even = derivatives.two_events(Tolerance(), most=round(6.3 / 2e-5), fixed=True)
    slope = float(jax.jvp(even, (zero,), (direction,))[1][1])
    wide = float(derivatives.differences(even, 1e-3, [which])[0][1])
    plain.append(("fixed steps of 20 µs", f"{slope:.3f}", f"{wide:.3f}"))
    table("plain derivatives", "derivative", ("derivative by", "derivative, s", "difference, s"), plain)
    expected = slip_differences.brute_differences(1e-3)
    kinds = {
        "default tolerance": (1.0, 1, 1), "default/10": (10.0, 1, 1),
        "default/10, each divided by two": (10.0, 2, 1),
        "default/10, each divided by two, mean of four grids (the default)": (10.0, 2, 4),
    }  # fmt: skip
    rows = []
    for kind, (factor, refine, grids) in kinds.items():
        values, columns = slip_differences.solved(factor, refine, grids)
        slope, at = columns["recurrence"][which], float(values["recurrence"][0])
        errors = slip_differences.errors(columns, expected).values()
        rows.append((kind, *map(percent, errors), ", ".join(f"{a:.4f}" for a in slope)))
    slope = float(slope[0])
    right_ones = ", ".join(f"{a:.4f}" for a in expected["recurrence"][which])
    columns = ("steps of a run with", "first onset", "recurrences", "slips", "peak velocities",
               f"recurrence by ln c_s ({right_ones} s)")  # fmt: skip
    table("derivatives of slips", "derivative", columns, rows)
    right.plot(near * 500, at + slope * 5 * near, "k--", lw=1.2, label="on steps tied to the motion")
    right.set(
        xlabel="change of spring stiffness (%)",
        ylabel="recurrence (s)",
        title="Thick: derivative through adaptive steps",
    )
    right.legend()
    return fig


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or DRAW:
        start = time.process_time()
        print(f"--- {name}")
        fig = DRAW[name]()
        if fig is not None:
            tidy(fig)
            fig.savefig(FOLDER / f"{name}.png", dpi=110)
            plt.close(fig)
        print(f"    ({time.process_time() - start:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
