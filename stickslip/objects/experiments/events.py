"""A model freely integrated, and the means and scatter of slips, both measured and simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...data.drive import Drive
from ...data.segment import Segmentation, crept, segment
from ...data.trace import Trace
from ...simulation.scenario import Scenario
from ...simulation.scenario.recording import Recording
from ...simulation.scenario.simulation import record
from ...system.progress import breathe
from ..campaign import Campaign
from ..fit import Fit
from ..result_base import Tell
from .setting import Setting

Spread = tuple[float, float, int]  # mean, deviation, number
MEASURES = {"recurrence": "s", "slip": "m", "peak_velocity": "m/s", "creep_before_slip": "m"}


@dataclass(frozen=True)
class Simulated:
    """One simulated run, and what it was.

    Attributes:
        fit, setting, recording: the model, what it was put to, and what came of it.
        code: the lines of Python that lead to the model.
    """

    fit: Fit
    setting: Setting
    recording: Recording
    code: str = ""


def run(made: Scenario, tell: Tell | None = None, text: str = "simulating") -> Recording:
    """A scenario, freely integrated; ends where it is cancelled."""

    def progress(said: str, share: float) -> None:
        breathe()
        if tell is not None:
            tell(f"{text}: {said}", share)

    return record(made, progress)


def spread(values: Any) -> Spread:
    """Mean, deviation and number of what is known of the events after the first, where there are more."""
    found = np.asarray(values, float)
    found = found[1:] if found.size > 1 else found
    found = found[np.isfinite(found)]
    return (float(found.mean()), float(found.std()), int(found.size)) if found.size else (np.nan, np.nan, 0)


def measured(trace: Trace, found: Segmentation) -> dict[str, Spread]:
    """Mean, deviation and number of the events of a run, for each of :data:`MEASURES`."""
    own = {key: [getattr(e, key) for e in found.events] for key in ("recurrence", "slip", "peak_velocity")}
    return {key: spread(values) for key, values in {**own, "creep_before_slip": crept(trace, found)}.items()}


def simulated(recording: Recording, trace: Trace) -> dict[str, Spread]:
    """The same of a simulated run beside a measured one: with its sensor and its smallest slip.

    The recorder's own slips begin earlier, where the block outruns the load point; the creep between is no error.
    """
    t, x, drive = (recording[name].values for name in ("time", "displacement", "drive_position"))
    seen = sensed(trace, t, x, drive, virgin=trace.virgin)
    return measured(seen, segment(seen))


def sensed(like: Trace, t: np.ndarray, x: np.ndarray, drive: np.ndarray, **more: Any) -> Trace:
    """A motion with the sensor of a measured run, its noise and its smallest slip.

    Args:
        like: the measured run.
        t: s, shape (n,).
        x, drive: of the block and of the load point (m), shape (n,).
        more: of the :class:`Trace` besides.
    """
    own = like.leading == "displacement"
    return Trace(
        like.name, t, displacement=x, drive=Drive.sampled(t, drive), resolution=like.resolution if own else None,
        noise=like.noise if own else None, minimum_slip=like.minimum_slip, **more,
    )  # fmt: skip


def steady_runs(campaign: Campaign) -> dict[str, tuple[float, dict[str, Spread]]]:
    """Run -> its velocity (m/s) and :func:`measured`, for runs with slips and without a hold."""
    out = {}
    for trace, found in zip(campaign.traces, campaign.events, strict=True):
        if trace.drive is None or found.settings.unit != "m" or len(found.events) < 2:
            continue
        speeds = np.diff(trace.drive.positions) / np.diff(trace.drive.times)
        if np.ptp(speeds) <= 0.2 * np.abs(speeds).max():
            out[trace.name] = (trace.drive.speed, measured(trace, found))
    return out
