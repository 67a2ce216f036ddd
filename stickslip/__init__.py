"""stickslip: creep and stick-slip of a rough contact.

Public names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

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
    "bank_from_contact": "physics.contact",
    "RoughLines": "physics.contact",
    "power_law_bank": "physics.contact",
    "load_run": "objects.fitted_run",
    "load_fit": "objects.stored_fit",
    "load_campaign": "objects.campaign",
    "load_example": "objects.example",
    "Campaign": "objects.campaign",
    "compare": "objects.compare",
    "study": "objects.study",
    "sweep": "objects.sweep",
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
    "slip_derivatives": "simulation.solve.derivatives",
    "Vibrometer": "physics.sensor",
    "measure": "physics.sensor",
    "keep_compiled": "system.cache",
    "processor_limit": "system.threads",
    "progress_to": "system.progress",
    "effects": "effects",
    "make_effect": "physics.effects.catalogue:make",
    "StickslipError": "errors",
    "InputError": "errors",
    "SolveError": "errors",
    "FitError": "errors",
    "RunFolderError": "errors",
}

__all__ = ["__version__", *_PUBLIC]


if TYPE_CHECKING:  # the same for editors and type checkers
    from . import effects as effects
    from .data.segment import segment as _segment
    from .data.trace import Trace as Trace
    from .errors import FitError as FitError
    from .errors import InputError as InputError
    from .errors import RunFolderError as RunFolderError
    from .errors import SolveError as SolveError
    from .errors import StickslipError as StickslipError
    from .objects.campaign import Campaign as Campaign
    from .objects.campaign import load_campaign as load_campaign
    from .objects.compare import compare as compare
    from .objects.diagnosis import Diagnosis as Diagnosis
    from .objects.example import load_example as load_example
    from .objects.fit import Fit as Fit
    from .objects.fitted_run import load_run as load_run
    from .objects.stored_fit import load_fit as load_fit
    from .objects.study import study as study
    from .objects.sweep import sweep as sweep
    from .physics.contact import RoughLines as RoughLines
    from .physics.contact import bank_from_contact as bank_from_contact
    from .physics.contact import creep_curve as creep_curve
    from .physics.contact import power_law_bank as power_law_bank
    from .physics.effects.catalogue import make as _make
    from .physics.model import Block as Block
    from .physics.model import LoadPoint as LoadPoint
    from .physics.model import Model as Model
    from .physics.model import Weakening as Weakening
    from .physics.sensor import Vibrometer as Vibrometer
    from .physics.sensor import measure as measure
    from .simulation.scenario import build as build
    from .simulation.scenario import load_scenario as load_scenario
    from .simulation.scenario import make_scenario as make_scenario
    from .simulation.scenario import simulate as simulate
    from .simulation.scenario import static_creep as static_creep
    from .simulation.scenario import steady_sliding as steady_sliding
    from .simulation.solve import integrate as integrate
    from .simulation.solve.derivatives import slip_derivatives as slip_derivatives
    from .system.cache import keep_compiled as keep_compiled
    from .system.progress import progress_to as progress_to
    from .system.threads import processor_limit as processor_limit
    from .workbench import CallableModule as CallableModule

    find_events, make_effect = _segment, _make
    workbench: CallableModule
else:

    def __getattr__(name: str) -> Any:
        if name not in _PUBLIC:
            raise AttributeError(f"module 'stickslip' has no attribute '{name}'")
        module, _, attribute = _PUBLIC[name].partition(":")
        found = importlib.import_module(f"{__name__}.{module}")
        value = found if name == module else getattr(found, attribute or name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
