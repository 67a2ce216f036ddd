"""What the model as it stands foretells: one run under another drive or rig, a sweep, and rivals in one experiment."""

from .events import MEASURES, Simulated, measured, run, simulated, spread, steady_runs
from .proposed import beyond, proposed, undecided, usual
from .rivals import Telling, compare, difference, farthest, rivals, scatter, tell_apart, where
from .setting import Setting, changes, scenario
from .sweeps import Swept, sweep
from .synthetic import write

__all__ = [
    "MEASURES",
    "Setting",
    "Simulated",
    "Swept",
    "Telling",
    "beyond",
    "changes",
    "compare",
    "difference",
    "farthest",
    "measured",
    "proposed",
    "rivals",
    "run",
    "scatter",
    "scenario",
    "simulated",
    "spread",
    "steady_runs",
    "sweep",
    "tell_apart",
    "undecided",
    "usual",
    "where",
    "write",
]
