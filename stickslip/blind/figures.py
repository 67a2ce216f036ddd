"""The figures of a score, from the marks of its cases."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from .answers import KINDS as ANSWERS
from .case_scores import CIRCUMSTANCES, Marked, rate
from .sizes import Size

KINDS = ("nothing", "one", "two", "outside")
WORDS = {"nothing": "nothing missing", "one": "one effect", "two": "two effects", "outside": "outside the catalogue"}
VERDICTS = (
    "complete", "named", "named in part", "set with it", "named wrongly", "set without it", "unknown", "failed",
    "not run",
)  # fmt: skip
BINS = (1.0, 2.0, 5.0, 10.0, 30.0)  # multiples of detection
VISIBLE = 5.0  # multiples of detection from which the aim holds
WITHIN = 1.5  # floors


def figures(marked: Sequence[Marked]) -> dict[str, Any]:
    """All figures of a score."""
    if not marked:
        raise InputError("there are no cases to score")
    of = {kind: [m for m in marked if m.kind == kind] for kind in KINDS}
    hidden = of["one"] + of["two"]
    states = Counter(m.answer.kind for m in marked)
    return {
        "cases": len(marked),
        "finished": len(marked) - states["failed"] - states["not run"],
        "failed": states["failed"],
        "not_run": states["not run"],
        "by_kind": {kind: _accuracy(cases) for kind, cases in of.items()},
        "effects": _accuracy(hidden),
        "by_effect": _by_effect(marked),
        "by_circumstance": {name: _circumstance(name, of["nothing"], hidden) for name in CIRCUMSTANCES},
        "by_form": {
            "textbook_form": _accuracy([m for m in of["one"] if not m.effects[0]["own_form"]]),
            "own_form": _accuracy([m for m in of["one"] if m.effects[0]["own_form"]]),
        },
        "false_alarms": _alarms(of["nothing"]),
        "false_names": rate(m.names for m in of["nothing"] if m.answered),
        "unknown_recall": rate(m.answer.kind == "unknown" for m in of["outside"]),
        "unknown_without_a_name": rate(m.answer.kind == "unknown" and not m.answer.named for m in of["outside"]),
        "amplitude": {
            "all": _sizes(hidden, lambda s: True),
            "textbook_form": _sizes(hidden, lambda s: not s.own_form),
            "own_form": _sizes(hidden, lambda s: s.own_form),
        },
        "heldout": {kind: _heldout(cases) for kind, cases in {**of, "right": _explained(marked)}.items()},
        "calibration": _calibration(marked),
        "by_amplitude": [_bin(low, high, hidden, of["outside"]) for low, high in itertools.pairwise(BINS)],
        "confusion": _confusion(marked),
        "aims": _aims(of["nothing"], hidden, marked),
        "list": [_line(m) for m in marked],
    }


def _accuracy(cases: Sequence[Marked]) -> dict[str, Any]:
    return {
        "exact": rate(m.exact for m in cases),
        "right": rate(m.right for m in cases),
        "class": rate(m.class_right for m in cases),
    }


def _by_effect(marked: Sequence[Marked]) -> dict[str, dict[str, Any]]:
    """Precision and recall of every effect that is hidden or named, of all together, and of the other two answers.

    An effect is named where it is said to be missing; one of a set is not. The support is what the recall is of.
    """
    cases = [(m, set(m.answer.named) if m.answer.kind == "missing" else set()) for m in marked]
    tags = {tag for m, named in cases for tag in (*(m.tags if m.kind != "outside" else ()), *named)}
    pairs = {tag: [(tag in m.tags, tag in named) for m, named in cases] for tag in sorted(tags)}
    return {
        **{tag: _precision(of_tag) for tag, of_tag in pairs.items()},
        "all effects": _precision([pair for of_tag in pairs.values() for pair in of_tag]),
        "nothing missing": _precision([(m.kind == "nothing", m.answer.kind == "complete") for m in marked]),
        "outside the catalogue": _precision([(m.kind == "outside", m.answer.kind == "unknown") for m in marked]),
    }


def _precision(pairs: Sequence[tuple[bool, bool]]) -> dict[str, Any]:
    """Of pairs of what is so and what was said."""
    return {"precision": rate(so for so, said in pairs if said), "recall": rate(said for so, said in pairs if so)}


def _alarms(nothing: Sequence[Marked]) -> dict[str, Any]:
    return rate(m.alarm for m in nothing if m.answered)


def _circumstance(name: str, nothing: Sequence[Marked], hidden: Sequence[Marked]) -> dict[str, Any]:
    """Answers where a circumstance holds and where it does not; cases of which it is not known are in neither."""
    out = {}
    for word, value in (("yes", True), ("no", False)):
        found = _accuracy([m for m in hidden if m.circumstances.get(name) is value])
        alarms = _alarms([m for m in nothing if m.circumstances.get(name) is value])
        out[word] = {"exact": found["exact"], "right": found["right"], "false_alarms": alarms}
    return out


def _sizes(cases: Sequence[Marked], which: Callable[[Size], bool]) -> dict[str, Any]:
    return rate(s.within_two for m in cases for s in m.sizes if which(s))


def _explained(marked: Sequence[Marked]) -> list[Marked]:
    """Right cases whose last model should be as good as the data allow."""
    return [m for m in marked if m.right and m.kind != "outside"]


def _heldout(cases: Sequence[Marked]) -> dict[str, Any]:
    """Quartiles of the held-out error before and after, and of their ratio."""
    falls = [m.fall for m in cases if m.fall is not None]
    known = [m for m in cases if m.answer.final is not None]
    stated = known or not any(m.answered for m in cases)  # another method states no errors
    return {
        "cases": len(falls),
        "base": _quartiles([m.answer.base for m in cases if m.answer.base is not None]),
        "final": _quartiles([m.answer.final for m in known if m.answer.final is not None]),
        "ratio": _quartiles(falls),
        "within": rate(m.answer.final is not None and m.answer.final <= WITHIN for m in (cases if stated else ())),
    }


def _quartiles(values: Sequence[float]) -> list[float] | None:
    return [float(q) for q in np.quantile(values, (0.25, 0.5, 0.75))] if values else None


def _confidence(cases: Sequence[Marked]) -> dict[str, Any]:
    """Confidences stated in these cases: their mean, how often what they are stated of holds, and the Brier score."""
    stated = [(m.answer.confidence, m.claim_holds) for m in cases if m.answer.confidence is not None]
    return {
        "stated": float(np.mean([c for c, _ in stated])) if stated else None,
        "holds": rate(ok for _, ok in stated),
        "brier": float(np.mean([(c - ok) ** 2 for c, ok in stated])) if stated else None,
    }


def _calibration(marked: Sequence[Marked]) -> dict[str, Any]:
    """How often each kind of verdict is right, how often stated intervals hold, and the same of stated confidences."""
    sizes = [s for m in marked for s in m.sizes]
    stated = [(m.answer.confidence, m) for m in marked if m.answer.confidence is not None]
    reliability = []
    for low, high in ((0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.0)):
        here = [m for c, m in stated if low <= c < high or (high == 1.0 and c == 1.0)]
        reliability.append({"from": low, "to": high, **_confidence(here)})
    return {
        "by_verdict": {kind: rate(m.right for m in marked if m.answer.kind == kind) for kind in ANSWERS},
        "within_1_std": {"expected": 0.683, **rate(ok for s in sizes if (ok := s.within(1.0)) is not None)},
        "within_2_std": {"expected": 0.954, **rate(ok for s in sizes if (ok := s.within(2.0)) is not None)},
        "brier": _confidence(marked)["brier"],
        "nothing": _confidence([m for m in marked if m.kind == "nothing"]),
        "reliability": reliability,
    }


def _inside(multiple: float | None, low: float, high: float) -> bool:
    return multiple is not None and (low <= multiple < high or (high == BINS[-1] and multiple >= high))


def _bin(low: float, high: float, hidden: Sequence[Marked], outside: Sequence[Marked]) -> dict[str, Any]:
    """Cases by their weakest effect, amplitudes each by its own."""
    here = [m for m in hidden if _inside(m.multiple, low, high)]
    out = [m for m in outside if _inside(m.multiple, low, high)]
    sizes = [s for m in hidden for s in m.sizes if _inside(s.multiple, low, high)]
    return {
        "from": low,
        "to": high,
        **_accuracy(here),
        "one": _accuracy([m for m in here if m.kind == "one"]),
        "two": _accuracy([m for m in here if m.kind == "two"]),
        "unknown_recall": rate(m.answer.kind == "unknown" for m in out),
        "amplitude": rate(s.within_two for s in sizes),
        "within_2_std": rate(ok for s in sizes if (ok := s.within(2.0)) is not None),
        "heldout": _heldout(here),
        "heldout_named": _heldout([m for m in here if m.names]),
        "heldout_right": _heldout(_explained(here))["within"],
        "named_right": rate(m.right for m in [*here, *out] if m.answer.kind in ("missing", "ambiguous")),
        "confidence": _confidence([*here, *out]),
        "confusion": _confusion([*here, *out]),
    }


def verdict_label(m: Marked) -> str:
    """The answer in the words of the confusion matrix of kinds."""
    if m.answer.kind == "missing":
        if m.exact:
            return "named"
        return "named in part" if set(m.answer.named) & set(m.tags) else "named wrongly"
    if m.answer.kind == "ambiguous":
        return "set with it" if m.right else "set without it"
    return m.answer.kind


def name_label(m: Marked) -> str:
    """The answer in the words of the confusion matrix of names."""
    if m.answer.kind == "missing":
        return m.answer.named[0] if len(m.answer.named) == 1 else "several"
    return "nothing" if m.answer.kind == "complete" else verdict_label(m)


def _confusion(marked: Sequence[Marked]) -> dict[str, dict[str, dict[str, int]]]:
    kinds: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    names: dict[str, Counter[str]] = {}
    for m in marked:
        kinds[m.kind][verdict_label(m)] += 1
        if m.kind != "two":
            row = m.tags[0] if m.tags else "nothing"
            names.setdefault(row, Counter())[name_label(m)] += 1
    return {
        "kinds": {row: dict(found) for row, found in kinds.items()},
        "names": {row: dict(names[row]) for row in sorted(names)},
    }


def _aims(nothing: Sequence[Marked], hidden: Sequence[Marked], marked: Sequence[Marked]) -> list[dict[str, Any]]:
    visible = rate(m.right for m in hidden if m.multiple is not None and m.multiple >= VISIBLE)
    alarms = _alarms(nothing)
    within = _heldout(_explained(marked))["within"]
    return [
        _aim("right (named, or a set of at most three with it) at 5 times detection and above", visible, least=0.85),
        _aim("false alarms where nothing is missing", alarms, most=0.05),
        _aim("held-out error of right cases within 1.5 floors", within, least=1.0),
    ]


def _aim(text: str, found: dict[str, Any], *, least: float | None = None, most: float | None = None) -> dict[str, Any]:
    """An aim: whether it is ``met`` by the share found, and ``shown``, that is met by all of the interval."""
    share, low, high = (found[key] for key in ("share", "low", "high"))
    if share is None:
        met = shown = None
    elif least is not None:
        met, shown = share >= least, low >= least
    else:
        met, shown = share <= (most or 0.0), high <= (most or 0.0)
    return {"text": text, "at_least": least, "at_most": most, **found, "met": met, "shown": shown}


def _line(m: Marked) -> dict[str, Any]:
    return {
        "case": m.name,
        "kind": m.kind,
        "hidden": [{k: e[k] for k in ("tag", "multiple", "amplitude", "unit", "form", "own_form")} for e in m.effects],
        "answer": m.answer.kind,
        "named": list(m.answer.named),
        "set": list(m.answer.set),
        "exact": m.exact,
        "right": m.right,
        "class_right": m.class_right,
        "heldout_base": m.answer.base,
        "heldout_final": m.answer.final,
        "amplitudes": [
            {"effect": s.tag, "multiple": s.multiple, "value": s.value, "std": s.std, "truth": s.truth} for s in m.sizes
        ],
        "text": m.answer.text,
        "failed_before": m.failed_before,
        "seconds": m.answer.seconds,
    }
