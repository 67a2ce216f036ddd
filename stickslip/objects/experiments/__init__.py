"""What the present model predicts: one run under another drive or rig, a sweep, and rivals in one experiment."""

from .events import MEASURES, Simulated, measured, run, simulated, spread, steady_runs
from .rival_experiments import SimulatedExperiment, rivals, simulate_rivals, where
from .setting import Setting, changes, practicable, scenario
from .sweeps import Swept, sweep

__all__ = [
    "MEASURES",
    "Setting",
    "Simulated",
    "SimulatedExperiment",
    "Swept",
    "changes",
    "measured",
    "practicable",
    "rivals",
    "run",
    "scenario",
    "simulate_rivals",
    "simulated",
    "spread",
    "steady_runs",
    "sweep",
    "where",
]  # fmt: skip
