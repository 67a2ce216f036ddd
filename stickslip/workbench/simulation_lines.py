"""The same simulations as lines of Python and as commands."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from shlex import quote
from typing import Any

from ..objects.experiments.events import Simulated
from ..objects.experiments.rival_experiments import SimulatedExperiment
from ..objects.experiments.setting import Setting, changes
from ..objects.experiments.sweeps import Swept
from ..objects.fit import Fit

Found = Simulated | Swept | Sequence[SimulatedExperiment]


def python(found: Found, most: int | None = None) -> list[str]:
    """What leads from ``fit``, the model that was simulated, to the same recordings.

    Args:
        found: what was simulated.
        most: experiments that are written; all of them unless given.
    """
    if isinstance(found, Simulated):
        return [f"scenario = {_scenario('fit', found.fit, found.setting)}", "recording = ss.simulate(scenario)"]
    if isinstance(found, Swept):
        each = "ss.simulate(scenario.with_changes([('drive.velocity', v)]))"
        return [f"scenario = {_scenario('fit', found.fit, found.setting)}", f"velocities = {list(found.velocities)!r}",
                f"recordings = [{each} for v in velocities]"]  # fmt: skip
    made = _rivals(found[0]) if found else []
    done = [t for t in found if t.recordings]
    for experiment in done[:most]:
        made += [f"# {experiment.words}", "recordings = {"]
        for tag in experiment.recordings:
            own = _scenario(f"rivals[{tag!r}]", experiment.fits[tag], experiment.setting)
            made.append(f"    {tag!r}: ss.simulate({own}),")
        made.append("}")
    left = 0 if most is None else len(done) - most
    return made if left < 1 else [*made, f"# and {left} more, which are in result.json when they are saved"]


def command(found: Simulated | Swept, model: str, out: str, effects: str = "") -> str:
    """The command that simulates the same.

    Args:
        found: what was simulated.
        model: run folder of the model.
        out: run folder that it writes.
        effects: options that name files with effects of one's own.
    """
    sets = "".join(f" --set {quote(f'{key}={_toml(value)}')}" for key, value in changes(found.fit, found.setting))
    sweep = ""
    if isinstance(found, Swept):
        series = found.series
        sweep = f" --sweep {series.key}={series.start!r}:{series.stop!r}:{series.points}"
    run = f" --trace {quote(found.setting.run)}"
    return f"stickslip simulate {quote(model)}{run}{sets}{sweep}{effects} --out {quote(out)}"


def commands(found: Sequence[SimulatedExperiment], model: Mapping[str, str], out: str, effects: str = "") -> list[str]:
    """The same of experiments; ``model`` is the run folder of each rival's model."""
    done = [t for t in found if t.recordings]
    return [
        command(one(experiment, tag), model[tag], f"{out}-{number}-{tag}", effects)
        for number, experiment in enumerate(done, start=1) for tag in experiment.recordings
    ]  # fmt: skip


def one(experiment: SimulatedExperiment, tag: str) -> Simulated:
    """What was simulated of one rival."""
    return Simulated(experiment.fits[tag], experiment.setting, experiment.recordings[tag])


def _scenario(name: str, fit: Fit, setting: Setting) -> str:
    made = f"{name}.scenario(run={setting.run!r}, events={setting.events})"
    changed = changes(fit, setting)
    return f"{made}.with_changes({changed!r})" if changed else made


def _rivals(experiment: SimulatedExperiment) -> list[str]:
    base = "fit" + "".join(f".remove({tag!r})" for tag in experiment.fits if tag in experiment.model.effects)
    made = {
        tag: "fit" if fit is experiment.model else f"base.add({fit.effect_forms[fit.effects.index(tag)]!r})"
        for tag, fit in experiment.fits.items()
    }
    return [f"base = {base}", f"rivals = {{{', '.join(f'{tag!r}: {line}' for tag, line in made.items())}}}"]


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(own)}" for key, own in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
