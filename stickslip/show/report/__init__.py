"""Reports for people: what a run folder holds, as one HTML file, and the tables and sentences that go into it."""

from .describe import describe_trace
from .excerpts import trace_pieces
from .html import write_report

__all__ = ["describe_trace", "trace_pieces", "write_report"]
