"""Reports for people: what a run folder holds, as one HTML file, and the tables and sentences that go into it."""

from .abilities import Abilities, abilities
from .describe import describe_trace, event_units
from .excerpts import trace_pieces
from .html import REPORT, write_report

__all__ = [
    "REPORT",
    "Abilities",
    "abilities",
    "describe_trace",
    "event_units",
    "trace_pieces",
    "write_report",
]
