"""What a diagnosis answered about a case, and whether that is right."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..system.runstore import RESULT
from .one_case import failures, is_done

KINDS = ("complete", "missing", "ambiguous", "unknown")
# what campaigns of several velocities and holds cannot be expected to distinguish
CLASSES = (("sensor-drift", "sensor-high-pass"), ("sensor-low-pass", "residual-load"))


@dataclass(frozen=True)
class Answer:
    """The answer to one case.

    Attributes:
        kind: ``complete``, ``missing``, ``ambiguous``, ``unknown``, ``failed`` or ``not run``.
        named: effects said to be missing, in the order added. set: all that come into question.
        base, final: held-out error of the base model and of the last one (floors), where known.
        parameters: of the last model: name -> value, std, unit.
        confidence: as stated, 0 to 1; None where none is.
        text: the verdict in words, or why there is none.
        seconds: of the diagnosis.
        hashes: SHA-256 of the files it read.
        forms: of the effects in the last model: tag -> variant -> chosen.
    """

    kind: str
    named: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    base: float | None = None
    final: float | None = None
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    confidence: float | None = None
    text: str = ""
    seconds: float | None = None
    hashes: frozenset[str] = frozenset()
    forms: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def told(self) -> frozenset[str]:
        """All effects that it names or that come into question."""
        return frozenset((*self.named, *self.set))


def read_answer(runs: Path, case: str) -> Answer:
    """The answer to a case; a recorded failure, a result that cannot be read and no result at all are answers too."""
    if not is_done(runs, case):
        found = failures(runs, case)
        if found:
            return Answer("failed", text=f"{found[-1].get('error', '')}: {found[-1].get('message', '')}")
        return Answer("not run", text="neither a result nor a recorded failure")
    try:
        return parse(json.loads((runs / case / RESULT).read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        return Answer("failed", text=f"the result cannot be read ({type(error).__name__}: {error})")


def parse(result: Mapping[str, Any]) -> Answer:
    """The answer in a ``result.json``; raises ValueError, KeyError or TypeError where it is none."""
    verdict = result["verdict"]
    if verdict["kind"] not in KINDS:
        raise ValueError(f"unknown kind of verdict '{verdict['kind']}'")
    ladder = result["ladder"]
    dynamic = [rung for rung in ladder if rung["model"] != ["static"]] or ladder
    return Answer(
        verdict["kind"],
        tuple(verdict["effects"]),
        tuple(verdict["set"]),
        dynamic[0]["heldout_error"] if dynamic else None,
        dynamic[-1]["heldout_error"] if dynamic else None,
        result["parameters"],
        verdict.get("confidence"),
        verdict["text"],
        result.get("seconds"),
        frozenset(entry["sha256"] for entry in result["inputs"]),
        {effect["type"]: effect["form"] for effect in result.get("fitted_model", {}).get("effects", ())},
    )


def class_of(tag: str) -> str:
    """The class of effects an effect belongs to: itself, or those it is usually confused with."""
    return next((" / ".join(group) for group in CLASSES if tag in group), tag)
