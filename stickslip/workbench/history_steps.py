"""The history: what was done, the model after each step, and the lines of Python that do the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..objects.fit import Fit

BASE = "the base model"
HAND = "by hand"
MOST = 60  # steps that are kept
WHOLE = 5  # of the last of them, with all that was found of their models


@dataclass(frozen=True)
class Step:
    """One step of the history.

    Attributes:
        text: what was done, in words.
        fit: the model after it.
        code: the line of Python that does the same.
        command: the command that does the same, or "" where there is none.
        changed: parameters that were set by hand in it, with their values (SI).
        when: it was taken: day and time of this machine.
    """

    text: str
    fit: Fit
    code: str
    command: str = ""
    changed: Mapping[str, float | str] = field(default_factory=dict)
    when: str = field(default_factory=lambda: datetime.now().strftime("%Y-%m-%d %H:%M:%S"))


def first(fit: Fit) -> Step:
    """The base model."""
    return Step(BASE, fit, "fit = campaign.fit()", "stickslip fit campaign.toml")


def moved(fit: Fit, values: Mapping[str, float | str], before: Mapping[str, float | str]) -> Step:
    """Parameters of a model set by hand.

    Args:
        fit: the model.
        values: of the parameters (SI, or text with a unit).
        before: what was set already in the step whose place this one takes.

    Raises:
        InputError: as of :meth:`stickslip.Fit.with_values`.
    """
    every = {**before, **values}
    names = ", ".join(n.rpartition(".")[2].replace("_", " ") for n in every)
    return Step(f"{HAND}: {names}", fit.with_values(values), f"fit = fit.with_values({every!r})", "", every)


def fewer(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The steps, the first of those by hand in one with the next where they are too many, and old ones bare."""
    old = max(len(steps) - WHOLE, 0)
    out = [replace(step, fit=step.fit.bare()) for step in steps[:old]] + list(steps[old:])
    while len(out) > MOST:
        at = next((i for i, step in enumerate(out[:-1]) if step.changed), None)
        if at is None:
            break
        out[at + 1] = replace(out[at + 1], code=f"{out[at].code}\n{out[at + 1].code}")
        del out[at]
    return tuple(out)


def complete(fit: Fit) -> Fit:
    """The fit with all that pages ask for, found while the bar still runs."""
    for name in ("force", "errors", "unseen_errors", "ladder", "backbone", "std"):
        getattr(fit, name)
    fit.with_values({})  # what a slider needs is compiled before a hand moves it
    return fit
