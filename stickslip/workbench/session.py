"""What is open in a workbench: the campaign, the model as it stands, the steps that led to it, what is selected.

Pages watch its parameters and call its methods; none of them changes another page. All windows of a server share one.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import param

from ..errors import RunFolderError, StickslipError
from ..objects.campaign import Campaign, load_campaign
from ..objects.example import to_work_in
from . import restore
from .catalogue_search import CatalogueSearch
from .history_steps import Step, complete, fewer, first, moved
from .history_writer import HistoryWriter
from .session_callbacks import watch
from .session_messages import Note, long
from .worker import AtOnce

if TYPE_CHECKING:
    from ..objects.fit import Fit

__all__ = ["LOOKING", "Note", "Session", "watch"]

LOOKING = "analysing the data"
STILL = 0.25  # s without a move, after which a model that was moved is kept


class Session(param.Parameterized):
    """The state of one workbench.

    Attributes:
        campaign: what is open; None until one of ``offers`` (paths of campaign files) was chosen.
        home: folder in which a campaign may be made where none is open; None for nowhere.
        steps, at: the history, and the number of the step that is shown (undo goes back, redo forth).
        diagnosis: of the present campaign, or None.
        run, event: what is selected: name of a run, number of a cycle in it.
        busy, share: what long work is going on ("" for none), and how much of it is done.
        searching, searched: the same of the diagnosis, which goes on beside all else.
        saved: the model of a run folder that is to stand, until it does; None for the base.
        said: what the user must read: an error in words or a :class:`Note` ("" for nothing).
        locked: names of parameters that a fit leaves as they are.
        promises: what every effect promises on top of the model as it stands; ``listed`` is how many were looked at.
        effect_files: Python files with effects of one's own; ``loaded`` counts how often they were.
        worker: does what takes longer than a hand would wait; the same thread unless a server gives another.
        aside: does what no hand waits for, likewise.
        view: what windows show besides the model, as plain data by page; ``restored`` counts how often it came back.
        rough: a fitted model, and the rough lines nearest to its backbone (None where the rig says too little of them).
        free: a model, the name of a run, and that model run freely through it; None where that cannot be done.
    """

    campaign = param.ClassSelector(class_=Campaign)
    offers = param.Parameter(())
    home = param.ClassSelector(class_=Path)
    steps = param.Parameter(())
    at = param.Integer(-1)
    diagnosis = param.Parameter(None)
    saved = param.Parameter(None)
    run = param.String("")
    event = param.Integer(0)
    busy = param.String("")
    share = param.Number(0.0)
    searching = param.String("")
    searched = param.Number(0.0)
    said = param.String("")
    locked = param.Parameter(frozenset())
    promises = param.Parameter(())
    listed = param.Number(1.0)
    effect_files = param.Parameter(())
    loaded = param.Integer(0)
    worker = param.Parameter(AtOnce())
    aside = param.Parameter(AtOnce())
    free = param.Parameter((None, "", None))
    rough = param.Parameter((None, None))
    view = param.Dict({})
    restored = param.Integer(0)

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self._keeper = HistoryWriter(self)
        self._looking = CatalogueSearch(self)
        self._moves: dict[str, float | str] = {}
        self._guard = threading.Lock()
        self._anew = False

    @property
    def data(self) -> Campaign:
        """The campaign that is open; pages are made only where one is."""
        assert self.campaign is not None
        return self.campaign

    @property
    def fit(self) -> Fit | None:
        """The model as it stands; None before the first fit."""
        return self.steps[self.at].fit if 0 <= self.at < len(self.steps) else None

    @property
    def fitted(self) -> Fit | None:
        """The same before parameters were set by hand: what errors on unseen runs and deviations belong to."""
        return next((s.fit for s in reversed(self.taken) if not s.fit.by_hand), None)

    @property
    def taken(self) -> tuple[Step, ...]:
        """The steps up to the one that is shown."""
        return self.steps[: self.at + 1]

    # what is open

    def open(self, number: int) -> None:
        """Open one of what is offered."""

        def job() -> None:
            with long(self, f"reading {self.offers[number]}"):
                try:
                    path = to_work_in(self.offers[number], self.home)
                except OSError as error:
                    raise RunFolderError(f"the example cannot be copied here ({error.strerror or error})") from None
                self.show_first(load_campaign(path, self.effect_files))

        if self.campaign is None and 0 <= number < len(self.offers):
            self.worker("", job)

    def show_first(self, campaign: Campaign) -> None:
        """The campaign that was chosen or made, where none is open yet."""
        if self.campaign is None:
            self.campaign, self.said = campaign, ""
            self.begin()

    def begin(self, keep: bool = True) -> None:
        """Fit the base model, or go on where the same campaign was left.

        Args:
            keep: keep the history beside the campaign's file.
        """
        if keep and self.data.description.filed:
            self._keeper.begin(self.data)
        self.worker("", partial(self._begin, self.data))

    def reopen(self, campaign: Campaign) -> None:
        """Another campaign in place of the open one, such as the same with a run more; the history begins anew."""
        self.stop()
        self.cancel()
        keep = self._keeper.journal is not None
        self.param.update(campaign=campaign, steps=(), at=-1, diagnosis=None, locked=frozenset(), run="", event=0)
        self.begin(keep=keep)

    def _begin(self, campaign: Campaign) -> None:
        with long(self, LOOKING):
            if self._keeper.journal is None or not restore.history(self, self._keeper.journal):
                self.busy = "fitting the base model"
                self.first(complete(campaign.fit()))
            if self.saved is not None:
                restore.model(self, self.saved)
                self.saved = None
            self.keep()

    def keep(self) -> None:
        """Write the history beside the campaign, if it changed."""
        self._keeper.write()

    def remember(self, key: str, value: Any) -> None:
        """Keep what a page shows, as plain data, so that it comes back."""
        if self.view.get(key) != value:
            self.view = {**self.view, key: value}
            self.later()

    def later(self) -> None:
        """Keep what is selected when nothing else is to be done."""
        self.worker("keep", self.keep, STILL)

    # steps

    def take(self, step: Step, over: bool = False) -> None:
        """Put a step behind the one that is shown; what came after it is forgotten.

        Args:
            step: what was done.
            over: take the place of the last step instead, as a slider does while it is being dragged.
        """
        kept = fewer(self.taken[:-1] if over and self.taken else self.taken)
        with param.parameterized.batch_call_watchers(self):
            self.steps = (*kept, step)
            self.at = len(self.steps) - 1
            self.param.trigger("at")

    def undo(self) -> None:
        """Show the step before."""
        self.show(self.at - 1)

    def redo(self) -> None:
        """Show the step after."""
        self.show(self.at + 1)

    def back(self) -> None:
        """Show the base model again; the steps after it can be had again."""
        self.show(0)

    def show(self, at: int) -> None:
        """Show a step of the history, by its number."""
        self.at = max(min(at, len(self.steps) - 1), min(0, len(self.steps) - 1))
        self.later()

    def first(self, fit: Fit) -> None:
        """Begin the history with the base model."""
        self.take(first(fit))

    def by_hand(self, values: Mapping[str, float | str], over: bool = False) -> None:
        """Parameters set by hand.

        Args:
            values: name -> value in SI, or text with a unit.
            over: in place of the last step, if that was done by hand too.
        """
        with self._guard:
            self._moves.update(values)
            self._anew |= not over
        self.worker("hand", self._move)

    def _move(self) -> None:
        with self._guard:
            values, self._moves = self._moves, {}
            over, self._anew = not self._anew, False
        fit = self.fit
        if fit is None or not values:
            return
        over = over and bool(self.taken) and bool(self.taken[-1].changed)
        with long(self):
            self.take(moved(fit, values, self.taken[-1].changed if over else {}), over)
            self.said = ""
        self.later()

    def refit(self) -> None:
        """Fitted anew, locked parameters as they are; the base model, where that was cancelled."""
        if self.fit is None and self.campaign is not None and not self.busy:
            self.worker("", partial(self._begin, self.campaign))
            return
        locked = sorted(self.locked)

        def make(fit: Fit) -> Step:
            return Step("fit", fit.refit([n for n in locked if n in fit.values]), f"fit = fit.refit({locked!r})")

        self._change("fitting", make)

    def add(self, effect: str) -> None:
        """An effect more, fitted."""

        def make(fit: Fit) -> Step:
            added = " ".join(f"--add {e}" for e in (*fit.effect_forms, effect))
            code = f"fit = fit.add({effect!r})"
            return Step(f"with {effect}", fit.add(effect), code, f"stickslip fit campaign.toml {added}")

        self._change(f"fitting with {effect}", make)

    def remove(self, effect: str) -> None:
        """An effect less, fitted anew."""

        def make(fit: Fit) -> Step:
            return Step(f"without {effect}", fit.remove(effect), f"fit = fit.remove({effect!r})")

        self._change(f"fitting without {effect}", make)

    def _change(self, busy: str, make: Callable[[Fit], Step]) -> None:
        def job() -> None:
            fit = self.fit
            if fit is None:
                return
            with long(self, busy):
                step = make(fit)
                complete(step.fit)
                if self.campaign is not fit.campaign:  # another was opened meanwhile
                    return
                self.take(step)
                self.said = ""
            self.keep()

        self.worker("", job)

    def lock(self, name: str, on: bool) -> None:
        """Leave a parameter as it is in the next fit, or not."""
        self.locked = self.locked | {name} if on else self.locked - {name}
        self.later()

    def find_rough_line(self) -> None:
        """The rough lines nearest to the backbone of the last fit."""

        def job() -> None:
            fit = self.fitted
            if fit is not None and self.rough[0] is not fit:
                try:
                    self.rough = fit, fit.rough_line
                except StickslipError:
                    self.rough = fit, None

        self.aside("rough", job, STILL)

    def run_freely(self, run: str) -> None:
        """The model as it stands through the cycles of a run, once no hand moves it."""

        def job() -> None:
            fit = self.fit
            if fit is None or (self.free[0] is fit and self.free[1] == run):
                return
            try:
                self.free = fit, run, fit.simulate_cycles(run)
            except StickslipError:
                self.free = fit, run, None

        self.aside("free", job, STILL)

    def cancel(self) -> None:
        """End the fit that is going on."""
        self.worker.cancel()

    def shown(self, path: Path) -> str:
        """A path as it is written from the campaign's folder."""
        home = self.data.description.folder.resolve()
        own = path.resolve()
        return str(own.relative_to(home) if own.is_relative_to(home) else own)

    def options(self) -> str:
        """Options of a command that name the files with effects of one's own."""
        return "".join(f" --effect {quote(self.shown(path))}" for path in self.effect_files)

    def code(self) -> str:
        """The lines of Python that lead to the model as it stands."""
        path = self.data.description.path.name
        own = f", effect_files={[self.shown(p) for p in self.effect_files]!r}" if self.effect_files else ""
        first: Sequence[str] = ("import stickslip as ss", f"campaign = ss.load_campaign({path!r}{own})")
        return "\n".join([*first, *(s.code for s in self.taken)])

    # what is missing

    def list_promises(self) -> None:
        """Look at every effect on top of the model as it stands, in a process beside, unless that goes on already."""
        self._looking.promises()

    def diagnose(self) -> None:
        """The whole search, in a process of its own; finished pieces are kept and used again."""
        journal = self._keeper.journal
        self._looking.diagnose(None if journal is None else journal.diagnosis)

    def stop(self) -> None:
        """End the diagnosis; what it has finished is used when it is begun again."""
        self._looking.stop()

    def close(self) -> None:
        """End all that goes on beside."""
        self._looking.close()
        self._keeper.close()

    # effects of one's own

    def reload(self, path: Path) -> None:
        """A file with effects was saved: load it anew, and fit the model anew if it has one of them."""
        from ..physics.effects import catalogue
        from ..simulation.conformance import load_effects

        def job() -> None:
            with long(self):
                classes = load_effects([path])
                tags = [cls.tag for cls in classes]
                self.said = Note(f"{path.name} was reloaded: {', '.join(tags)}")
                fit = self.fit
                forms = {} if fit is None else dict(zip(fit.effects, fit.effect_forms, strict=True))
                for tag in tags:
                    if fit is not None and tag in forms:
                        with long(self, f"fitting with the new {tag}"):
                            fit = fit.remove(tag).add(forms[tag])
                            self.take(Step(f"new {tag}", fit, f"fit = fit.remove({tag!r}).add({forms[tag]!r})"))
                gone = [tag for tag in forms if tag not in catalogue.tags()]
                if gone:
                    self.said += f"; {', '.join(gone)} is in the model and in no file any more: switch it off"
                self.loaded += 1

        self.worker("", job)
