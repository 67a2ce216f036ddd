"""A fit as plain data and arrays, from which it is there again without being fitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..inference.diagnose.climb import Climbed
from ..inference.diagnose.engine import Rung, static_residual
from ..inference.force.candidates import with_start
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.fit import at
from ..inference.force.heldout import apart
from ..inference.force.problem import Problem
from ..inference.force.stored import fit_arrays, fit_of
from ..physics.effects import catalogue
from ..physics.params import specs, variants
from .campaign import Campaign
from .fit import Fit

Arrays = dict[str, np.ndarray]


def packed(fit: Fit, keep: Callable[[ForceFit, Arrays], str]) -> dict[str, Any]:
    """A fit as plain data.

    Args:
        fit: what to keep.
        keep: is given every model and its arrays, and returns the name under which they are found again.
    """
    done = fit._climbed
    rungs = [
        {
            "model": list(rung.model),
            "added": rung.added,
            "removed": rung.removed,
            "effects": [_effect(e) for e in rung.fit.problem.composition.effects],
            "arrays": keep(rung.fit, fit_arrays(rung.fit)),
        }
        for rung in done.ladder
        if rung.fit is not None
    ]
    moved = None if fit._moved is None else keep(fit._moved, fit_arrays(fit._moved))
    return {"rungs": rungs, "gains": dict(done.gains), "moved": moved}


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
    prepared = campaign.prepare()
    ladder: list[Rung] = []
    problem = prepared.problem
    for row in kept["rungs"]:
        problem = _with(prepared.problem, row["effects"])
        found = fit_of(problem, load(row["arrays"]))
        if not ladder:
            ladder.append(Rung(("static",), None, static_residual(found), None, None))
        residual = apart(found)
        ladder.append(Rung(tuple(row["model"]), row["added"], found.marginal, residual, found, row["removed"]))
    moved = None
    if kept["moved"]:
        last = ladder[-1].fit
        assert last is not None
        moved = fit_of(problem, load(kept["moved"]))
        moved = at(moved.problem, moved.point, moved.scatter, last)
    return Fit(campaign, Climbed(prepared, tuple(ladder), dict(kept["gains"])), moved)


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
