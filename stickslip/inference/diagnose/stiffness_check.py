"""Mass and spring of the file against the slips, before a diagnosis: the base with the stiffness stated, and free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...data.campaign import Campaign
from ...data.checks import Finding
from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import StickslipError
from ..force.fit import fit_base
from ..force.stated_spring import slips_finding, spring_freed, within_knowledge
from .decide import Judge
from .prepare import prepare

OR_ELSE = (
    " An effect on the spring's force (a nonlinear spring, tilt, the spring's own inertia) makes much the same: "
    "stickslip diagnose compares them."
)


def spring_finding(campaign: Campaign, traces: Sequence[Trace], found: Sequence[Segmentation]) -> Finding | None:
    """What the slips say of spring over mass, where that is not what the file states; None where nothing can be said.

    Args:
        campaign, traces, found: the measurement, one segmentation for each trace.
    """
    rig = campaign.rig
    if not (isinstance(rig.mass, float) and isinstance(rig.spring_stiffness, float)):
        return None
    try:
        prepared = prepare(campaign, traces, found)
        base = fit_base(prepared.problem, prepared.start)
        freed = spring_freed(base)
        if freed is None or not Judge(base, 1).beside(freed, 1).seen:
            return None
        if within_knowledge(base, freed):
            return None
    except StickslipError:  # too little for a fit: inspect has said so already
        return None
    finding = slips_finding(base, freed)
    return replace(finding, sentence=finding.sentence + OR_ELSE, stops=False)
