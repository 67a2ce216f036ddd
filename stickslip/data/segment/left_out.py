"""What of the traces no fit uses, and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..trace import Trace
from .records import Segmentation


def left_out(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> list[str]:
    """What of the traces no fit uses, and why: channels and slips, each with the trace's name."""
    return [
        f"{t.name}: {text}"
        for t, s in zip(traces, segmentations, strict=True)
        for text in (*unused_channels(t), *map(str, s.dropped))
    ]


def unused_channels(trace: Trace) -> list[str]:
    """Channels that were measured and that no model takes up, in words."""
    if trace.normal_load is None:
        return []
    mean, low, high = (float(f(trace.normal_load)) for f in (np.mean, np.min, np.max))
    return [
        f"normal_load is not used by the models, which take the constant one of [rig]: mean {mean:.3g} N, "
        f"{low:.3g} to {high:.3g} N"
    ]
