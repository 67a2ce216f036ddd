"""Simulations as run folders beside the campaign, as ``stickslip simulate`` writes them, with their model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..inference.fit.serialised import KEY
from ..inference.fit.serialised import record as model_record
from ..objects.campaign import Campaign
from ..objects.experiments.events import Simulated
from ..objects.experiments.rival_experiments import SimulatedExperiment
from ..objects.experiments.setting import Setting, scenario
from ..objects.experiments.sweeps import Swept
from ..objects.fit import Fit
from ..objects.result_base import Tell
from ..show.simulated import head, numbers, series_numbers, write_series, write_single
from ..simulation.scenario import Scenario
from ..simulation.scenario.recording import Recording
from ..simulation.scenario.series import scenarios_of, summary
from ..system.progress import breathe
from ..system.runstore import Run, open_run, versions
from .file_names import new_folder
from .simulation_lines import Found, command, commands, one, python

AGAIN = "again"
KIND = "experiments"


def save(found: Found, campaign: Campaign, name: str, tell: Tell, effects: str = "") -> Path:
    """Keep a simulation, a sweep or experiments.

    Args:
        found: what was simulated.
        campaign: with a file.
        name: of the run folder; within one of experiments there is one for every rival in each of them.
        tell: told the progress.
        effects: options of a command that name files with effects of one's own.

    Raises:
        InputError: the name cannot be used or is there already; the campaign has no folder; nothing is there to keep.
    """
    folder = new_folder(campaign, name, "name of the run folder")
    own = folder.name
    if not isinstance(found, Simulated | Swept) and not any(t.recordings for t in found):
        raise InputError("no experiment was simulated", hint="Simulate each, on the page Simulate")
    code = found.code if isinstance(found, Simulated | Swept) else found[0].code
    told = {"python": [*code.splitlines(), *python(found)]}
    with open_run(folder) as run:
        if isinstance(found, Simulated):
            done = {"commands": [command(found, own, f"{own}-{AGAIN}", effects)]}
            _single(run, found.fit, found.setting, found.recording, {**told, **done})
        elif isinstance(found, Swept):
            _series(run, found, {**told, "commands": [command(found, own, f"{own}-{AGAIN}", effects)]})
        else:
            _experiments(run, found, campaign, told, effects, tell)
    return folder


def _head(fit: Fit, setting: Setting, made: Scenario, history: Mapping[str, Any]) -> dict[str, Any]:
    """As the command's, of the data that the model was fitted to, and with the model itself."""
    whole = head(replace(made, path=None))
    campaign = fit.campaign
    return {**whole, "title": campaign.title, "inputs": campaign.inputs(), "run": setting.run, "history": dict(history),
            KEY: model_record(fit.fitted)}  # fmt: skip


def _single(run: Run, fit: Fit, setting: Setting, recording: Recording, history: Mapping[str, Any]) -> None:
    made = scenario(fit, setting)
    write_single(run, made, recording)
    run.json({**_head(fit, setting, made, history), **numbers(recording)})


def _series(run: Run, found: Swept, history: Mapping[str, Any]) -> None:
    made = scenario(found.fit, found.setting)
    members = scenarios_of(made, found.series)
    made = made.with_changes([("sweep", found.series.model_dump(exclude_none=True))])
    table = summary(made, found.series.key, [value for value, _ in members], list(found.recordings))
    write_series(run, members, table, found.recordings)
    told = series_numbers(found.series, members, table, found.recordings)
    run.json({**_head(found.fit, found.setting, made, history), **told})


def _experiments(
    run: Run, found: Sequence[SimulatedExperiment], campaign: Campaign, told: Mapping[str, Any], effects: str,
    tell: Tell,
) -> None:  # fmt: skip
    done = [t for t in found if t.recordings]
    rows: list[dict[str, Any]] = []
    many, number = sum(len(t.recordings) for t in done), 0
    for i, experiment in enumerate(done, start=1):
        folders = {tag: f"{i}-{tag}" for tag in experiment.recordings}
        for tag, recording in experiment.recordings.items():
            breathe()
            tell(f"{experiment.words}, with {tag}", number / many)
            number += 1
            inner = Run(run.path(f"{folders[tag]}/result.json").parent, run.target / folders[tag], False)
            own = f"{run.target.name}/{folders[tag]}"
            again = {"python": told["python"], "commands": [_again(experiment, tag, own, effects)]}
            _single(inner, experiment.fits[tag], experiment.setting, recording, again)
        rows.append({
            "experiment": experiment.words, "setting": asdict(experiment.setting),
            "information": experiment.information, "margin": experiment.margin, "measure": experiment.measure,
            "slip": experiment.slip, "share": experiment.share, "note": experiment.note, "folders": folders,
        })  # fmt: skip
    model = {tag: f"{run.target.name}/1-{tag}" for tag in done[0].recordings}
    lines = commands(found, model, f"{run.target.name}-{AGAIN}", effects)
    failed = [{"experiment": t.words, "note": t.note} for t in found if not t.recordings]
    best = done[0]
    verdict = f"{' or '.join(best.fits)}: after {best.words} the true one is expected to be {best.odds} as any other"
    run.json({
        "schema": 1, "kind": KIND, "title": campaign.title, "verdict": verdict, "inputs": campaign.inputs(),
        "versions": versions(), "experiments": [*rows, *failed], "history": {**told, "commands": lines},
    })  # fmt: skip


def _again(experiment: SimulatedExperiment, tag: str, own: str, effects: str) -> str:
    return command(one(experiment, tag), own, f"{own.replace('/', '-')}-{AGAIN}", effects)
