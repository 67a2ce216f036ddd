"""Scenarios: a rig and its drive in a TOML file, and the simulation of it."""

from .build import Setup, build
from .load import Scenario, load_scenario, make_scenario
from .simulate import Progress, simulate
from .stability import Sliding, steady_sliding
from .static import StaticCreep, static_creep

__all__ = [
    "Progress",
    "Scenario",
    "Setup",
    "Sliding",
    "StaticCreep",
    "build",
    "load_scenario",
    "make_scenario",
    "simulate",
    "static_creep",
    "steady_sliding",
]
