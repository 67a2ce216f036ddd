"""What a report shows of the runs of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...data.segment import Segmentation
from ...data.trace import Trace
from .describe import describe_trace
from .excerpts import Variables, trace_pieces


def trace_sections(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> tuple[dict[str, Any], Variables]:
    """Entries of ``result.json`` on the traces, and the variables behind their pictures."""
    pairs = list(zip(traces, segmentations, strict=True))
    variables: Variables = {}
    for i, (trace, found) in enumerate(pairs):
        variables |= trace_pieces(trace, found, i)
    return {"traces": [describe_trace(t, s) for t, s in pairs]}, variables
