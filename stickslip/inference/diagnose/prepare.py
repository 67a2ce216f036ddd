"""From traces to the problem that a diagnosis solves: which runs take part, and where the fit of the base begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ...data.campaign import Campaign
from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import InputError, nearest
from ..features.measurement import Measurement, doubts, measure
from ..fit.start import FALLBACK_PERIOD, ringing, shared_rig
from ..force.knots import Knots, knots
from ..force.problem import Point, Problem
from ..force.scales import Scales, scales, too_coarse
from ..force.starting_values import begin

FEWEST = 2  # slips of a run that takes part
MOST_CYCLES = 40  # of a run, that are run freely
UNHEARD = "no ringing is heard after the slips, so the contact's stiffness is known from the creep alone"


@dataclass(frozen=True)
class Prepared:
    """What a diagnosis or a fit of the dynamic model works on.

    Attributes:
        problem, start: the base model along the measured motion, and where its fit begins.
        traces, segmentations: of the runs that take part, in order.
        scales: times of the campaign.
        dropped: what was left out, and why.
    """

    problem: Problem
    start: Point
    traces: tuple[Trace, ...]
    segmentations: tuple[Segmentation, ...]
    scales: Scales
    dropped: tuple[str, ...]

    @property
    def runs(self) -> tuple[Knots, ...]:
        """The runs at their knots."""
        return self.problem.runs

    @cached_property
    def measurement(self) -> Measurement:
        """What a model that is run freely through the cycles is compared with (the first :data:`MOST_CYCLES` of a run).

        Raises:
            InputError: no cycle can be compared.
        """
        ring = self.scales.ring or FALLBACK_PERIOD
        return measure(self.traces, self.segmentations, ring_period=ring, most_cycles=MOST_CYCLES)


def prepare(
    campaign: Campaign, traces: Sequence[Trace], segmentations: Sequence[Segmentation], holdout: Sequence[str] = ()
) -> Prepared:
    """Thin all runs that can take part, and look where the base begins.

    Args:
        campaign, traces, segmentations: the measurement.
        holdout: runs to keep aside.

    Raises:
        InputError: no run of that name; no run has displacement, drive and slips, or the mass is not given.
    """
    names = [t.name for t in traces]
    for name in holdout:
        if name not in names:
            raise InputError("no run of this name to hold out", key="--holdout", value=name, hint=nearest(name, names))
    used, dropped = [], []
    for trace, found in zip(traces, segmentations, strict=True):
        aside = trace.name in holdout or (not holdout and trace.role == "held-out")
        why = "kept aside: no fit sees it" if aside else _why_not(trace, found)
        if why:
            dropped.append(f"{trace.name}: {why}")
        else:
            used.append((trace, found))
    if not used:
        usable = [t for t in traces if t.displacement is not None and t.drive is not None]
        slips = max((len(s.events) for s in segmentations), default=0)
        raise InputError(
            f"{'one slip' if slips == 1 else 'no slip'} in any run: the dynamic model needs two at least in one of them"
            if usable and slips < FEWEST
            else "the dynamic model needs the displacement of the block, the motion of the drive, and slips",
            file=campaign.path,
            key=", ".join(f"trace '{t.name}' ({t.provenance.file})" for t in traces[:4]) + ", ..." * (len(traces) > 4),
            hint="record longer, drive slower or with a softer spring; others can be inspected and fitted with "
            f"--model static. {'; '.join(dropped)}{doubts(traces)}",
        )
    kept, segments = tuple(t for t, _ in used), tuple(s for _, s in used)
    period = ringing(kept, segments)
    if period is None:
        dropped.append(UNHEARD)
    rate = min(t.sampling_rate for t in kept)
    times = scales(list(segments), period, rate)
    coarse = too_coarse(times, rate)
    if coarse is not None:
        dropped.append(coarse)
    runs = [knots(t, s, times) for t, s in used]
    rig = shared_rig(campaign, [t.name for t in kept])
    try:
        problem, start = begin(rig, kept, segments, runs, times)
    except InputError as error:
        raise error.at(file=campaign.path) from None
    return Prepared(problem, start, kept, segments, times, tuple(dropped))


def _why_not(trace: Trace, found: Segmentation) -> str:
    if trace.displacement is None:
        return "no displacement in it"
    if trace.drive is None:
        return "no drive is given"
    if len(found.events) < FEWEST:
        return f"{len(found.events)} slips, of which the dynamic model needs {FEWEST}"
    return ""
