"""The marks of single cases, and rates with their intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from .answers import Answer, class_of
from .sizes import Size, compared

LEVEL = 0.95
LARGEST_SET = 3
CIRCUMSTANCES = ("spring_known", "virgin", "new_lines")


@dataclass(frozen=True)
class Marked:
    """A case with its truth, its answer and the marks for it.

    Attributes:
        kind: what was hidden: ``nothing``, ``one``, ``two`` or ``outside``. effects: the truth of each.
        multiple: of detection, of the weakest effect; None where nothing is hidden.
        sizes: amplitudes found against hidden.
        failed_before: how many attempts at this case failed.
        circumstances: whether the spring is known, the contact virgin, and the lines new at every event.
    """

    name: str
    kind: str
    effects: tuple[dict[str, Any], ...]
    multiple: float | None
    answer: Answer
    sizes: tuple[Size, ...]
    failed_before: int = 0
    circumstances: Mapping[str, bool] = field(default_factory=dict)

    @property
    def tags(self) -> tuple[str, ...]:
        return tuple(effect["tag"] for effect in self.effects)

    @property
    def exact(self) -> bool:
        """Whether the answer is the truth: just these effects, nothing missing, or nothing known explains it."""
        if self.kind in ("nothing", "outside"):
            return self.answer.kind == {"nothing": "complete", "outside": "unknown"}[self.kind]
        return self.answer.kind == "missing" and sorted(self.answer.named) == sorted(self.tags)

    @property
    def right(self) -> bool:
        """Whether the answer is exact, or a set of at most three effects that holds the whole truth."""
        in_set = self.answer.kind == "ambiguous" and set(self.tags) <= self.answer.told
        return self.exact or (self.kind in ("one", "two") and in_set and len(self.answer.told) <= LARGEST_SET)

    @property
    def class_right(self) -> bool:
        """Whether the answer is right, or names effects of just the classes that are missing."""
        named = self.kind in ("one", "two") and self.answer.kind in ("missing", "ambiguous")
        return self.right or (named and set(map(class_of, self.answer.told)) == set(map(class_of, self.tags)))

    @property
    def alarm(self) -> bool:
        """Whether something is said to be missing."""
        return self.answer.kind in ("missing", "ambiguous", "unknown")

    @property
    def names(self) -> bool:
        """Whether any effect is named, be it on the way to an ``unknown``."""
        return bool(self.answer.told)

    @property
    def claim_holds(self) -> bool:
        """Whether that is so which a confidence is stated of: of a set, that it and the names hold what is hidden."""
        if self.answer.kind == "ambiguous":
            return bool(self.tags) and set(self.tags) <= self.answer.told
        return self.right

    @property
    def answered(self) -> bool:
        """Whether there is a verdict."""
        return self.answer.kind not in ("failed", "not run")

    @property
    def fall(self) -> float | None:
        """Held-out error of the last model over that of the base model."""
        if self.answer.base is None or self.answer.final is None or self.answer.base <= 0:
            return None
        return self.answer.final / self.answer.base


def mark(case: dict[str, Any], answer: Answer, failed_before: int = 0) -> Marked:
    """Put truth and answer of a case together."""
    effects = tuple(case["effects"])
    multiple = min((effect["multiple"] for effect in effects), default=None)
    sizes = tuple(compared(list(effects), answer))
    known = {name: case[name] for name in CIRCUMSTANCES if name in case}
    return Marked(case["name"], case["kind"], effects, multiple, answer, sizes, failed_before, known)


def rate(marks: Iterable[bool]) -> dict[str, Any]:
    """Share of true marks with Wilson's 95 % interval; None for shares of nothing."""
    from scipy.stats import binomtest

    marks = list(marks)
    if not marks:
        return {"count": 0, "of": 0, "share": None, "low": None, "high": None}
    interval = binomtest(sum(marks), len(marks)).proportion_ci(LEVEL, method="wilson")
    return {
        "count": sum(marks),
        "of": len(marks),
        "share": sum(marks) / len(marks),
        "low": float(interval.low),
        "high": float(interval.high),
    }
