"""Parameters of a fit set or held by hand: what the model then is, and how much worse it then fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, nearest
from ..inference.diagnose.model_ladder import profiled
from ..inference.fit.parameters import Free
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.fit import at
from ..inference.force.fit import fit as fit_force
from ..inference.force.profile_deviations import pinned
from ..system.object_repr import table
from ..system.progress import part
from ..system.units import shown, to_si
from .fit_tables import STRENGTH
from .result_base import Tell

if TYPE_CHECKING:
    import pandas

    from .fit import Fit

HELD = 1e-6  # width of the prior that holds a parameter, on its search scale


def moved(fit: Fit, values: Mapping[str, float | str]) -> ForceFit:
    """See :meth:`stickslip.Fit.with_values`."""
    found = fit.force_fit
    z, weights = found.point.z.copy(), found.point.weights
    for name, value in values.items():
        if name == STRENGTH:
            strength = to_si(value, "N", key=name)
            if not strength > 0.0:
                raise InputError("out of range", key=name, value=value, allowed="more than 0 N")
            weights = weights * (strength / found.strength)
            continue
        i, f = _free(fit, name)
        number = to_si(value, f.unit, key=name)
        if not f.lower <= number <= f.upper:
            allowed = f"{shown(f.lower, f.unit)} to {shown(f.upper, f.unit)}"
            raise InputError("out of range", key=name, value=value, allowed=allowed)
        z[i] = f.inward(number)
    return at(found.problem, replace(found.point, z=z, weights=weights), found.scatter, found)


def refitted(fit: Fit, locked: Sequence[str]) -> ForceFit:
    """See :meth:`stickslip.Fit.refit`."""
    found = fit.force_fit
    held = {name: float(found.point.z[_free(fit, name)[0]]) for name in locked}
    problem = pinned(found, held, HELD) if held else found.problem
    again = fit_force(problem, found.point, found.scatter, dropped=found.dropped, first=True)
    if held:
        free = again.problem.with_composition(replace(again.problem.composition, free=found.problem.composition.free))
        again = at(free, again.point, again.scatter, again)
    return again


def profile(fit: Fit, name: str, tell: Tell) -> dict[str, Any]:
    """See :meth:`stickslip.Fit.profile`."""
    _, f = _free(fit, name)
    found = profiled(fit.force_fit, name, tell)
    low, high = (f.outward(v) if np.isfinite(v) else None for v in found.interval)
    low_text, high_text = ("-" if v is None else shown(v, f.unit, 3) for v in (low, high))
    return {
        "name": name,
        "unit": f.unit,
        "value": [f.outward(float(v)) for v in found.z],
        "rise": found.rise,
        "interval": [low, high],
        "text": f"{found.text}; 95 % interval {low_text} to {high_text}",
    }


def intervals(fit: Fit, names: Sequence[str], tell: Tell) -> pandas.DataFrame:
    """See :meth:`stickslip.Fit.intervals`."""
    every, rows = names or [f.name for f in fit.free], {}
    for name in every:
        _free(fit, name)  # a wrong name is refused before anything is fitted
    for i, name in enumerate(every):
        found = profile(fit, name, part(tell, i, len(every)))
        value, std = fit.values[name], fit.std[name]
        low, high = (np.nan if v is None else v for v in found["interval"])
        std = std if std > 0.0 else np.nan  # at a bound it has none
        sides = (low - value) / std, (high - value) / std
        rows[name] = {"value": value, "low": low, "high": high, "low / std": sides[0], "high / std": sides[1]}
        rows[name]["unit"] = found["unit"]
    return table(rows, "parameter")


def _free(fit: Fit, name: str) -> tuple[int, Free]:
    names = [f.name for f in fit.free]
    if name not in names:
        raise InputError("no free parameter of that name", key=name, hint=nearest(name, names))
    i = names.index(name)
    return i, fit.free[i]
