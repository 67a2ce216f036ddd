"""A diagnosis: which effect the base model lacks, how large it is, and what these data cannot tell."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..data.checks import stopping
from ..errors import ArgumentError, InputError, RunFolderError, nearest
from ..inference.diagnose.checkpoints import Store
from ..inference.diagnose.model_ladder import Climbed
from ..inference.diagnose.stepwise_selection import Diagnosis as Found
from ..inference.diagnose.stepwise_selection import diagnose as search
from ..inference.diagnose.summary import summary
from ..inference.diagnose.work import Work
from ..physics.effects import catalogue
from ..show.report.excerpts import trace_sections
from ..simulation.conformance import try_laws
from ..system.object_repr import facts, table
from ..system.progress import reporting
from ..system.runstore import Run, json_text, open_run, refuse_existing, versions
from ..system.threads import processors
from .campaign import Campaign, load_campaign
from .checkpoints import FinishedParts, code_digest
from .data_abilities import abilities
from .fit import Fit
from .next_experiment import next_experiment, rows, sampled_experiments
from .result_base import Savable, Tell, dataset, finish, head, several
from .stored_fit import load_fit
from .wander import wander, wander_sentence

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Diagnosis(Savable):
    """The outcome of :meth:`Campaign.diagnose`.

    Attributes:
        campaign: what was diagnosed.
        found: the search and where it ended; None where only its result was kept.
        result: plain data, as in ``result.json``.
        variables: arrays behind the pictures, as ``(dimension, values, attributes)``.
        folder: where only its result was kept, the run folder with the rest of it.
    """

    def __init__(
        self, campaign: Campaign, found: Found | None, result: dict[str, Any], variables: dict[str, Any],
        folder: Path | None = None,
    ) -> None:  # fmt: skip
        self.campaign, self.found, self.result, self.variables, self.folder = campaign, found, result, variables, folder

    @property
    def verdict(self) -> dict[str, Any]:
        """``kind``, ``effects``, ``set``, ``text``, ``reasons`` and ``forms``."""
        return dict(self.result["verdict"])

    @property
    def next_experiment(self) -> dict[str, Any] | None:
        """The experiment that would identify the effect, as ``text``, and the effects it ``separates``."""
        found = self.result["next_experiment"]
        return None if found is None else dict(found)

    @property
    def experiments(self) -> pandas.DataFrame:
        """A row for each experiment that was simulated to separate the first set, the best first.

        ``information`` about which effect is the true one is expected of it (nat, at most the logarithm of their
        number); ``margin`` is the expected logarithm of the likelihood ratio of the true one over another one, the
        least of all.
        """
        return _experiments((self.next_experiment or {}).get("experiments", ()))

    def sampled_experiments(
        self, draws: int = 50, tune: int = 50, seed: int = 0, progress: Tell | None = None
    ) -> pandas.DataFrame:
        """:attr:`experiments` with the parameters of every model drawn from its posterior (:meth:`Fit.sample`).

        Those of :attr:`experiments` are the Gaussian of the fit. Takes as long as the sampling does, some minutes.

        Args:
            draws, tune: of each model, kept and for adaptation.
            seed: of the draws.
            progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.

        Raises:
            InputError: nutpie is not installed, fewer than two draws, or no set that an experiment could separate.
            RunFolderError: only the result of the diagnosis was kept.
        """
        if self.found is None:
            hint = "diagnose the campaign again in this session"
            raise RunFolderError("of this diagnosis only the result was kept, not its models", hint=hint)
        if draws < 2:
            raise InputError("out of range", key="draws", value=draws, allowed="2 or more")
        with reporting("experiments", progress) as tell:
            return _experiments(rows(sampled_experiments(self.campaign, self.found, draws, tune, seed, tell)))

    @property
    def best(self) -> Fit:
        """The last model.

        Raises:
            RunFolderError: only the result of the diagnosis was kept.
        """
        if self.found is None:
            if self.folder is None:
                hint = "diagnose the campaign again with out=FOLDER, which keeps them"
                raise RunFolderError("of this diagnosis only the result was kept, not its models", hint=hint)
            return load_fit(self.folder, self.campaign)
        gains = {tag: done.close[0].gain for tag, done in self.found.named.items() if done.close}
        made = Fit(self.campaign, Climbed(self.found.prepared, self.found.ladder, gains))
        made._confirmation = self.found.confirmation
        return made

    @property
    def ladder(self) -> pandas.DataFrame:
        """A row for each model, with its fitted and unseen error in floors and what its effect took off the cost."""
        return self.best.ladder

    @cached_property
    def candidates(self) -> pandas.DataFrame:
        """A row for each effect of the first round, the best first, with gain, amplitude and what speaks against it.

        ``visible`` is the smallest amplitude that the last model would have shown (five standard deviations, SI).
        """
        rows: dict[str, dict[str, Any]] = {}
        seen = self.result["visible"]
        for row in self.result["ranking"]:
            size = row["amplitude"] or {}
            rows[row["effect"]] = {
                "gain": row.get("gain", np.nan),
                "unseen gain": row.get("heldout_cost", np.nan),
                "+-": row.get("heldout_cost_std", np.nan),
                "unseen error": row.get("heldout_error", np.nan),
                "amplitude": size.get("value", np.nan),
                "std": size.get("std", np.nan),
                "unit": size.get("unit", ""),
                "visible": seen.get(row["effect"], {}).get("amplitude", np.nan),
                "against": "; ".join(row.get("failures", ())) or row["note"],
            }
        return table(rows, "effect")

    @cached_property
    def arrays(self) -> xarray.Dataset:
        """Arrays behind the pictures, as in ``arrays.nc``."""
        return dataset(self.variables, self.campaign.title)

    @property
    def plot(self) -> DiagnosisPlots:
        """Its pictures, such as ``plot.candidates()``; those of its last model are ``best.plot``."""
        return DiagnosisPlots(self)

    def _finish(self, run: Run) -> None:
        finish(run, None if self.found is None and self.folder is None else self.best)

    def _parts(self) -> list[Any]:
        told = self.verdict
        proposed = self.next_experiment
        parts: list[Any] = [f"{told['kind']}: {told['text']}", self.ladder]
        if len(self.candidates):
            parts.append(self.candidates[["gain", "unseen gain", "+-", "amplitude", "std", "unit", "against"]].head(8))
        if proposed is not None:
            parts.append(facts({"next experiment": proposed["text"]}))
        return parts


class DiagnosisPlots:
    """The pictures of a diagnosis, each of which returns its matplotlib figure.

    All of them take ``ax``: axes to draw in, of a figure of one's own; texts, grid and frames are by ``rcParams``.
    """

    def __init__(self, found: Diagnosis) -> None:
        self._found = found

    def candidates(self, most: int = 15, *, ax: Axes | None = None) -> Figure:
        """Gain of every effect of the first round, on fitted and on unseen runs, with its deviation.

        Args:
            most: effects that are drawn, the best.
            ax: axes to draw in; default a figure of its own.
        """
        from ..show.report.fit_figures import candidates_picture

        return candidates_picture(self._found.candidates, most, ax=ax)

    def ladder(self, *, ax: Sequence[Axes] | None = None) -> Figure:
        """Error of every model on fitted and on unseen runs: over all phases, and by phase (two axes)."""
        from ..show.report.fit_figures import ladder_picture

        return ladder_picture(self._found.result["ladder"], ax=ax)

    def free(self, *, ax: Sequence[Axes] | None = None) -> Figure:
        """Free simulations from arrest to arrest: one run, one of its onsets, every recurrence (three axes).

        Raises:
            InputError: nothing was simulated, for want of time or of cycles.
        """
        from ..show.report.free_figures import free_picture

        data = self._found.arrays
        if "free_run_measured_time" not in data or "free_recurrence_measured" not in data:
            raise InputError("no cycle of this diagnosis was simulated", hint="allow more time, measure more slips")
        return free_picture(data, ax=ax)


def _experiments(made: Sequence[dict[str, Any]]) -> pandas.DataFrame:
    return table({row["experiment"]: {k: v for k, v in row.items() if k != "experiment"} for row in made}, "experiment")


def diagnose(
    campaign: Campaign,
    *,
    candidates: str | Sequence[str] | None = None,
    max_effects: int = 4,
    holdout: str | Sequence[str] = (),
    jobs: int | None = None,
    time_limit: float | None = None,
    out: str | Path | None = None,
    force: bool = False,
    progress: Tell | None = None,
) -> Diagnosis:
    """Find the physical effect that the base model lacks, add it, repeat.

    Args:
        campaign: the runs; called as its method, the campaign itself.
        candidates: tags of the effects to try; default the whole catalogue.
        max_effects: at most so many are added one after the other.
        holdout: runs to keep aside, besides those whose role in the campaign is "held-out".
        jobs: processes; default one a core.
        time_limit: seconds after which the best answer so far is given; it says so.
        out: run folder for ``result.json``, ``arrays.nc``, ``report.html`` and the finished parts, from which an
            interrupted diagnosis goes on; default none.
        force: replace an existing run folder.
        progress: told the stage and the share of it done; default a bar in a terminal or a notebook.

    Raises:
        InputError: a tag or number that cannot be used, no run that can take part, a rig that cannot be.
        RunFolderError: the folder cannot be written.
    """
    check_counts(max_effects, jobs, time_limit)
    holdout = several(holdout)
    began = time.perf_counter()
    if candidates is not None:
        candidates = several(candidates)
        _check_candidates(candidates)
    try_laws(catalogue.get(tag) for tag in (catalogue.tags() if candidates is None else candidates))
    rig = campaign.findings
    try:
        able = abilities(campaign.traces, campaign.events)
    except InputError as error:
        raise error.at(file=campaign.description.path) from None

    def in_time() -> bool:
        return time_limit is None or time.perf_counter() - began < time_limit

    def found(store: Store | None, ready: int, tell: Tell) -> Diagnosis:
        # before minutes of fitting, in which a wrong unit may be mended
        first = [f.sentence for f in rig] + list(able.cannot)
        first += [f"resuming from {ready} finished parts"] if ready else []
        if first:
            tell("\n         ".join(["before anything is fitted:", *first]), 0.0)
        work = Work(processors() if jobs is None else jobs, tell, in_time, store)
        try:
            tell("the measured force", 0.0)
            done = search(campaign.prepare(holdout), campaign.rig, candidates, max_effects, stopping(rig), work)
        except InputError as error:
            for finding in reversed(stopping(rig)):  # with the sign wrong in every run there are no slips to fit
                error = error.with_hint(finding.sentence)
            raise error.at(file=campaign.description.path) from None
        return _made(campaign, done, able, began, work)

    if out is None:
        with reporting("diagnosing", progress) as tell:
            return found(None, 0, tell)
    with open_run(out, force=force, resume=True) as run, reporting("diagnosing", progress) as tell:
        key = json_text(
            {
                "inputs": campaign.inputs(),
                "holdout": list(holdout),
                "versions": versions(),
                "code": code_digest(campaign.effect_files),
            }
        )
        pieces = FinishedParts(run, key)
        try:
            made = found(pieces, pieces.ready(), tell)
        except KeyboardInterrupt:
            text = f"{pieces.ready()} finished parts are kept, and the same command resumes from them"
            raise KeyboardInterrupt(text) from None
        run.arrays(made.arrays)
        run.json(made.result)
        finish(run, made.best)
    return made


def _made(campaign: Campaign, done: Found, able: Any, began: float, work: Work) -> Diagnosis:
    sections, variables = summary(done, campaign.rig)
    proposed = next_experiment(campaign, done, sections["next_experiment"], work)
    traces, segmentations = campaign.displaced[0], campaign.scaled[0]
    described, pictured = trace_sections(traces, segmentations)
    # the fit knows slips better than their forces at the onsets do
    follows = None if done.level is not None and not done.prepared.prescribed else wander(campaign)
    result: dict[str, Any] = {
        **head(campaign, "diagnose"),
        **sections,
        "next_experiment": proposed,
        "rig": [f.plain() for f in dict.fromkeys((*campaign.findings, *done.wrong))],
        "wander": follows,
        "notes": [
            *campaign.scaled[1],
            *campaign.displaced[1],
            *([] if follows is None else [wander_sentence(follows)]),
        ],
        "can": list(able.can),
        "cannot": list(able.cannot),
        "dropped": [*campaign.left_out, *sections["dropped"]],
        **described,
        "seconds": round(time.perf_counter() - began, 1),
    }
    return Diagnosis(campaign, done, result, variables | pictured)


def diagnose_campaign(
    campaign: str | Path,
    out: str | Path,
    *,
    effect_files: Sequence[str | Path] = (),
    force: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Diagnose a campaign file into a run folder.

    Args:
        campaign: the TOML file. out: the run folder.
        effect_files: Python files with effects of one's own, which are run.
        force, options: as of :func:`diagnose`.

    Returns:
        What ``result.json`` holds.

    Raises:
        InputError: the campaign, a trace, a tag or a number cannot be used.
        RunFolderError: the folder cannot be written.
    """
    check_counts(options.get("max_effects", 1), options.get("jobs"), options.get("time_limit"))
    refuse_existing(Path(out), force)  # before traces are read
    return diagnose(load_campaign(campaign, effect_files), out=out, force=force, **options).result


def check_counts(max_effects: int, jobs: int | None = None, time_limit: float | None = None) -> None:
    """Refuse numbers that a diagnosis could only fail on after its first fit.

    Raises:
        ArgumentError: fewer than one effect or process, or no time (s).
    """
    for key, value, wrong, allowed, hint in (
        ("max_effects", max_effects, max_effects < 1, "1 or more",
         "leave it out for up to 4; stickslip fit fits the base model alone"),
        ("jobs", jobs, jobs is not None and jobs < 1, "1 or more", "leave it out for one process a core"),
        ("time_limit", time_limit, time_limit is not None and not time_limit > 0.0, "more than 0 s",
         "leave it out for no limit"),
    ):  # fmt: skip
        if wrong:
            raise ArgumentError("out of range", key=key, value=value, allowed=allowed, hint=hint)


def _check_candidates(tags: Sequence[str]) -> None:
    """All that is wrong with a choice of effects, at once."""
    if not any(tags):
        raise ArgumentError("no effect is named", key="candidates", hint="leave it out, and all effects are tried")
    known = catalogue.tags()
    wrong = [tag for tag in tags if tag not in known]
    if wrong:
        named = {tag: nearest(tag, known) for tag in wrong}
        every = nearest("", known)  # said once, not for each that is near none
        hints = [f"{tag}: {hint}" if len(wrong) > 1 else hint for tag, hint in named.items() if hint != every]
        hints += [every] if every in named.values() else []
        raise ArgumentError(
            f"there is no effect {' and no effect '.join(repr(tag) for tag in wrong)}",
            key="candidates",
            hint="\n  ".join([*hints, catalogue.OWN]),
        )
