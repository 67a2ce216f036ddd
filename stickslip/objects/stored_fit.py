"""A fit as plain data and arrays, from which it is there again without being fitted."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, RunFolderError, StickslipError
from ..inference.diagnose.model_ladder import Climbed
from ..inference.diagnose.search import Rung
from ..inference.diagnose.stepwise_selection import static_residual
from ..inference.force.candidates import with_start
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.fit import at
from ..inference.force.fit_arrays import fit_arrays, fit_of
from ..inference.force.heldout import heldout_residual
from ..inference.force.problem import Problem
from ..inference.force.stated_spring import SPRING, with_free_spring
from ..physics.effects import catalogue
from ..physics.params import specs, variants
from ..system.runstore import Run, digests, read_result
from .campaign import Campaign, load_campaign
from .fit import Fit
from .result_base import write_arrays

Arrays = dict[str, np.ndarray]
MODELS = "models.npz"


def packed(fit: Fit, keep: Callable[[ForceFit, Arrays], str]) -> dict[str, Any]:
    """A fit as plain data.

    Args:
        fit: what to keep.
        keep: is given every model and its arrays, and returns the name under which they are found again.
    """
    done = fit._climbed
    fixed = done.prepared.problem.composition.fixed
    rungs = [
        {
            "model": list(rung.model),
            "added": rung.added,
            "removed": rung.removed,
            "spring_freed": SPRING in fixed and SPRING not in rung.fit.problem.composition.fixed,
            "effects": [_effect(e) for e in rung.fit.problem.composition.effects],
            "arrays": keep(rung.fit, fit_arrays(rung.fit)),
        }
        for rung in done.ladder
        if rung.fit is not None
    ]
    moved = None if fit._moved is None else keep(fit._moved, fit_arrays(fit._moved))
    return {"rungs": rungs, "gains": dict(done.gains), "moved": moved, "aside": list(done.prepared.aside)}


def unpacked(campaign: Campaign, kept: Mapping[str, Any], load: Callable[[str], Mapping[str, np.ndarray]]) -> Fit:
    """The fit again.

    Args:
        campaign: of the same data.
        kept: what :func:`packed` returned.
        load: gives the arrays of a name.

    Raises:
        InputError: an effect that is not in the catalogue any more.
        KeyError, ValueError: the data are damaged.
    """
    prepared = campaign.prepare(kept.get("aside", ()))
    ladder: list[Rung] = []
    problem = prepared.problem
    for row in kept["rungs"]:
        problem = prepared.problem
        if row.get("spring_freed"):
            problem = with_free_spring(problem) or problem
        problem = _with(problem, row["effects"])
        found = fit_of(problem, load(row["arrays"]))
        if not ladder:
            ladder.append(Rung(("static",), None, static_residual(found), None, None))
        residual = heldout_residual(found)
        ladder.append(Rung(tuple(row["model"]), row["added"], found.marginal, residual, found, row["removed"]))
    moved = None
    if kept["moved"]:
        last = ladder[-1].fit
        assert last is not None
        moved = fit_of(problem, load(kept["moved"]))
        moved = at(moved.problem, moved.point, moved.scatter, last)
    return Fit(campaign, Climbed(prepared, tuple(ladder), dict(kept["gains"])), moved)


def write_models(run: Run, fit: Fit) -> None:
    """Keep a fit in a run folder, beside its result."""
    arrays: Arrays = {}

    def keep(_: ForceFit, own: Arrays) -> str:
        name = str(len(arrays))
        arrays.update({f"{name}/{key}": array for key, array in own.items()})
        return name

    record = json.dumps(packed(fit, keep))
    write_arrays(run.path(MODELS), {"record": np.array(record), **arrays})


def load_fit(folder: str | Path, campaign: Campaign | str | Path) -> Fit:
    """The fit that :meth:`stickslip.Fit.save`, a diagnosis or a command left in its run folder, to go on from.

    Args:
        folder: of the run.
        campaign: that was fitted, or its file.

    Raises:
        RunFolderError: no run folder, one without models (of the static model, or of an older version), or damaged.
        InputError: the campaign cannot be read or holds other data; an effect that is not in the catalogue.
    """
    folder = Path(folder)
    result = read_result(folder)
    path = folder / MODELS
    if not path.is_file():
        hint = "stickslip.load_run(folder) takes up the model alone"
        raise RunFolderError("this run keeps no fit to go on from", file=path, hint=hint)
    own = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    if digests(own.inputs()) != digests(result.get("inputs", ())):
        hint = "name the campaign that was fitted, with its files as they were"
        raise InputError("the run is of other data than the campaign", file=folder, value=own.title, hint=hint)
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)

        def load(name: str) -> Arrays:
            return {key.partition("/")[2]: v for key, v in arrays.items() if key.startswith(f"{name}/")}

        return unpacked(own, json.loads(str(arrays["record"])), load)
    except StickslipError:
        raise
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        what = f"the fit is damaged ({type(error).__name__}: {error})"
        raise RunFolderError(what, file=path, hint="make the run again") from None


def _effect(effect: Any) -> dict[str, Any]:
    return {
        "tag": effect.tag,
        "form": {name: getattr(effect, name) for name in variants(effect)},
        "values": {name: float(getattr(effect, name)) for name in specs(effect)},
    }


def _with(problem: Problem, effects: list[dict[str, Any]]) -> Problem:
    for row in effects:
        effect = catalogue.get(row["tag"])(**row["form"])
        problem, _ = with_start(problem, effect, row["values"])
    return problem
