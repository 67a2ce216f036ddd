"""Everything that the file states of rig and sensors and that the motion can contradict without a model."""

from __future__ import annotations

from collections.abc import Sequence

from ..campaign import Campaign
from ..segment import Segmentation
from ..trace import Trace
from .finding import Finding
from .scales import scale_findings
from .sign import sign_findings
from .slip_time import mass_findings
from .spring_force import force_findings
from .travel import travel


def rig_against_motion(
    campaign: Campaign, traces: Sequence[Trace], segmentations: Sequence[Segmentation]
) -> tuple[Finding, ...]:
    """What of a campaign's statements the motion contradicts beyond its error, the gravest first.

    Args:
        campaign, traces, segmentations: the measurement, one segmentation for each trace.

    Returns:
        Findings; none where everything goes together.
    """
    wrong = sign_findings(traces)
    signs = {f.run for f in wrong}
    travels = [None if signs & {None, t.name} else travel(t, s) for t, s in zip(traces, segmentations, strict=True)]
    return (
        *wrong, *scale_findings(campaign, traces, travels), *force_findings(traces, segmentations),
        *mass_findings(campaign, traces, segmentations),
    )  # fmt: skip
