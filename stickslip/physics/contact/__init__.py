"""The static contact: rough lines, indentation, tangential loading, banks of Jenkins elements, hysteresis."""

from ...system import jax_settings  # noqa: F401  (before the first array)
from .bank import Bank, bank_from_backbone, binning_error, default_edges
from .contact_bank import bank_from_contact
from .creep import (
    creep_curve,
    creep_displacements,
    default_loads,
    line_average,
    virtual_time,
)
from .elastic import Moduli, equal_bodies, two_bodies
from .hysteresis import Hysteresis
from .indentation import Indentation, SaturationWarning, check_saturation, indentation
from .memory import arrest, arrest_force, loading_displacement, reload_displacement
from .power_law import mixture, normal_scores, power_law_backbone, power_law_bank
from .profiles import (
    Profile,
    add_curvature,
    cone,
    flat_punch,
    from_heights,
    heights_from_scan,
    power_law,
    sphere,
)
from .rough_lines import RoughLines
from .roughness import cut_to_line_factor, line_phasors
from .tangential import StaticContact, static_contact
from .touching import touching

__all__ = [
    "Bank",
    "Hysteresis",
    "Indentation",
    "Moduli",
    "Profile",
    "RoughLines",
    "SaturationWarning",
    "StaticContact",
    "add_curvature",
    "arrest",
    "arrest_force",
    "bank_from_backbone",
    "bank_from_contact",
    "binning_error",
    "check_saturation",
    "cone",
    "creep_curve",
    "creep_displacements",
    "cut_to_line_factor",
    "default_edges",
    "default_loads",
    "equal_bodies",
    "flat_punch",
    "from_heights",
    "heights_from_scan",
    "indentation",
    "line_average",
    "line_phasors",
    "loading_displacement",
    "mixture",
    "normal_scores",
    "power_law",
    "power_law_backbone",
    "power_law_bank",
    "reload_displacement",
    "sphere",
    "static_contact",
    "touching",
    "two_bodies",
    "virtual_time",
]
