"""Whether block and drive go the same way: no spring pushes a block against its load point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..drive import Drive
from ..segment import block_motion, segment
from ..trace import Trace
from .finding import Finding
from .travel import travel

_AGAINST = 0.2  # share of the drive's way that the block goes against it, from which a sign is wrong
_POINTS = 2000


def sign_findings(traces: Sequence[Trace]) -> list[Finding]:
    """A finding for each run whose block travels against its drive, or one for all."""
    seen = {t.name: _against(t) for t in traces if t.drive is not None and t.leading != "spring_force"}
    wrong = {name: found for name, found in seen.items() if found is not None}
    if len(wrong) == len(seen) > 1:
        value, std = (float(v) for v in np.median(list(wrong.values()), axis=0))
        return [_finding(None, "all runs", value, std)]
    return [_finding(name, name, *found) for name, found in wrong.items()]


def _finding(run: str | None, where: str, value: float, std: float) -> Finding:
    sentence = (
        f"{where}: the block travels {value:.3f} (+-{std:.3f}) times as far as the drive, which no spring can do: the "
        "sign of the drive's velocity or of the reading is wrong. Turn the sign of drive_velocity (or of the drive's "
        "pieces), or that of the reading if the sensor looks from the other side."
    )
    return Finding("sign", run, 1.0, value, std, "1", sentence)


def _against(trace: Trace) -> tuple[float, float] | None:
    """Travel of the block over that of the drive and its deviation, where it is negative; else None."""
    assert trace.drive is not None
    stride = max(1, trace.time.size // _POINTS)
    x = np.asarray(block_motion(trace)[0])[::stride]
    way = trace.drive.position(trace.time[::stride])
    way = way - way.mean()
    if np.ptp(way) == 0.0:
        return None
    slope = float(np.sum(way * x) / np.sum(way**2))
    if slope > -_AGAINST:
        return None
    turned = trace.replace(drive=Drive(trace.drive.times, -trace.drive.positions))
    found = travel(turned, segment(turned))
    if found is None:
        return slope, float(np.std(x - x.mean() - slope * way) / np.std(way))
    return -found.slope, found.std
