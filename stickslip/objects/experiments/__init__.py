"""What the present model predicts: one run under another drive or rig, a sweep, and rivals in one experiment."""

from .events import MEASURES, Simulated, measured, part, run, simulated, spread, steady_runs
from .setting import Setting, changes, practicable, scenario
from .sweeps import Swept, sweep
from .telling import Telling, rivals, tell_apart, where

__all__ = [
    "MEASURES", "Setting", "Simulated", "Swept", "Telling", "changes", "measured", "part", "practicable", "rivals",
    "run", "scenario", "simulated", "spread", "steady_runs", "sweep", "tell_apart", "where",
]  # fmt: skip
