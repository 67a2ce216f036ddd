"""A score as text: every figure with its interval, every wrong answer with its reason."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from .figures import VERDICTS, WORDS

WIDTH = 110
_CIRCUMSTANCES = {
    "spring_known": ("spring known", "spring not known"),
    "virgin": ("contact never loaded before", "contact loaded before"),
    "new_lines": ("new lines at every event", "the same lines at every event"),
}


def share(found: Mapping[str, Any]) -> str:
    """A rate with its interval: ``12/15  80 % (55-93)``."""
    if not found["of"]:
        return "-"
    number = f"{found['count']}/{found['of']}"
    return f"{number:>6} {100 * found['share']:3.0f} % ({100 * found['low']:.0f}-{100 * found['high']:.0f})"


def score_text(score: Mapping[str, Any]) -> str:
    """The whole score for a person; intervals are Wilson's at 95 %."""
    s = score
    lines = [
        f"Challenge of {s['cases']} cases, seed {s['seed']}",
        f"seal {s['seal']}",
        *(_own(s) if "answers" in s else _run(s)),
        "",
        *_aims(s["aims"]),
        *_block(
            "What was hidden", ("exact", "right", "class"),
            [
                (WORDS.get(name, name), [share(row[k]) for k in ("exact", "right", "class")])
                for name, row in [*s["by_kind"].items(), ("one or two effects", s["effects"])]
            ],
        ),
        *_block(
            "Times detection", ("right", "exact", "class", "unknown, outside"),
            [(_edge(b), [share(b["right"]), share(b["exact"]), share(b["class"]), share(b["unknown_recall"])])
             for b in s["by_amplitude"]],
        ),
        *_block(
            "Times detection",
            ("amplitude in 2", "within 2 s.d.", "right if named", "held-out / base, named", "within 1.5"),
            [(_edge(b), [share(b["amplitude"]), share(b["within_2_std"]), share(b["named_right"]),
                         _middle(b["heldout_named"]["ratio"]), share(b["heldout_right"])]) for b in s["by_amplitude"]],
        ),
        *_block("Circumstance", ("exact", "right", "false alarms"), [
            (words[value == "no"], [share(row[k]) for k in ("exact", "right", "false_alarms")])
            for name, words in _CIRCUMSTANCES.items()
            for value, row in s["by_circumstance"][name].items()
        ]),
        *_block("One effect", ("exact", "right"), [
            (name.replace("_", " "), [share(row[k]) for k in ("exact", "right")]) for name, row in s["by_form"].items()
        ]),
        *_block("Effect", ("precision", "recall", "support"), [
            (name, [share(row["precision"]), share(row["recall"]), str(row["recall"]["of"])])
            for name, row in s["by_effect"].items()
        ]),
        *_confusion(s),
        *_confidence(s),
        *_block("Nothing missing, and outside", ("share",), [
            ("false alarms (not called complete)", [share(s["false_alarms"])]),
            ("effects named where nothing is missing", [share(s["false_names"])]),
            ("unknown recall", [share(s["unknown_recall"])]),
            ("unknown recall, and no effect named", [share(s["unknown_without_a_name"])]),
        ]),
        *_block("Held-out error in floors: median (quartiles)", ("base", "last model", "ratio", "within 1.5"), [
            (WORDS.get(name, "right answers"),
             [_middle(row["base"]), _middle(row["final"]), _middle(row["ratio"]), share(row["within"])])
            for name, row in s["heldout"].items()
        ]),
        *_block("Amplitude within a factor of two", ("share",), [
            (name.replace("_", " "), [share(row)]) for name, row in s["amplitude"].items()
        ]),
        *_calibration(s["calibration"]),
        *_wrong(s["list"]),
    ]  # fmt: skip
    return "\n".join(line.rstrip() for line in lines).rstrip() + "\n"


def _own(s: Mapping[str, Any]) -> list[str]:
    """Whose answers these are, if not of the challenge's run."""
    record = s["answers"]
    lines = [] if record is None else [f"answers of {record['file']}", f"SHA-256 {record['sha256']}"]
    return [f"{s['finished']} answered, {s['not_run']} not (these count as wrong)", *lines]


def _run(s: Mapping[str, Any]) -> list[str]:
    """How the cases were run."""
    p = s["protocol"]
    return [
        f"{s['finished']} diagnosed, {s['failed']} failed, {s['not_run']} not run (both count as wrong)",
        f"stickslip {p['versions'].get('stickslip', '?')}, at most {p['max_effects']} effects, "
        f"candidates: {', '.join(p['candidates'] or []) or 'the whole catalogue'}",
        *_codes(p),
    ]


def _codes(protocol: Mapping[str, Any]) -> list[str]:
    """A line where not all cases were diagnosed by the same code."""
    number = sum(bool(cases) for cases in protocol.get("codes", {}).values())
    return [f"run by {number} versions of the code"] if number > 1 else []


def _edge(b: Mapping[str, Any]) -> str:
    return f"{b['from']:g} to {b['to']:g}"


def _middle(quartiles: Sequence[float] | None) -> str:
    if quartiles is None:
        return "-"
    low, middle, high = quartiles
    return f"{middle:.3g} ({low:.3g}-{high:.3g})"


def _block(title: str, heads: Sequence[str], rows: Sequence[tuple[str, list[str]]], width: int = 20) -> list[str]:
    first = max(len(title), *(len(name) for name, _ in rows)) + 2
    widths = [max(width, len(head) + 2) for head in heads]
    lines = [(title, heads), *rows]
    return [*(name.ljust(first) + "".join(map(str.rjust, cells, widths)) for name, cells in lines), ""]


def _aims(aims: Sequence[Mapping[str, Any]]) -> list[str]:
    out = []
    for aim in aims:
        met = {None: "no case", True: "met" if aim["shown"] else "met, not shown", False: "MISSED"}[aim["met"]]
        bound = f"at least {100 * aim['at_least']:.0f} %" if aim["at_least"] is not None else ""
        bound = bound or f"at most {100 * aim['at_most']:.0f} %"
        out.append(f"aim {met}: {aim['text']}: {share(aim).strip()}, {bound}")
    return [*out, ""]


def _confusion(s: Mapping[str, Any]) -> list[str]:
    """What was hidden against what was answered, by amplitude."""
    parts = [("", {"nothing": s["confusion"]["kinds"]["nothing"]})]
    parts += [(f", {_edge(b)} times", b["confusion"]["kinds"]) for b in s["by_amplitude"]]
    rows = [
        (f"{WORDS[kind]}{where}", [str(row[column]) if row.get(column) else "." for column in VERDICTS])
        for where, table in parts
        for kind, row in table.items()
        if row
    ]
    return _block("Hidden, and answered", VERDICTS, rows, 0) if rows else []


def _confidence(s: Mapping[str, Any]) -> list[str]:
    """Stated confidence against how often the claim is correct, by amplitude; nothing where no verdict states one."""
    parts = [(WORDS["nothing"], s["calibration"]["nothing"])]
    parts += [(f"{_edge(b)} times detection", b["confidence"]) for b in s["by_amplitude"]]
    rows = [
        (name, [f"{100 * c['stated']:.0f} %", share(c["holds"]), f"{c['brier']:.3f}"])
        for name, c in parts
        if c["stated"] is not None
    ]
    return _block("Confidence", ("stated, mean", "claim correct", "Brier score"), rows) if rows else []


def _calibration(found: Mapping[str, Any]) -> list[str]:
    rows = [(f"verdict '{kind}' is right", [share(row)]) for kind, row in found["by_verdict"].items()]
    for name, text in (("within_1_std", "1 s.d."), ("within_2_std", "2 s.d.")):
        expected = 100 * found[name]["expected"]
        rows.append((f"true amplitude within {text} (should be {expected:.0f} %)", [share(found[name])]))
    if found["brier"] is not None:
        rows.append(("Brier score of stated confidence", [f"{found['brier']:.3f}"]))
        rows += [
            (f"stated {100 * r['stated']:.0f} % on average: claim correct", [share(r["holds"])])
            for r in found["reliability"]
            if r["stated"] is not None
        ]
    return _block("Calibration", ("share",), rows)


def _wrong(cases: Sequence[Mapping[str, Any]]) -> list[str]:
    wrong = [case for case in cases if not case["right"]]
    out = [f"Wrong or missing answers ({len(wrong)} of {len(cases)})"]
    for case in wrong:
        hidden = " + ".join(f"{h['tag']} ({h['form']}) at {h['multiple']:.1f} x detection" for h in case["hidden"])
        given = " ".join([case["answer"], ", ".join(case["set"] or case["named"])]).strip()
        head = f"  {case['case']}  {hidden or 'nothing missing'}  ->  {given}"
        out += [head, *textwrap.wrap(case["text"], WIDTH, initial_indent="      ", subsequent_indent="      ")]
    again = [case for case in cases if case["failed_before"]]
    if again:
        told = ", ".join(f"{c['case']} ({c['failed_before']})" for c in again)
        out += ["", *textwrap.wrap(f"Failed attempts (how many): {told}", WIDTH)]
    return out
