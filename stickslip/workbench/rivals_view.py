"""Rival effects in every experiment that is easily made, so that one sees which would separate them."""

from __future__ import annotations

import numpy as np
import panel as pn

from ..inference.force.candidates import every_form
from ..objects import experiments
from ..objects.diagnosis import Diagnosis
from ..objects.experiments import MEASURES, SimulatedExperiment
from ..physics.effects import catalogue
from ..system.progress import part
from ..system.units import to_si
from .background_work import Show, Tell, background
from .evidence import LEAST, best_forms
from .figures import figure, label, legend, of_run, unit_of
from .page_parts import Table, head, progress, starter
from .saved_fields import SavedFields
from .session import Session, watch
from .simulation_form import SimulationForm, needed
from .slip_tables import cells, thinned
from .widgets import Words, field

RIVALS = 8  # effects that are compared at once
FALLBACK = 1e-4  # m/s, where a run has no velocity of its own
UNSEEN = "Choose effects; those with the largest expected gain are offered once What is missing is evaluated."
DONE = "Each is fitted and simulated in experiments that are easily made."


def _undecided(diagnosis: Diagnosis | None) -> list[tuple[tuple[str, ...], str]]:
    """Sets of effects that the data cannot distinguish, each with the experiment that would."""
    found = None if diagnosis is None else diagnosis.next_experiment
    if not found:
        return []
    every = [found, *found.get("others", ())]
    return [(tuple(e["separates"]), str(e["text"])) for e in every if len(e.get("separates", ())) > 1]


class Rivals:
    """Rival effects in every experiment that is easily made, so that one sees which would separate them."""

    def __init__(self, session: Session, asked: SimulationForm) -> None:
        self._session, self._asked = session, asked
        self._work = background(session, "rivals")
        self._sets: list[tuple[tuple[str, ...], str]] = []
        self._drawn: SimulatedExperiment | None = None
        self._offered: list[str] = []
        self.which = field(pn.widgets.Select, "effects that these data cannot distinguish", 420, options=[])
        self.effects = field(
            pn.widgets.MultiChoice, "effects to compare, each in the model in place of the others", 420,
            options=[], value=[], max_items=RIVALS,
        )  # fmt: skip
        begin = starter(self._work, "Simulate each", self.start)
        self._said, self._place = Words(), pn.Column()
        self._table = Table(self._choose)
        self.view = pn.Column(
            head("The experiment that would separate candidates"), self._said,
            pn.FlexBox(self.which, self.effects, begin, gap="6px 10px"), progress(self._work), self._table,
            self._place,
        )  # fmt: skip
        self._kept = SavedFields(session, "rivals", {"effects": self.effects})
        self.which.param.watch(lambda event: self._propose(), "value")
        watch(session, ["diagnosis", "promises", "loaded"], self._offer)
        watch(session, ["campaign"], self._anew)
        watch(self._work, ["found", "doing"], self.update)
        self._offer()
        self._kept.restore()
        self.update()

    def _anew(self) -> None:
        self._work.found = None
        self._drawn, self._place[:], self._table.rows = None, [], []

    def _offer(self) -> None:
        self._sets = _undecided(self._session.diagnosis)
        options = {" or ".join(tags): i for i, (tags, _) in enumerate(self._sets)}
        self.which.param.update(options=options, value=0 if options else None)
        self.which.visible = bool(options)
        self.effects.options = sorted({tag for tag, _ in every_form(catalogue.tags())})
        self._propose()

    def _propose(self) -> None:
        if self._sets:
            tags, text = self._sets[int(self.which.value or 0)]
            with self._kept.aside():
                self.effects.value = [tag for tag in tags if tag in self.effects.options][:RIVALS]
            self._said.text = f"The diagnosis proposes: {text}. {DONE}"
            return
        if self.effects.value == self._offered:  # nobody chose others
            best = [p.tag for p in best_forms(self._session.promises) if p.fall > LEAST]
            with self._kept.aside():
                self._offered = self.effects.value = [tag for tag in best if tag in self.effects.options][:2]
        offered = "The effects with the largest expected gain are offered; others can be chosen."
        self._said.text = f"{offered if self._session.promises else UNSEEN} {DONE}"

    def start(self) -> None:
        """Fit the model with each effect and simulate every experiment."""
        campaign, tags, asked = self._session.data, list(self.effects.value), self._asked.setting()
        if len(tags) < 2:
            self._work.said = "choose two effects at least"
            return
        told = {} if self._session.diagnosis is None else self._session.diagnosis.verdict.get("forms", {})

        def make(tell: Tell, show: Show) -> list[SimulatedExperiment]:
            fit, code = needed(self._session), self._session.code()
            scenario = experiments.scenario(fit, asked)
            velocity = campaign[asked.run].drive_velocity or scenario.file.drive.velocity or FALLBACK
            velocity = to_si(asked.velocity, "m/s", key="velocity") if asked.velocity.strip() else velocity
            block = scenario.file.block
            options = experiments.practicable(asked, abs(velocity), block.spring_stiffness, block.mass)
            if not asked.as_measured:
                options = {"as set above": asked, **options}
            fits = experiments.rivals(fit, tags, told, part(tell, 0, 2))
            return experiments.simulate_rivals(fit, fits, options, part(tell, 1, 2), show, code)

        self._work.do("fitting each of them", make)

    def _choose(self, number: int) -> None:
        if number < len(self._work.found or ()):  # of a search that has begun anew
            self._draw(self._work.found[number])

    def update(self) -> None:
        """List the experiments, and draw the one in which they differ most."""
        found: list[SimulatedExperiment] | None = self._work.found
        if not found:
            return
        columns = ["experiment: a click draws it", "the true one becomes", "they differ most in", "by"]
        rows = [
            [t.words, t.note] if t.note else
            [t.words, t.odds, experiments.where(t.measure, t.slip), f"{100 * t.share:.2g} %"] if t.measure else
            [t.words, t.odds, "nothing", ""]
            for t in found
        ]  # fmt: skip
        self._table.param.update(columns=columns, rows=rows)
        self._draw(found[0])

    def _draw(self, experiment: SimulatedExperiment) -> None:
        """The models side by side in one experiment."""
        found: list[SimulatedExperiment] = self._work.found
        self._table.chosen = next((i for i, t in enumerate(found) if t is experiment), -1)
        if experiment is self._drawn or not experiment.recordings:
            return
        self._drawn = experiment
        made = [figure(name, height=280, output_backend="canvas") for name in ("displacement", "load point - block")]
        moved = {tag: r["displacement"].values for tag, r in experiment.recordings.items()}
        k, unit = unit_of(np.concatenate([*moved.values()]), "m")
        for i, (tag, r) in enumerate(experiment.recordings.items()):
            data = thinned(r["time"].values, moved[tag] * k, (r["drive_position"].values - moved[tag]) * k)
            for name, own in zip(("x", "gap"), made, strict=True):
                own.line(data["t"], data[name], line_width=2, legend_label=tag, **of_run(i))
        for name, own in zip(("displacement", "load point - block"), made, strict=True):
            own.xaxis.axis_label, own.yaxis.axis_label = label("time from the start", "s"), label(name, unit)
            legend(own)
        made[1].x_range = made[0].x_range
        trace = self._session.data[experiment.setting.run]
        rows = [[tag, *cells(experiments.simulated(r, trace))] for tag, r in experiment.recordings.items()]
        columns = [
            f"{experiment.words}: means ± scatter, without the first slip", *(key.replace("_", " ") for key in MEASURES)
        ]  # fmt: skip
        table = Table(columns=columns, rows=rows)
        self._place[:] = [Words(text=_difference(experiment)), pn.Row(*made), table]


def _difference(experiment: SimulatedExperiment) -> str:
    """How clearly an experiment separates the models, in words."""
    words = f"After {experiment.words} the true one is expected to be {experiment.odds} as any other."
    if experiment.measure:
        place = experiments.where(experiment.measure, experiment.slip)
        words += f" They differ most in the {place}: by {100 * experiment.share:.2g} % of its mean."
    if len({r.sizes["event"] for r in experiment.recordings.values()}) > 1:
        counts = ", ".join(f"{tag} {r.sizes['event']}" for tag, r in experiment.recordings.items())
        words += f" The number of slips differs: {counts}."
    return words
