"""Cost against springs, velocity of the drive, length of a hold and number of events: tables, results, pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, save, styled

from . import own
from .case import REFERENCE, Answer, Case, events_of, leapfrog, measure
from .measuring import head, keep, row, timed
from .solvers import FACTORS, Found, coarsest_leapfrog, coarsest_own

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "performance"
SPRINGS, BINS = (64, 250, 1000, 4000), (32, 64, 128, 256)
VELOCITIES = (1e-5, 3e-5, 1e-4, 3e-4, 7e-4)  # m/s; at 1 mm/s this rig slides steadily after two slips
HOLDS = (1.0, 10.0, 100.0)  # s
EVENTS, FAST = (1, 3, 10, 30, 100, 300, 1000), 2e-4  # 1, m/s
OWN_ALL, OWN_BINS, LEAPFROG = "own, every spring an element", "own, springs in bins", "numba leapfrog, every spring"
OWN, OWN_TIMES = "own", "own, every onset to 0.001 of the period"
OWN_LONGEST = "own, at the tolerance of the longest run"
TIMED = 100  # events up to which a setting is looked for that has every onset right
Series = dict[str, list[dict]]


def springs(sizes: Sequence[int] = SPRINGS, events: int = 5) -> Series:
    """The same rig with more and more springs; the own solver with all of them, and with the fewest bins that do."""
    series: Series = {OWN_BINS: [], OWN_ALL: [], LEAPFROG: []}
    print(
        f"\nNumber of springs: {events} events at 50 um/s, everything at the coarsest setting that is accurate enough."
    )
    _head("springs")
    for n in sizes:
        case = Case(springs=n).lasting(events)
        reference = leapfrog(case, REFERENCE)
        for bins in BINS:
            if bins < n:
                bank, bound = own.binned(case, bins)
                found = coarsest_own(case, reference, bank)
                if found.good:
                    _note(series, OWN_BINS, n, found, f"{bins} bins (bound {bound:.1e}), tolerance/{found.setting:g}")
                    break
        found = coarsest_own(case, reference)
        _note(series, OWN_ALL, n, found, f"tolerance/{found.setting:g}")
        found = coarsest_leapfrog(case, reference)
        _note(series, LEAPFROG, n, found, f"{found.setting * 1e6:g} us")
    return _slopes(series, "springs")


def drive(velocities: Sequence[float] = VELOCITIES, events: int = 5) -> Series:
    """The same number of events at slower and slower drives: sticks last longer, slips do not."""
    series: Series = {OWN: [], LEAPFROG: []}
    print(f"\nVelocity of the drive: {events} events, 256 springs, coarsest settings that are accurate enough.")
    _head("drive um/s")
    for v in velocities:
        case = Case(velocity=v).lasting(events)
        reference = leapfrog(case, REFERENCE)
        found = coarsest_own(case, reference)
        _note(series, OWN, v, found, f"tolerance/{found.setting:g}", 1e6)
        found = coarsest_leapfrog(case, reference)
        _note(series, LEAPFROG, v, found, f"{found.setting * 1e6:g} us", 1e6)
    return _slopes(series, "velocity")


def holds(lengths: Sequence[float] = HOLDS) -> Series:
    """Five seconds of drive with a hold in the middle, longer and longer."""
    series: Series = {OWN: [], LEAPFROG: []}
    print("\nHolds: 5 s of drive at 50 um/s with a hold, 64 springs, coarsest settings that are accurate enough.")
    _head("hold s")
    for length in lengths:
        case = Case(springs=64, duration=5.0 + length, hold=length)
        reference = leapfrog(case, REFERENCE)
        found = coarsest_own(case, reference)
        _note(series, OWN, length, found, f"tolerance/{found.setting:g}")
        found = coarsest_leapfrog(case, reference)
        _note(series, LEAPFROG, length, found, f"{found.setting * 1e6:g} us")
    return _slopes(series, "hold")


def events(numbers: Sequence[int] = EVENTS, chosen_at: int = 10) -> Series:
    """Longer and longer drives; settings are those that are accurate enough for some ten events, and are kept.

    With a setting kept what an onset is off adds up from event to event: these are measured by recurrence and creep.
    Beside them the own solver with the setting that has every onset right, for each number and for the largest.
    """
    series: Series = {OWN: [], LEAPFROG: [], OWN_TIMES: [], OWN_LONGEST: []}
    print(
        f"\nNumber of events: 256 springs, drive {FAST * 1e6:g} um/s, settings chosen for {chosen_at} events, and kept"
        " (accurate enough by recurrence), or chosen for each number (by onset)."
    )
    _head("events")
    longest = Case(velocity=FAST).lasting(max(numbers))
    reference = leapfrog(longest, REFERENCE)
    seen = events_of(longest, reference)
    short = Case(velocity=FAST).lasting(chosen_at)
    part = leapfrog(short, REFERENCE)
    factor, dt = coarsest_own(short, part).setting, coarsest_leapfrog(short, part).setting
    fine = next(
        f
        for f in FACTORS
        if f >= factor and measure(longest, own.answer(longest, own.own_run(longest, f)), reference).onset < 1e-3
    )
    for n in numbers:
        end = 0.5 * (seen.arrest[n - 1] + seen.onset[n]) if n < len(seen.onset) else longest.duration
        case = replace(longest, duration=float(np.round(end / 1e-3) * 1e-3))
        exact = Answer(*(a[: case.grid.size] for a in reference))
        made, cpu, _ = timed(lambda c=case: own.own_run(c, factor))
        _note(
            series,
            OWN,
            n,
            _found(case, own.answer(case, made), exact, factor, cpu, made.stats.steps),
            f"tolerance/{factor:g}",
        )
        made, cpu, _ = timed(lambda c=case: own.own_run(c, fine))
        found = _found(case, own.answer(case, made), exact, fine, cpu, made.stats.steps)
        _note(series, OWN_LONGEST, n, found, f"tolerance/{fine:g}")
        answer, cpu, _ = timed(lambda c=case: leapfrog(c, dt))
        found = _found(case, answer, exact, dt, cpu, round(case.duration / dt))
        _note(series, LEAPFROG, n, found, f"{dt * 1e6:g} us")
        if n <= TIMED:
            found = coarsest_own(case, exact)
            _note(series, OWN_TIMES, n, found, f"tolerance/{found.setting:g}")
    return _slopes(series, "events")


def report(small: bool = False, only: Sequence[str] = ("springs", "drive", "holds", "events")) -> dict:
    """All four, or some; results and pictures are written for those that ran (not for a small run)."""
    leapfrog(Case(springs=8, duration=0.1), 5e-5)  # compiles
    parts = {
        "springs": lambda: springs((64, 250), 2) if small else springs(),
        "drive": lambda: drive((1e-4, 7e-4), 2) if small else drive(),
        "holds": lambda: holds((1.0,)) if small else holds(),
        "events": lambda: events((1, 3), 2) if small else events(),
    }
    result = {name: parts[name]() for name in only}
    if small:
        return result
    FOLDER.mkdir(exist_ok=True)
    for name, series in result.items():
        keep(name, name, series=series, **({"size": "hold / s"} if name == "holds" else {}))
        save(draw(name, series), FOLDER / f"{name}.png")
    return result


@styled
def draw(name: str, series: Series) -> Figure:
    """Processor time against size, both logarithmic, with the fitted slopes."""
    label, factor = {
        "springs": ("number of springs", 1.0),
        "drive": ("velocity of the drive (µm/s)", 1e6),
        "holds": ("duration of the hold (s)", 1.0),
        "events": ("number of events", 1.0),
    }[name]
    made, axes = figure(width=6.0, height=3.8)
    ax = axes[0, 0]
    for way, points in series.items():
        color, mark = {
            OWN_ALL: (LIGHT, "s-"),
            OWN_TIMES: (LIGHT, "s-"),
            OWN_LONGEST: (MIDDLE, "D--"),
            LEAPFROG: (DARK, "^-"),
        }.get(way, (MIDDLE, "o-"))
        good = [p for p in points if p["enough"]]
        x, y = (np.array([p[k] for p in good]) for k in ("size", "processor_s"))
        # + 0.0: no slope of minus zero
        text = f"{way} (slope {round(points[0]['slope'], 2) + 0.0:.2f})" if "slope" in points[0] else way
        ax.plot(factor * x, y, mark, color=color, label=text)
        bad = [p for p in points if not p["enough"]]
        ax.plot([factor * p["size"] for p in bad], [p["processor_s"] for p in bad], mark[0], mfc="none", color=color)
    logarithmic(ax, "x")
    logarithmic(ax, "y")
    ax.set_xlabel(label)
    ax.set_ylabel("processor time of a run (s)")
    ax.set_ylim(top=ax.get_ylim()[1] * 6.0 ** (len(series) - 1))  # room for the legend
    ax.legend(loc="upper right" if name == "drive" else "upper left")
    return made


def _found(case: Case, answer: Answer, exact: Answer, setting: float, cpu: float, steps: int) -> Found:
    accuracy = measure(case, answer, exact)
    return Found(setting, cpu, steps, accuracy, accuracy.enough(len(events_of(case, exact).onset), by="recurrence"))


def _head(size: str) -> None:
    head(size, "way", "setting", "processor s", "steps", "events", "onset", "recurrence", "creep nm", "accurate enough")


def _note(series: Series, way: str, size: float, found: Found, setting: str, shown: float = 1.0) -> None:
    accuracy = found.accuracy
    row(
        f"{shown * size:g}", way, setting, f"{found.cpu:.4f}", found.steps, accuracy.events,
        f"{accuracy.onset:.1e}", f"{accuracy.recurrence:.1e}", f"{accuracy.creep * 1e9:.2g}",
        "yes" if found.good else "no",
    )  # fmt: skip
    series[way].append({
        "size": size, "processor_s": found.cpu, "setting": setting, "steps": found.steps, "events": accuracy.events,
        "onset": accuracy.onset, "recurrence": accuracy.recurrence, "creep_m": accuracy.creep, "enough": found.good,
    })  # fmt: skip


def _slopes(series: Series, size: str) -> Series:
    """Fit cost = size^slope over what is accurate enough."""
    for way, points in series.items():
        good = [p for p in points if p["enough"]]
        if len(good) > 1:
            x, y = (np.log([p[k] for p in good]) for k in ("size", "processor_s"))
            slope = float(np.polyfit(x, y, 1)[0])
            for p in points:
                p["slope"] = slope
            print(f"{way}: processor time grows as {size}^{round(slope, 2) + 0.0:.2f}")
    return series
