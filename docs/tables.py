"""Tables of the pages, drawn from the files in docs/results.

Every part has the version that was measured, the date, and the command of the script that writes it (by
``tests/kept_results.py``). A page draws its tables from them in a code cell:
``tables.solvers(tables.part("performance", "solvers"))``. What has not been measured yet is said.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from stickslip.blind.detection import detection
from stickslip.blind.generator import CATALOGUED, EFFECTS

RESULTS = Path(__file__).resolve().parent / "results"
MISSING = "*Not measured yet.*"
PARTS = {
    "one": "one effect, at ten times its detection limit",
    "strong": "one effect, at the largest plausible amplitude",
    "two": "two effects",
    "left-out": "one effect, which is left out of the catalogue",
    "nothing": "nothing hidden",
}
RARE = 0.01  # p-value below which ranks are said not to be uniform
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
Rows = Iterable[Sequence[object]]


def results(name: str) -> dict[str, Any]:
    """A file of results; empty where it has not been written."""
    path = RESULTS / f"{name}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found


def part(name: str, key: str) -> dict[str, Any]:
    """A part of a file of results; empty where it has not been measured."""
    found: dict[str, Any] = results(name).get(key) or {}
    return found


def table(columns: Sequence[str], rows: Rows) -> str:
    """A table in Markdown; columns in which every cell is empty are left out."""
    body = [["" if c is None else str(c).replace("|", r"\|") for c in row] for row in rows]
    kept = [i for i in range(len(columns)) if not body or any(row[i] for row in body)]
    lines = [columns, ["---"] * len(columns), *body]
    return "\n".join("| " + " | ".join(line[i] for i in kept) + " |" for line in lines)


def source(found: dict[str, Any]) -> str:
    """Where a table comes from, as the line under it."""
    seed = f", seed {found['seed']}" if "seed" in found else ""
    parts = [f"Version {found['version']}, {found['date']}{seed}", found.get("machine"), _code(found.get("command"))]
    return f"*{'; '.join(p for p in parts if p)}.*"


def _code(command: str | None) -> str | None:
    return f"`{command}`" if command else None


def power(x: float, digits: int = 1) -> str:
    """2.2 · 10⁻⁴ for 2.2e-4."""
    mantissa, exponent = f"{x:.{digits}e}".split("e")
    return f"{mantissa} · 10{str(int(exponent)).translate(SUPERSCRIPT)}"


def chance(p: float) -> str:
    """A p-value: two digits after the point, or a power of ten where these would say nothing."""
    return f"{p:.2f}" if p >= RARE else power(p)


def _drawn(draw: Callable[[dict[str, Any]], str]) -> Callable[[dict[str, Any]], str]:
    """A table with its source, or a word that it is missing."""

    def with_source(found: dict[str, Any]) -> str:
        return f"{draw(found)}\n\n{source(found)}" if found else MISSING

    with_source.__doc__ = draw.__doc__
    return with_source


# --- diagnosis --------------------------------------------------------------------------------------------------------


def rates(found: dict[str, Any]) -> str:
    """How often a diagnosis is right, a column for each part of ``development.json`` and a row for each rate."""
    names = list(dict.fromkeys(name for key in PARTS for name in (found.get(key) or {}).get("rates", {})))
    if not names:
        return MISSING
    parts = {key: found[key] for key in PARTS if found.get(key)}
    rows: list[list[object]] = [["campaigns", *(len(part["cases"]) for part in parts.values())]]
    counted = [[name, *(rate(part["rates"].get(name)) for part in parts.values())] for name in names]
    rows += [row for row in counted if any(row[1:])]
    lacking = [words for key, words in PARTS.items() if key not in parts]
    sources = [f"`{k}` version {p['version']}, {p['date']}, seed {p['seed']}" for k, p in parts.items()]
    end = f" Not measured yet: {'; '.join(lacking)}." if lacking else ""
    return table(["hidden", *(PARTS[k] for k in parts)], rows) + f"\n\n*Parts: {'; '.join(sources)}.{end}*"


def rate(found: dict[str, Any] | None) -> str:
    """A count with its interval; nothing where there was nothing to count."""
    if not found or not found["of"]:
        return ""
    interval = f" ({100 * found['low']:.0f} to {100 * found['high']:.0f} %)" if found.get("low") is not None else ""
    return f"{found['count']} of {found['of']}{interval}"


@_drawn
def cases(found: dict[str, Any]) -> str:
    """Every campaign of a part: hidden effects, answer, and the fall of the error on unseen runs."""
    return table(
        [
            "hidden",
            "rough lines",
            "amplitude / detection limit",
            "margin",
            "answer",
            "named, or the set",
            "error on unseen runs / floors",
        ],
        [
            [
                ", ".join(case["hidden"]) or "nothing",
                case["lines"],
                ", ".join(f"{m:.3g}" for m in case["multiples"]),
                "" if case.get("margin") is None else f"{case['margin']:.3g}",
                f"`{case['kind']}`",
                ", ".join(case["set"] or case["named"]),
                " → ".join(f"{e:.2f}" for e in case["unseen"] if e is not None),
            ]
            for case in found["cases"]
        ],
    )


HIDDEN = {
    "nothing": "nothing", "one": "one effect", "two": "two effects", "outside": "an effect outside the catalogue",
}  # fmt: skip


@_drawn
def sealed(found: dict[str, Any]) -> str:
    """A sealed run: rates by what was hidden and by amplitude, the targets, and every case."""
    shares = ("exact", "right", "class")
    rows: list[list[object]] = [[HIDDEN[k], *(rate(row[s]) for s in shares)] for k, row in found["by_kind"].items()]
    for b in found["by_amplitude"]:
        times = f"one or two effects, {b['from']:g} to {b['to']:g} times detection"
        rows.append([times, *(rate(b[s]) for s in shares)])
    sizes, alarms = rate(found["amplitude"]["all"]), rate(found["false_alarms"])
    head = ["hidden (times detection)", "answer", "named, and the set", "right", "error on unseen runs / floors"]
    parts = [
        table(["hidden", *shares], [row for row in rows if any(row[1:])]),
        f"Amplitudes within a factor of two: {sizes}. False alarms: {alarms}.",
        table(["target", "found", ""], [[aim["text"], rate(aim), _met(aim)] for aim in found["aims"]]),
        table(head, map(_sealed_case, found["list"])),
    ]
    return "\n\n".join(parts)


def _met(aim: dict[str, Any]) -> str:
    if aim["met"] is None:
        return ""
    return ("met" if aim["shown"] else "met, not shown") if aim["met"] else "MISSED"


def _sealed_case(case: dict[str, Any]) -> list[object]:
    hidden = [f"{e['tag']} ({e['multiple']:.3g})" if e["multiple"] else e["tag"] for e in case["hidden"]]
    errors = [f"{e:.2f}" for e in (case["heldout_base"], case["heldout_final"]) if e is not None]
    return [
        ", ".join(hidden) or "nothing", f"`{case['answer']}`", ", ".join(dict.fromkeys([*case["named"], *case["set"]])),
        "yes" if case["right"] else "no", " → ".join(errors),
    ]  # fmt: skip


@_drawn
def ranks(found: dict[str, Any]) -> str:
    """How well the posterior contains the true values, a row for each parameter of ``posterior.json``."""
    rows = [
        [f"`{name}`", chance(p["chance"]), *(f"{100 * share:.0f} %" for share in p["within"].values()),
         f"{p['mean off']:+.2f} ± {found['campaigns'] ** -0.5:.2f}", f"{p['of the fit']:.2f}"]
        for name, p in found["parameters"].items()
    ]  # fmt: skip
    shares = next(iter(found["parameters"].values()))["within"]
    within = [f"in the {share.replace('%', ' %')} interval" for share in shares]
    head = ["parameter", "p-value of uniform ranks", *within, "mean error / std", "std / that of the fit"]
    return table(head, rows)


def biases(found: dict[str, Any]) -> str:
    """Parameters whose ranks are not uniform, and by how many standard deviations they are off in the mean."""
    off = {name: p["mean off"] for name, p in found["parameters"].items() if p["chance"] < RARE}
    ratios = [p["of the fit"] for p in found["parameters"].values()]
    error = found["campaigns"] ** -0.5
    words = (
        f"With {found['campaigns']} rigs no deviation from uniform ranks is detected (p-value below {RARE:g}). A mean "
        f"error of {2.0 * error:.1f} standard deviations would be two standard errors."
    )
    if far := {name: p["mean off"] for name, p in found["parameters"].items() if abs(p["mean off"]) > 2.0 * error}:
        words += f" It is larger for {', '.join(f'`{name}` with {x:+.2f}' for name, x in far.items())}."
    if off:
        told = ", ".join(f"`{name}` is {x:+.1f}" for name, x in off.items())
        words = (
            f"The ranks of {len(off)} of {len(ratios)} parameters are not uniform (p-value below {RARE:g}). In the "
            f"mean {told} standard deviations off."
        )
    return f"{words} The standard deviation of the draws is {min(ratios):.1f} to {max(ratios):.1f} times that of a fit."


@_drawn
def experiments(found: dict[str, Any]) -> str:
    """Sets of ambiguous campaigns, the proposed experiment, and what is named with its run (``ambiguous.json``)."""

    def tags(names: Sequence[str]) -> str:
        return ", ".join(f"`{name}`" for name in names)

    rows = []
    for c in found["cases"]:
        if c["before"] == "ambiguous":
            others = tags([tag for tag in c["set"] if tag != c["hidden"]]) or "a wrong entry of the rig"
            within = "" if c["hidden"] in c["set"] else " (without the hidden effect)"
            left = tags(c["left"]) or f"none, `{c['after']}`" if "left" in c else ""
            made = c["experiment"] or "none of the drive alone" if "experiment" in c else "not made"
            rows.append([f"`{c['hidden']}`", others + within, made, left])
    made, alone, sets = found["made"], found["alone"], [c for c in found["cases"] if c["before"] == "ambiguous"]
    low, high = (100 * end for end in binomtest(alone, made).proportion_ci(0.95, method="wilson"))
    lacking = sum(c["hidden"] not in c["set"] for c in sets)
    wrong = sum(c["set"] == [c["hidden"]] for c in sets)  # the rival is an entry of the rig
    told = (
        f"Of {found['campaigns']} campaigns {len(sets)} end with a set. For {made} of them such an experiment is "
        f"proposed and made. In {alone} of these only this one remains: {100 * alone / made:.0f} %, with Wilson's "
        f"interval at 95 % from {low:.0f} to {high:.0f} %; the target is 80 %. Of all {len(sets)} sets these are "
        f"{100 * alone / len(sets):.0f} %. The other {len(sets) - made} were not tested: in {lacking} the hidden "
        f"effect is missing; in {wrong} the rival is a wrong entry of the rig, for which none is proposed; for "
        f"{len(sets) - made - lacking - wrong} no experiment of the drive alone makes the true model twice as likely "
        "within 30 s (others change mass, spring or load, which this test does not make). "
        f"Experiments that were made: {', '.join(dict.fromkeys(c['experiment'] for c in sets if 'left' in c))}."
    )
    return f"{told}\n\n{table(['hidden', 'others in the set', 'proposed experiment', 'named with its run'], rows)}"


def largest_multiples(below: float = 10.0) -> str:
    """Effects of the challenge that do not reach a multiple of their detection limit in some form."""
    rows = []
    for tag, effect in EFFECTS.items():
        most = {form.name: effect.high / detection(effect, form.name) for form in effect.forms}
        if min(most.values()) < below:
            outside = "" if tag in CATALOGUED else " (outside the catalogue)"
            forms = ", ".join(f"{name} {multiple:.2g}" for name, multiple in most.items())
            rows.append((min(most.values()), [f"`{tag}`{outside}", forms]))
    return table(["effect", "largest multiple, by form"], [row for _, row in sorted(rows)])


# --- performance ------------------------------------------------------------------------------------------------------


@_drawn
def plain(found: dict[str, Any]) -> str:
    """A table as it was printed."""
    return table(found["columns"], found["rows"])


@_drawn
def by_springs(found: dict[str, Any]) -> str:
    """Solvers against the number of springs, at the drive that most runs have."""
    runs = [r for r in found["runs"] if r["velocity"] == 5e-5]
    sizes = sorted({r["springs"] for r in runs})
    rows = []
    for solver in dict.fromkeys(r["solver"] for r in runs):
        own = {r["springs"]: r for r in runs if r["solver"] == solver}
        first = own[sizes[0]]
        off = [
            power(first["onset"]) if "onset" in first else "",
            f"{first['creep_nm']:.2f}" if "creep_nm" in first else "",
        ]
        rows.append([solver, *(_seconds(own.get(n), found) for n in sizes), *off])
    last = [f"onset ({sizes[0]}), share of the period", f"creep ({sizes[0]}), nm"]
    return table(["solver", *(f"{n} springs" if n == sizes[0] else str(n) for n in sizes), *last], rows)


@_drawn
def by_drive(found: dict[str, Any]) -> str:
    """Solvers against the drive and the number of events, with the fewest springs."""
    runs = [r for r in found["runs"] if r["velocity"] != 5e-5]
    drives = list(dict.fromkeys((r["velocity"], r["events"]) for r in runs))
    rows = []
    for solver in dict.fromkeys(r["solver"] for r in runs):
        own = {(r["velocity"], r["events"]): r for r in runs if r["solver"] == solver}
        rows.append([solver, *(_seconds(own.get(d), found, setting=True) for d in drives)])
    return table(["solver", *(f"{v * 1e6:g} µm/s, {n} event{'s' * (n > 1)}" for v, n in drives)], rows)


def _seconds(run: dict[str, Any] | None, found: dict[str, Any], setting: bool = False) -> str:
    """Processor seconds of a run, and its error where it is not accurate enough."""
    if run is None:
        return ""
    seconds = run["processor_s"]
    if seconds is None:
        why = run.get("why", "").removeprefix("reached ")
        return f"over {run.get('limit_s', found['limit_s']):.3g}" + (f" ({why})" if why else "")
    text = "below 0.001" if seconds < 5e-4 else f"{seconds:.3g}"
    if setting and run["setting"]:
        text += f" ({run['setting']})"
    return text if run["enough"] else f"{text}; onset error {power(run['onset'], 0)}"


@_drawn
def sizes(found: dict[str, Any]) -> str:
    """Processor seconds against a size, a column for each way."""
    series = found["series"]
    numbers = sorted({p["size"] for points in series.values() for p in points})
    factor = 1e6 if numbers[-1] < 1.0 else 1.0  # velocities
    rows = []
    for n in numbers:
        at = [next((p for p in points if p["size"] == n), None) for points in series.values()]
        rows.append([f"{factor * n:g}", *("" if p is None else f"{p['processor_s']:.3g}" for p in at)])
    slopes = [points[0].get("slope") for points in series.values()]
    rows.append(["slope", *("" if s is None else f"{round(s, 2) + 0.0:.2f}" for s in slopes)])
    return table(["µm/s" if factor > 1.0 else found.get("size", "number"), *(f"{name}, s" for name in series)], rows)
