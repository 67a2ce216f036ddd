"""A fit as it is kept: the data of its ``result.json`` and the variables of its ``arrays.nc``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..inference.diagnose.free_simulation import Confirmation
from ..inference.diagnose.summary import fitted_sections
from ..show.report.excerpts import trace_sections
from ..show.report.identifiability import identifiability
from .result_base import head

if TYPE_CHECKING:
    from .fit import Fit


def fit_result(fit: Fit, confirmation: Confirmation) -> tuple[dict[str, Any], dict[str, Any]]:
    """Plain data, and variables as ``(dimension, values, attributes)``."""
    campaign, climbed, found = fit.campaign, fit.climbed, fit.force_fit
    sections, variables, fitted = fitted_sections(climbed.as_diagnosis(confirmation, campaign.rig), campaign.rig)
    described, pictured = trace_sections(campaign.displaced[0], campaign.scaled[0])
    result = {
        **head(campaign, "fit"),
        "model": "inertial",
        "model_parts": list(fit.parts),
        **sections,
        "gains": dict(climbed.gains),
        "profiles": [],
        "identifiability": identifiability(fitted, campaign.rig, sections["backbone"]["rough_line"]),
        **described,
        "fit": {
            "cost": found.cost,
            "evaluations": found.evaluations,
            "covariance": fitted.covariance,
            "ring_period": climbed.prepared.scales.ring,
            "cycles": found.problem.events,
        },
        "rig": [finding.plain() for finding in campaign.findings],
        "notes": [*campaign.scaled[1], *campaign.displaced[1]],
        "dropped": [*campaign.left_out, *sections["dropped"]],
    }
    return result, variables | pictured
