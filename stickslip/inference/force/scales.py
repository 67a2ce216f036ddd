"""Times of a campaign that decide how its runs are thinned, and whether they are sampled finely enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...data.segment import Segmentation
from ...data.trace import Trace
from .kernels import kernels
from .mains import Hum, detect_hum

HALF = 3.0  # samples, the least half-width of the test function
COARSE = 0.15  # of a slip, the largest half-width that still resolves its inertia
LOUD = 0.1  # of the acceleration of a slip, the most that noise should add


@dataclass(frozen=True)
class Scales:
    """Times that decide how a run is thinned, of the data themselves.

    Attributes:
        half: half-width of the test function (s).
        ring: period of the ringing after an arrest (s); 0 where none is detected.
        slip: usual duration of a slip (s).
        hum: of the sensor.
    """

    half: float
    ring: float
    slip: float
    hum: Hum = field(default_factory=Hum)


def scales(runs: Sequence[tuple[Trace, Segmentation]], ring: float | None, rate: float) -> Scales:
    """The times of a campaign: medians over its slips, and the period of the ringing (s) where one is detected."""
    slip = float(np.median([e.duration for _, s in runs for e in s.events]))
    half = min(ring, slip / 8.0) if ring else slip / 12.0
    return Scales(max(half, HALF / rate), ring or 0.0, slip, detect_hum(runs, slip))


def of_run(times: Scales, trace: Trace, found: Segmentation) -> Scales:
    """Those of one run: its own slips decide where no ringing does, and the noise of its readings.

    The acceleration is a mean over the test function. It need not be told more finely than noise lets it be seen: where
    its noise is more than a share :data:`LOUD` of what a slip of half a period has, the mean is taken over longer.
    """
    if times.ring:
        return times
    slip = float(np.median([e.duration for e in found.events]))
    peak = 0.5 * float(np.median([e.slip for e in found.events])) * (np.pi / slip) ** 2
    rate = trace.sampling_rate
    for half in np.geomspace(max(slip / 12.0, HALF / rate), max(COARSE * slip, HALF / rate), 8):
        _, _, second = kernels(float(half), rate)
        if (trace.noise or 0.0) * float(np.sqrt((second**2).sum())) < LOUD * peak:
            break
    return replace(times, half=float(half), slip=slip)


def too_coarse(times: Scales, rate: float) -> str | None:
    """A sentence where samples lie too far apart for the inertia of a slip (sampling rate in Hz), else None."""
    if times.half <= COARSE * times.slip:
        return None
    return (
        f"sampling at {rate:.4g} Hz is too coarse for inertia: the acceleration is a mean over {2e3 * times.half:.3g} "
        f"ms of a slip of {1e3 * times.slip:.3g} ms, so mass, damping and effects within a slip are poorly determined; "
        f"at least {HALF / (COARSE * times.slip):.3g} Hz needed"
    )
