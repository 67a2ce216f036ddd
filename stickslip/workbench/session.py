"""What is open in a workbench: the campaign, the model as it stands, the steps that led to it, what is selected.

Pages watch its parameters and call its methods; none of them changes another page.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import param

from ..errors import StickslipError
from ..objects import Campaign, Fit

BASE = "the base model"


@dataclass(frozen=True)
class Step:
    """One step of the history.

    Attributes:
        text: what was done, in words.
        fit: the model after it.
        code: the line of Python that does the same.
        command: the command that does the same, or "" where there is none.
    """

    text: str
    fit: Fit
    code: str
    command: str = ""


class Session(param.Parameterized):
    """The state of one workbench.

    Attributes:
        campaign: what is open.
        steps, at: the history, and the number of the step that is shown (undo goes back, redo forth).
        diagnosis: of the present campaign, or None.
        run, event: what is selected: name of a run, number of a cycle in it.
        busy, share: what long work is going on ("" for none), and how much of it is done.
        said: what the user must read: an error in words or a note ("" for nothing).
    """

    campaign = param.ClassSelector(class_=Campaign)
    steps = param.Parameter(())
    at = param.Integer(-1)
    diagnosis = param.Parameter(None)
    run = param.String("")
    event = param.Integer(0)
    busy = param.String("")
    share = param.Number(0.0)
    said = param.String("")
    locked = param.Parameter(frozenset())

    @property
    def fit(self) -> Fit | None:
        """The model as it stands; None before the first fit."""
        return self.steps[self.at].fit if 0 <= self.at < len(self.steps) else None

    @property
    def taken(self) -> tuple[Step, ...]:
        """The steps up to the one that is shown."""
        return self.steps[: self.at + 1]

    def take(self, step: Step, over: bool = False) -> None:
        """Put a step behind the one that is shown; what came after it is forgotten.

        Args:
            step: what was done.
            over: take the place of the last step instead, as a slider does while it is being dragged.
        """
        kept = self.taken[:-1] if over and self.taken else self.taken
        with param.parameterized.batch_call_watchers(self):
            self.steps = (*kept, step)
            self.at = len(self.steps) - 1
            self.param.trigger("at")

    def undo(self) -> None:
        """Show the step before."""
        self.at = max(self.at - 1, min(0, len(self.steps) - 1))

    def redo(self) -> None:
        """Show the step after."""
        self.at = min(self.at + 1, len(self.steps) - 1)

    def first(self, fit: Fit) -> None:
        """Begin the history with the base model."""
        self.take(Step(BASE, fit, "fit = campaign.fit()", "stickslip fit campaign.toml"))

    def by_hand(self, values: dict[str, float | str], over: bool = False) -> None:
        """Parameters set by hand."""
        fit = self.fit
        if fit is None:
            return
        self._try(
            lambda: Step(
                f"by hand: {', '.join(values)}", fit.with_values(values), f"fit = fit.with_values({values!r})"
            ),
            over,
        )

    def refit(self) -> None:
        """Fitted anew, locked parameters as they are."""
        fit, locked = self.fit, sorted(self.locked)
        if fit is not None:
            self._try(lambda: Step("fit", fit.refit(locked), f"fit = fit.refit({locked!r})"))

    def add(self, effect: str) -> None:
        """An effect more, fitted."""
        fit = self.fit
        if fit is not None:
            command = "stickslip fit campaign.toml " + " ".join(f"--add {e}" for e in (*fit.effects, effect))
            self._try(lambda: Step(f"with {effect}", fit.add(effect), f"fit = fit.add({effect!r})", command))

    def remove(self, effect: str) -> None:
        """An effect less, fitted anew."""
        fit = self.fit
        if fit is not None:
            self._try(lambda: Step(f"without {effect}", fit.remove(effect), f"fit = fit.remove({effect!r})"))

    def code(self) -> str:
        """The lines of Python that lead to the model as it stands."""
        assert self.campaign is not None
        path = self.campaign.description.path.name
        first: Sequence[str] = ("import stickslip as ss", f"campaign = ss.load_campaign({path!r})")
        return "\n".join([*first, *(s.code for s in self.taken)])

    def _try(self, make: Callable[[], Step], over: bool = False) -> None:
        """Take the step, or say why it cannot be taken."""
        try:
            self.take(make(), over)
            self.said = ""
        except StickslipError as error:
            self.said = str(error)


def watch(session: Session, names: Sequence[str], call: Callable[[], Any]) -> None:
    """Call a function whenever one of these parameters of a session changes, once a change."""
    session.param.watch(lambda *events: call(), list(names))
