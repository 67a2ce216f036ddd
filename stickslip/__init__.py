"""stickslip: creep and stick-slip of a rough contact.

Public names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

# name -> module; names as text, so that a lower layer that imports this package does not see the higher ones
_PUBLIC = {
    "load_scenario": "scenario",
    "make_scenario": "scenario",
    "simulate": "scenario",
    "static_creep": "scenario",
    "build": "scenario",
    "steady_sliding": "scenario",
    "creep_curve": "contact",
    "rough_bank": "contact",
    "power_law_bank": "contact",
    "load_run": "scenario.fitted",
    "load_campaign": "objects",
    "Campaign": "objects",
    "study": "objects.study",
    "Fit": "objects",
    "Diagnosis": "objects",
    "workbench": "workbench",
    "Trace": "trace",
    "find_events": "segment:segment",
    "Model": "model",
    "Block": "model",
    "Weakening": "model",
    "LoadPoint": "model",
    "integrate": "solve",
    "slip_derivatives": "solve",
    "Vibrometer": "sensor",
    "measure": "sensor",
    "make_effect": "effects.catalogue:make",
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
