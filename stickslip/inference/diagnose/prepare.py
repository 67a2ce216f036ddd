"""From traces to the problem that a diagnosis solves: which runs take part, and where the fit of the base begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...data.campaign import Campaign
from ...data.first_cycles import first_cycles, shares
from ...data.prescribed import prescribed, with_motion
from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import ArgumentError, InputError, nearest
from ...physics.effects.base import Effect
from ...system.units import shown
from ..features.measurement import Measurement, doubts, measure
from ..fit.stated_rig import FALLBACK_PERIOD, ringing, shared_rig
from ..force.composition import PULL
from ..force.knots import Knots, knots
from ..force.point import Point
from ..force.prescribed import SAID, both_ways, thinned
from ..force.prescribed import begin as begin_prescribed
from ..force.problem import Problem
from ..force.scales import Scales, of_run, scales, too_coarse
from ..force.starting_values import begin
from ..force.stated_spring import SPRING

FEWEST = 2  # slips of a run that takes part
MOST_EVENTS = 200  # that a fit sees: its memory and time grow with them
MOST_CYCLES = 40  # of a run, that are run freely
NO_RINGING = "no ring-down is detected after the slips, so the contact's stiffness is known from the creep alone"


@dataclass(frozen=True)
class Prepared:
    """What a diagnosis or a fit of the dynamic model works on.

    Attributes:
        problem, start: the base model along the measured motion, and where its fit begins.
        traces, segmentations: of the runs that take part, in order.
        scales: times of the campaign.
        dropped: what was left out, and why.
        aside: names of runs that no fit sees.
        prescribed: whether the motion is and the force measured, with no driving spring between.
    """

    problem: Problem
    start: Point
    traces: tuple[Trace, ...]
    segmentations: tuple[Segmentation, ...]
    scales: Scales
    dropped: tuple[str, ...]
    aside: tuple[str, ...] = ()
    prescribed: bool = False

    @property
    def runs(self) -> tuple[Knots, ...]:
        """The runs at their knots."""
        return self.problem.runs

    def shows(self, effect: type[Effect]) -> bool:
        """Whether the records hold what an effect needs to be told at all: both signs of the force, a measured load."""
        return (not effect.both_ways or self.both_ways) and (not effect.measured or self.problem.loaded)

    @cached_property
    def both_ways(self) -> bool:
        """Whether the force takes both signs, each beyond a tenth of the other."""
        stated, composition = self.problem.values(self.start)[SPRING], self.problem.composition
        names = [f.name for f in composition.phases]
        begun = np.zeros(len(self.problem.runs))  # of a spring that was stretched when the record began
        if PULL in names:
            begun = self.start.phases[names.index(PULL)] * float(composition.phases[names.index(PULL)].scale)
        pulls = [
            (k.stiffness or stated) * (k.drive - k.x) + k.force + more
            for k, more in zip(self.problem.runs, begun, strict=True)
        ]
        return both_ways(np.concatenate(pulls))

    @cached_property
    def measurement(self) -> Measurement:
        """What a model that is run freely through the cycles is compared with (the first :data:`MOST_CYCLES` of a run).

        Raises:
            InputError: no cycle can be compared.
        """
        if self.prescribed:
            raise InputError("the motion is prescribed, so no slip is the block's own and none can be predicted")
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
        InputError: no run of that name; no run has displacement, drive and slips, or the mass is not given; nor has any
            a measured force and a motion of its own.
    """
    names = [t.name for t in traces]
    for name in holdout:
        if name not in names:
            raise ArgumentError("no run of this name to hold out", key="holdout", value=name, hint=nearest(name, names))
    used, given, dropped, kept_aside = [], [], [], []
    for trace, found in zip(traces, segmentations, strict=True):
        aside = trace.name in holdout or (not holdout and trace.role == "held-out")
        kept_aside += [trace.name] * aside
        why = "held out of all fits" if aside else _why_not(trace, found)
        if why and not aside and prescribed(trace, found):
            given.append((trace, found))
        if why:
            dropped.append(f"{trace.name}: {why}")
        else:
            used.append((trace, found))
    if not used and given:
        return replace(_prescribed(campaign, given), aside=tuple(kept_aside))
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
    counts = [len(s.events) for _, s in used]
    for i, ((trace, found), most) in enumerate(zip(used, shares(counts, MOST_EVENTS), strict=True)):
        used[i] = first_cycles(trace, found, max(most, FEWEST))
        if len(used[i][1].events) < counts[i]:
            dropped.append(
                f"{trace.name}: of {counts[i]} slips those after the first {len(used[i][1].events)}, for {MOST_EVENTS} "
                "take part in all (start and stop in the campaign's file choose another part of the record)"
            )
    kept, segments = tuple(t for t, _ in used), tuple(s for _, s in used)
    period = ringing(kept, segments)
    if period is None:
        dropped.append(NO_RINGING)
    rate = min(t.sampling_rate for t in kept)
    times = scales(used, period, rate)
    if times.hum.frequency:
        size = shown(times.hum.amplitude, "m", 2)
        dropped.append(f"hum of the sensor at {times.hum.frequency:g} Hz, {size}, which is taken off the displacement")
    coarse = too_coarse(times, rate)
    if coarse is not None:
        dropped.append(coarse)
    runs = [knots(t, s, of_run(times, t, s)) for t, s in used]
    rig = shared_rig(campaign, [t.name for t in kept])
    try:
        problem, start = begin(rig, kept, segments, runs, times)
    except InputError as error:
        raise error.at(file=campaign.path) from None
    return Prepared(problem, start, kept, segments, times, tuple(dropped), tuple(kept_aside))


def _prescribed(campaign: Campaign, given: Sequence[tuple[Trace, Segmentation]]) -> Prepared:
    """Runs without a driving spring."""
    traces, segments = tuple(with_motion(t) for t, _ in given), tuple(s for _, s in given)
    runs = [thinned(t) for t in traces]
    if not any(k.events for k in runs):
        raise InputError(
            "the motion never turns, stops or changes its speed, and that the contact is virgin where it begins is not "
            "stated",
            file=campaign.path,
            key=", ".join(f"trace '{t.name}' ({t.provenance.file})" for t in traces[:4]),
            hint="record a turn or a step of the velocity",
        )
    problem, start = begin_prescribed(shared_rig(campaign, [t.name for t in traces]), runs)
    step = 1.0 / min(t.sampling_rate for t in traces)
    return Prepared(problem, start, traces, segments, Scales(step, 0.0, step), (SAID,), prescribed=True)


def _why_not(trace: Trace, found: Segmentation) -> str:
    if trace.displacement is None:
        return "no displacement in it"
    if trace.drive is None:
        return "no drive is given"
    if len(found.events) < FEWEST:
        return f"{len(found.events)} slips, of which the dynamic model needs {FEWEST}"
    return ""
