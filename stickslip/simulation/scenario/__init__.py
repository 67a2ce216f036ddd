"""Scenarios: a rig and its drive in a TOML file, and the simulation of it."""

from .build import Setup, build
from .load import Scenario, load_scenario, make_scenario
from .recording import Recording
from .simulation import record, simulate
from .stability import Sliding, steady_sliding
from .static import StaticCreep, static_creep

__all__ = [
    "Recording",
    "Scenario",
    "Setup",
    "Sliding",
    "StaticCreep",
    "build",
    "load_scenario",
    "make_scenario",
    "record",
    "simulate",
    "static_creep",
    "steady_sliding",
]
