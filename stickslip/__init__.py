"""stickslip: creep and stick-slip of a rough contact.

Public names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

# name -> module; names as text, so that a lower layer that imports this package does not see the higher ones
_PUBLIC = {
    "load_scenario": "simulation.scenario",
    "make_scenario": "simulation.scenario",
    "simulate": "simulation.scenario",
    "static_creep": "simulation.scenario",
    "build": "simulation.scenario",
    "steady_sliding": "simulation.scenario",
    "creep_curve": "physics.contact",
    "rough_bank": "physics.contact",
    "power_law_bank": "physics.contact",
    "load_run": "objects.fitted_run",
    "load_campaign": "objects.campaign",
    "Campaign": "objects.campaign",
    "study": "objects.study",
    "Fit": "objects.fit",
    "Diagnosis": "objects.diagnosis",
    "workbench": "workbench",
    "Trace": "data.trace",
    "find_events": "data.segment:segment",
    "Model": "physics.model",
    "Block": "physics.model",
    "Weakening": "physics.model",
    "LoadPoint": "physics.model",
    "integrate": "simulation.solve",
    "slip_derivatives": "simulation.solve",
    "Vibrometer": "physics.sensor",
    "measure": "physics.sensor",
    "make_effect": "physics.effects.catalogue:make",
    "StickslipError": "errors",
    "InputError": "errors",
    "SolveError": "errors",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'stickslip' has no attribute '{name}'")
    module, _, attribute = _PUBLIC[name].partition(":")
    found = importlib.import_module(f"{__name__}.{module}")
    value = found if name == module else getattr(found, attribute or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
