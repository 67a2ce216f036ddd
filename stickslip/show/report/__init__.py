"""Reports for people: what a run folder holds, as one HTML file, and the tables and sentences that go into it."""

from .abilities import abilities
from .describe import describe_trace
from .excerpts import trace_pieces
from .html import write_report

__all__ = ["abilities", "describe_trace", "trace_pieces", "write_report"]
