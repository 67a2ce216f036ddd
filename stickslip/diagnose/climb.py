"""A ladder whose effects are chosen beforehand, and the profile likelihood of what was fitted on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..effects import catalogue
from ..errors import FitError, InputError
from ..force.candidates import shapes_backbone, try_effect
from ..force.fit import Fit, deviations, fit, refit
from ..force.heldout import unseen
from ..force.score import Explained
from ..uncertainty import Profile, profile
from .confirm import confirm
from .decide import DISPERSION
from .engine import Diagnosis, Rung, Verdict, leading, settled, static_residual
from .prepare import Prepared
from .shape import shape_of
from .trials import Tell

Form = tuple[str, Mapping[str, str]]  # tag and variants of an effect
PIN = 1e-3  # width of the prior that holds a profiled parameter, on the search scale


def climb(prepared: Prepared, effects: Sequence[Form], rig: Any, tell: Tell) -> tuple[Diagnosis, dict[str, float]]:
    """Fit the base along the measured motion, then each effect on top of the ones before it.

    Args:
        prepared: the data.
        effects: in this order.
        rig: of the campaign.
        tell: told the stage and the share of it done.

    Returns:
        The ladder as a diagnosis without rounds, and by how much each effect lowers the cost.

    Raises:
        InputError: an effect only gives the backbone another shape, which is measured as it is.
        FitError: a model could not be fitted.
    """
    for tag, form in effects:
        if shapes_backbone(catalogue.get(tag)(**form)):
            raise InputError(
                "the effect only gives the contact's backbone another shape, which the fit measures as it is",
                key="--add",
                value=":".join([tag, *(f"{name}={value}" for name, value in form.items())]),
                hint="leave it out: its part is in the backbone already",
            )
    tell("the base model", 0.0)
    base = fit(prepared.problem, prepared.start)
    ladder = [Rung(("static",), None, static_residual(base), None, None), _rung(("static", "inertia"), "inertia", base)]
    gains: dict[str, float] = {}
    for i, (tag, form) in enumerate(effects):
        tell(f"adding {tag}", (i + 1) / (len(effects) + 2))
        (found,) = try_effect(base, Explained(base), tag, [dict(form)])
        if found.fit is None:
            raise FitError(f"{tag} could not be fitted: {found.note or 'no finite model with it'}")
        gains[tag] = max(base.cost - found.fit.cost, 0.0)
        base = settled(base, found)
        ladder.append(_rung((*ladder[-1].model, tag), tag, base))
    tell("free simulation", 1.0)
    confirmed = confirm(leading(ladder, {}), ladder[-1].model, prepared, tell=tell)
    verdict = Verdict("fitted", tuple(gains))
    found_all = Diagnosis(
        verdict, tuple(ladder), (), {}, prepared, deviations(base), shape_of(base, rig), prepared.dropped,
        confirmation=confirmed,
    )  # fmt: skip
    return found_all, gains


def _rung(model: tuple[str, ...], added: str, found: Fit) -> Rung:
    return Rung(model, added, found.marginal, unseen(found).residual, found)


def profiled(found: Fit, name: str, tell: Tell) -> Profile:
    """Profile likelihood of a shared parameter: held at values around its best one, all others refitted.

    Args:
        found: an optimum.
        name: of one of its free parameters.
        tell: told how many values are done.
    """
    free = found.free
    k = [f.name for f in free].index(name)
    f, composition = free[k], found.problem.composition

    def cost(value: float) -> float:
        held = replace(f, prior=f.outward(value), width=PIN)
        pinned = replace(composition, free=tuple(held if g is f else g for g in composition.free))
        z = found.point.z.copy()
        z[k] = value
        again = refit(found.problem.with_composition(pinned), replace(found.point, z=z), found)
        own = 0.0 if not np.isfinite(f.width) else ((value - f.inward(f.prior)) / f.width) ** 2
        return (again.cost - ((again.point.z[k] - value) / PIN) ** 2 + own) / DISPERSION

    std = float(np.sqrt(max(found.covariance[k, k], 0.0)))
    return profile(
        name, float(found.point.z[k]), std, f.bounds, cost,
        progress=lambda done, of: tell(f"profile of {name}: {done} of {of}", done / of),
    )  # fmt: skip
