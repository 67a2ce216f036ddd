"""The tables of solvers at equal accuracy, and the search for the coarsest setting that is accurate enough."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from stickslip.physics.contact import Bank

from . import own, peers
from .case import CREEP, REFERENCE, STEPS, TIMES, Accuracy, Answer, Case, events_of, leapfrog, measure
from .measuring import head, keep, row, timed

ENOUGH, MOST = 100.0, 60.0  # times the own solver's, s: how long a peer may take, if that is more than the limit
FACTORS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)  # the default tolerance is divided by


class Found(NamedTuple):
    """A setting, its processor time (s) and steps, its accuracy and whether that is enough."""

    setting: float
    cpu: float
    steps: int
    accuracy: Accuracy
    good: bool


def coarsest_own(
    case: Case, reference: Answer, bank: Bank | None = None, tell: Callable[[Found], object] = lambda found: None
) -> Found:
    """The own solver with the loosest tolerance that is accurate enough; the tightest tried if none is."""
    events = len(events_of(case, reference).onset)
    own.own_run(case, FACTORS[0], bank)  # compiles
    for factor in FACTORS:
        made, cpu, _ = timed(lambda f=factor: own.own_run(case, f, bank))
        accuracy = measure(case, own.answer(case, made), reference)
        found = Found(factor, cpu, made.stats.steps, accuracy, accuracy.enough(events))
        tell(found)
        if found.good:
            break
    return found


def coarsest_leapfrog(case: Case, reference: Answer, tell: Callable[[Found], object] = lambda found: None) -> Found:
    """The leapfrog of all springs with the longest step that is accurate enough."""
    events = len(events_of(case, reference).onset)
    for dt in STEPS:
        answer, cpu, _ = timed(lambda dt=dt: leapfrog(case, dt))
        accuracy = measure(case, answer, reference)
        found = Found(dt, cpu, round(case.duration / dt), accuracy, accuracy.enough(events))
        tell(found)
        if found.good:
            break
    return found


def table(case: Case, limit: float) -> list[dict[str, Any]]:
    """Print the table of one case; what each solver needs at its coarsest setting that is accurate enough."""
    leapfrog(Case(springs=8, duration=0.1), 5e-5)  # compiles
    reference, cpu, _ = timed(lambda: leapfrog(case, REFERENCE), 1)
    events = len(events_of(case, reference).onset)
    print(
        f"\n{case.springs} elements, {case.duration:g} s of drive at {case.velocity * 1e6:g} um/s, {events} events. "
        f"Accurate enough: onsets to {TIMES:g} of the period, creep to {CREEP * 1e9:g} nm, against leapfrog "
        f"with {REFERENCE * 1e6:g} us ({cpu:.1f} s). Times: least of three; runs above 5 s once."
    )
    head("solver", "setting", "processor s", "steps", "onset", "recurrence", "creep nm", "accurate enough")
    spent: dict[str, float] = {}
    kept: dict[str, dict[str, Any]] = {}

    def note(name: str, setting: str, **found: Any) -> None:
        size = {"velocity": case.velocity, "events": events, "springs": case.springs}
        kept[name] = {**size, "solver": name, "setting": setting, **found}

    def tell(name: str, setting: str, steps: object, found: Found) -> None:
        row(
            name, setting, f"{found.cpu:.3f}", steps, f"{found.accuracy.onset:.1e}",
            f"{found.accuracy.recurrence:.1e}", f"{found.accuracy.creep * 1e9:.2g}", "yes" if found.good else "no",
        )  # fmt: skip
        note(
            name, setting, processor_s=found.cpu, onset=found.accuracy.onset, creep_nm=found.accuracy.creep * 1e9,
            enough=found.good,
        )  # fmt: skip
        if found.good:
            spent[name] = found.cpu

    best = coarsest_own(case, reference, tell=lambda f: tell("own", f"tolerance/{f.setting:g}", f.steps, f))
    limit = max(limit, min(ENOUGH * best.cpu, MOST))
    coarsest_leapfrog(case, reference, lambda f: tell("leapfrog, numba", f"{f.setting * 1e6:g} us", f.steps, f))
    for name in (*(f"scipy {m}" for m in peers.SCIPY), *(f"diffrax {m}" for m in peers.DIFFRAX)):
        library, method = name.split()
        if library == "scipy":
            work = lambda rtol, until, m=method: peers.scipy_answer(case, m, rtol, until)  # noqa: E731
        else:
            work = peers.diffrax_solver(case, method)
        for rtol in (1e-3, 1e-4, 1e-6, 1e-8):
            until = time.process_time() + limit
            try:
                (answer, count), cpu, _ = timed(lambda rtol=rtol, work=work, until=until: work(rtol, until), 1)
            except peers.OverTime as why:
                row(name, f"rtol {rtol:g}", f"over {limit:g}", "", "", "", "", f"no: {why}")
                note(name, f"rtol {rtol:g}", processor_s=None, limit_s=limit, why=str(why), enough=False)
                if rtol < 1e-3:  # an implicit solver may be slower where it is coarser
                    break
                continue
            accuracy = measure(case, answer, reference)
            found = Found(rtol, cpu, count, accuracy, accuracy.enough(events))
            tell(name, f"rtol {rtol:g}", f"{count} {'calls' if library == 'scipy' else 'steps'}", found)
            if found.good:
                break
    if own_cpu := spent.get("own"):
        print("\nin times of the own solver: " + ", ".join(f"{n} {c / own_cpu:.3g}" for n, c in spent.items()))
    return list(kept.values())


SPRINGS = (64, 250, 1000, 4000)
# m/s and events, with the fewest springs
DRIVES = ((1e-5, 5), (7e-4, 5), (2e-4, 1), (2e-4, 50), (2e-4, 1000))


def report(limit: float, small: bool = False, springs: Sequence[int] = SPRINGS) -> None:
    """A table for each number of springs at 50 um/s, and for other drives and numbers of events."""
    runs: list[dict[str, Any]] = []
    for n in (64,) if small else springs:
        runs += table(Case(springs=n, duration=2.0 if small else 5.0), limit)
    for velocity, events in () if small else DRIVES:
        runs += table(Case(springs=SPRINGS[0], velocity=velocity).lasting(events), limit)
    if not small and tuple(springs) == SPRINGS:
        keep("solvers", "solvers", limit_s=limit, onset=TIMES, creep_nm=CREEP * 1e9, runs=runs)
