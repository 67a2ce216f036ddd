"""The table of targets on the page of performance, computed from the figures that the benchmark keeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import log
from typing import Any

import tables

SLOW, HALF_SLOW = 1e-5, 5e-5  # m/s


def targets(found: dict[str, Any]) -> str:
    """Every target with what was measured; ``found`` is the whole of performance.json."""
    found = {**tables.results("verification"), **found}
    rows = [[aim, told, reached, _date(found[part]), _command(found[part])] for part, aim, told, reached in _all(found)]
    return tables.table(["target", "measured", "reached", "date", "measured by"], rows)


def _all(found: dict[str, Any]) -> Iterable[tuple[str, str, str, str]]:
    """Part of the file, target, what was measured, and whether it is reached."""
    yield from (make(found) for make in (_static, _sets, _leapfrog, _slowly, _holds, _many_springs))
    yield from _peers(found)
    yield from (make(found) for make in (_orders, _energy, _onsets, _velocities, _springs))
    yield from (make(found) for make in (_rigs, _same, _gpu, _writing, _simulate, _help))
    yield from (make(found) for make in (_fits, _diagnosis, _memory, _inspected))


def _yes(reached: bool) -> str:
    return "yes" if reached else "no"


def _than(ratio: float) -> str:
    """How much faster something is that another takes ``ratio`` times as long for."""
    return f"{ratio:.2g} times faster" if ratio >= 1.0 else f"{1.0 / ratio:.2g} times slower"


def _between(ratios: Sequence[float]) -> str:
    """The nearest to one and the farthest of several such ratios, or both ends where they are on both sides of it."""
    low, high = min(ratios), max(ratios)
    words = [_than(ratio) for ratio in ((low, high) if low >= 1.0 else (high, low))]
    return (
        " to ".join([words[0].partition(" ")[0], words[1]]) if len({w[-6:] for w in words}) == 1 else " to ".join(words)
    )


def _static(found: dict[str, Any]) -> tuple[str, str, str, str]:
    part = found["static"]
    times = {row[0]: float(row[1]) for row in part["rows"]}
    numpy, own = times["numpy, every spring at every step"], times["own (a), from heights"]
    table = times["own (b), table there, other rms height and load"]
    told = f"{numpy / own:.0f} times from heights, {numpy / table:.0f} times from a table"
    return "static", "static curve 20 times faster than numpy", told, _yes(numpy >= 20.0 * own)


def _sets(found: dict[str, Any]) -> tuple[str, str, str, str]:
    many = found["static"]["many"]
    told = (
        f"{many['ms a set']} ms a set, {many['grown MiB']} MiB more, {many['result MiB']} MiB of which are the result"
    )
    bounded = many["grown MiB"] < 2.0 * many["result MiB"]
    return "static", "10 000 parameter sets, bounded memory", told, _yes(bounded)


def _runs(found: dict[str, Any]) -> dict[tuple[float, int, int], dict[str, Any]]:
    out: dict[tuple[float, int, int], dict[str, Any]] = {}
    for run in found["solvers"]["runs"]:
        out.setdefault((run["velocity"], run["events"], run["springs"]), {})[run["solver"]] = run
    return out


def _over_leapfrog(runs: dict[str, Any]) -> float:
    return float(runs["own"]["processor_s"] / runs["leapfrog, numba"]["processor_s"])


def beside_the_leapfrog(found: dict[str, Any]) -> str:
    """How much faster the leapfrog is than the package's solver, and why one takes that solver."""
    runs = _runs(found)
    half = [_over_leapfrog(r) for (v, _, n), r in runs.items() if v == HALF_SLOW and n in (64, 250)]
    fast = [_over_leapfrog(r) for (v, _, _), r in runs.items() if v > HALF_SLOW]
    few = next(1.0 / _over_leapfrog(r) for (v, _, _), r in runs.items() if v == SLOW)
    costs = {row[0]: row[1] for row in found["step"]["rows"]}
    numba, own = (next(cost for name, cost in costs.items() if words in name) for words in ("leapfrog", "loop"))
    return (
        f"* **The numba leapfrog is faster than the package's solver**: {_span(half)} times with 64 and 250 springs "
        f"for 5 s at 50 µm/s, and {_span(fast)} times at higher velocities; at 10 µm/s the solver is {_than(few)} "
        "(64 springs). "
        f"A [step](#what-a-step-costs) of the package's solver takes {own} µs with 64 springs, one of the leapfrog "
        f"{numba} µs; the solver takes fewer. It has derivatives, effects as small classes, error control, steps "
        "that grow in holds and slow creep, and springs grouped in bins; with these it is faster from some 1000 "
        "springs on."
    )


def _span(values: Iterable[float]) -> str:
    low, high = min(values := list(values)), max(values)
    return f"{low:.2g}" if f"{low:.1g}" == f"{high:.1g}" else f"{low:.2g} to {high:.2g}"


def _leapfrog(found: dict[str, Any]) -> tuple[str, str, str, str]:
    runs = _runs(found)
    half = [1.0 / _over_leapfrog(r) for (v, _, n), r in runs.items() if v == HALF_SLOW and n in (64, 250)]
    fast = [1.0 / _over_leapfrog(r) for (v, _, _), r in runs.items() if v > HALF_SLOW]
    own, leapfrog = ({p["size"]: p["processor_s"] for p in s} for s in found["drive"]["series"].values())
    many = [leapfrog[v] / own[v] for v in own if HALF_SLOW <= v <= 7e-4]
    told = "; ".join(
        f"{_between(ratios)} ({where})"
        for ratios, where in (
            (half, "64 and 250 springs, 50 µm/s"),
            (fast, "64 springs, 200 and 700 µm/s"),
            (many, "256 springs, 100 to 700 µm/s"),
        )
    )
    reached = _yes(min(*half, *fast, *many) >= 1.0)
    return "solvers", "not slower than a numba leapfrog, 64 and 250 springs, 50 to 700 µm/s", told, reached


def _slowly(found: dict[str, Any]) -> tuple[str, str, str, str]:
    few = next(1.0 / _over_leapfrog(r) for (v, _, _), r in _runs(found).items() if v == SLOW)
    own, leapfrog = (
        next(p["processor_s"] for p in points if p["size"] == SLOW) for points in found["drive"]["series"].values()
    )
    many = leapfrog / own
    told = f"{_than(few)} with 64 springs, {_than(many)} with 256"
    return "solvers", "3 times faster than the leapfrog at 10 µm/s", told, _yes(min(few, many) >= 3.0)


def _holds(found: dict[str, Any]) -> tuple[str, str, str, str]:
    own, leapfrog = found["holds"]["series"].values()
    ratios = [b["processor_s"] / a["processor_s"] for a, b in zip(own, leapfrog, strict=True)]
    told = ", ".join(f"{_than(r)} ({point['size']:g} s)" for point, r in zip(own, ratios, strict=True))
    return (
        "holds",
        "3 times faster than the leapfrog with holds",
        told,
        f"in {sum(r >= 3.0 for r in ratios)} of {len(ratios)}",
    )


def _many_springs(found: dict[str, Any]) -> tuple[str, str, str, str]:
    bins, _, leapfrog = ({p["size"]: p["processor_s"] for p in s} for s in found["springs"]["series"].values())
    ratio = leapfrog[4000] / bins[4000]
    told = f"{_than(ratio)}, in bins"
    return "springs", "5 times faster than the leapfrog with 4000 springs", told, _yes(ratio >= 5.0)


def _peers(found: dict[str, Any]) -> Iterable[tuple[str, str, str, str]]:
    for aim, wanted, prefix in (
        ("100 times faster than the best of scipy", 100.0, "scipy"),
        ("5 times faster than diffrax's Tsit5", 5.0, "diffrax Tsit5"),
    ):
        told, reached, known = [], 0, 0
        for (v, events, springs), runs in sorted(_runs(found).items(), key=lambda item: (item[0][1], item[0][0])):
            if springs != 64:
                continue
            peers = [r for name, r in runs.items() if name.startswith(prefix)]
            ended = [r["processor_s"] for r in peers if r["enough"]]
            # one that was stopped takes longer than it was given
            given = min(r.get("limit_s", found["solvers"]["limit_s"]) for r in peers)
            ratio = (min(ended) if ended else given) / runs["own"]["processor_s"]
            size = f"{ratio:.0f}" if ratio >= 100.0 else f"{ratio:.2g}"
            what = f"{'' if ended else 'over '}{size}" if ended or ratio > 1.0 else "stopped too early to know"
            told.append(f"{what} ({events} at {1e6 * v:g} µm/s)")
            reached += ratio >= wanted
            known += bool(ended) or ratio >= wanted
        counted = f"in {reached} of {len(told)}" + (f", {len(told) - known} not known" if known < len(told) else "")
        yield "solvers", f"{aim}, 64 springs (events at a velocity)", ", ".join(told), counted


def _onsets(found: dict[str, Any]) -> tuple[str, str, str, str]:
    points = found["events"]["series"]["own, at the tolerance of the longest run"]
    worst, slope = max(points, key=lambda p: p["size"]), points[0]["slope"]
    each = found["events"]["series"]["own, every onset to 0.001 of the period"][0]["slope"]
    runs = {events: r["own"] for (_, events, _), r in _runs(found).items() if events >= 50}
    grown = log(runs[1000]["processor_s"] / runs[50]["processor_s"]) / log(20.0)
    told = (
        f"largest error of {worst['events']} onsets {tables.power(worst['onset'])}; at this tolerance "
        f"(default/{worst['setting'].partition('/')[2]}) the cost is as events^{slope:.2f}; at the tolerance that is "
        f"just fine enough for the number of events as ^{each:.2f} up to 100, ^{grown:.1f} from 50 to 1000"
    )
    linear = worst["onset"] < 1e-3 and slope < 1.05
    reached = "yes, at one tolerance" if linear else "no"
    return "events", "every onset of 1000 to 0.001 of the period, cost linear in events", told, reached


def _orders(found: dict[str, Any]) -> tuple[str, str, str, str]:
    part = found["orders"]
    column = next(i for i, name in enumerate(part["columns"]) if "order" in name)
    orders = {row[0]: float(row[column]) for row in part["rows"]}
    told = ", ".join(f"{name} {order:.2f}" for name, order in orders.items())
    inside = all(1.85 <= order <= 2.15 for order in orders.values())
    return "orders", "order of convergence 1.85 to 2.15 in every event quantity", told, _yes(inside)


def _energy(found: dict[str, Any]) -> tuple[str, str, str, str]:
    part = found["energy"]
    usual, scenario = (float(row[1]) for row in part["rows"][:2])
    told = f"{tables.power(usual)}; at the default of a scenario {tables.power(scenario)}"
    reached = "at that of a scenario" if scenario <= 1e-6 < usual else _yes(usual <= 1e-6)
    return "energy", "energy balance to 10⁻⁶ at the default tolerance", told, reached


def _same(found: dict[str, Any]) -> tuple[str, str, str, str]:
    apart = found["batches"].get("largest_difference_m", {})
    told = ", ".join(f"{name}: {'bit for bit' if gap == 0.0 else f'{1e9 * gap:.2g} nm'}" for name, gap in apart.items())
    return (
        "batches",
        "the same numbers in batches, to rounding",
        told,
        "by processes" if apart.get("processes") == 0.0 else "no",
    )


def _velocities(found: dict[str, Any]) -> tuple[str, str, str, str]:
    slope = found["drive"]["series"]["own"][0]["slope"]
    return "drive", "cost sublinear in 1/v₀", f"(1/v₀)^{-slope:.2f} from 10 to 700 µm/s", _yes(-slope < 1.0)


def _springs(found: dict[str, Any]) -> tuple[str, str, str, str]:
    slope = found["springs"]["series"]["own, every spring an element"][0]["slope"]
    return (
        "springs",
        "cost sublinear in the number of springs",
        f"constant with bins, springs^{slope:.2f} without",
        _yes(slope < 1.0),
    )


def _rigs(found: dict[str, Any]) -> tuple[str, str, str, str]:
    rows = {row[0]: row for row in found["many"]["rows"]}
    one, two = rows["one process"], rows["two processes"]
    room = f"{two[4]} MiB more in the calling process, at most {two[5]} MiB on disk"
    told = f"{two[2]} ms a rig with two processes ({one[2]} with one); {room}"
    return "many", f"{int(two[1]) // 1000} 000 rigs by `ss.sweep`, bounded memory", told, _yes(float(two[4]) < 200.0)


def _gpu(found: dict[str, Any]) -> tuple[str, str, str, str]:
    vmap = next(row[3] for row in found["batches"]["rows"] if row[0].startswith("vmap"))
    told = f"not measured, for want of one; on a processor a run of such a batch takes {vmap} times as long as alone"
    return "batches", "a batch on a GPU 50 times faster than one core", told, "not known"


def _writing(found: dict[str, Any]) -> tuple[str, str, str, str]:
    seconds = {row[0]: float(row[2]) for row in found["writing"]["rows"]}
    told = ", ".join(f"{name} {value:g} s" for name, value in seconds.items())
    reached = "yes" if max(seconds.values()) < 1.0 else "by " + ", ".join(n for n, s in seconds.items() if s < 1.0)
    return "writing", "10⁶ samples written in 1 s", told, reached


def _simulate(found: dict[str, Any]) -> tuple[str, str, str, str]:
    first, second = (_wall(found, name) for name in ("nothing compiled before", "the same again"))
    told = (
        f"{second:.1f} s and {first:.1f} s; importing JAX and its libraries takes "
        f"{_wall(found, 'importing JAX'):.1f} s, with the package {_wall(found, 'importing `stickslip'):.1f} s"
    )
    return "command-line", "second `simulate` under 1.2 s, first under 4 s", told, _yes(second < 1.2 and first < 4.0)


def _help(found: dict[str, Any]) -> tuple[str, str, str, str]:
    wall = _wall(found, "--help")
    return "command-line", "`--help` under 0.2 s", f"{wall:.2f} s", _yes(wall < 0.2)


def _wall(found: dict[str, Any], name: str) -> float:
    """Wall time (s) of a command."""
    return next(float(row[2]) for row in found["command-line"]["rows"] if name in row[0])


def _fits(found: dict[str, Any]) -> tuple[str, str, str, str]:
    first, again = (float(row[1]) for row in found["fits"]["rows"])
    told = f"{again:.2g} s of processor time, {first:.2g} s with compiling"
    return "fits", "27 static data sets fitted in 2 s after compilation", told, _yes(again < 2.0)


def _diagnosis(found: dict[str, Any]) -> tuple[str, str, str, str]:
    (_, cpu_empty, empty, _), (_, cpu, kept, _), _ = found["diagnosis"]["rows"]
    told = f"{kept} s, {cpu} s of processor time; the first time, with an empty cache, {empty} s, {cpu_empty} s of it"
    aim = "diagnosis with the whole catalogue in 60 s on two processors, 90 s the first time"
    return "diagnosis", aim, told, _yes(float(kept) < 60.0 and float(empty) < 90.0)


def _memory(found: dict[str, Any]) -> tuple[str, str, str, str]:
    used = float(found["diagnosis"]["rows"][-1][-1]) / 1024.0
    told = f"{used:.1f} GiB at most, in one process (largest resident set)"
    return "diagnosis", "diagnosis with the whole catalogue in 2 GB", told, _yes(used * 1.073741824 < 2.0)


def _inspected(found: dict[str, Any]) -> tuple[str, str, str, str]:
    memory = {row[0].partition(",")[0]: float(row[2]) for row in found["inspect"]["rows"]}
    told = ", ".join(f"{size:.0f} MiB from {name}" for name, size in memory.items())
    return "inspect", "10⁷ samples inspected under 1 GB", told, _yes(max(memory.values()) < 1e9 / 2**20)


def _date(part: dict[str, Any]) -> str:
    return str(part["date"]).replace("-", "‑")


def _command(part: dict[str, Any]) -> str:
    return f"`{part['command']}`"
