"""The static contact: rough lines, indentation, tangential loading, banks of Jenkins elements, hysteresis."""

from ...system import jax_settings  # noqa: F401  (before the first array)
from .bank import Bank, bank_from_backbone, binning_error, concatenate, default_edges, return_map
from .creep import (
    CreepCurve,
    creep_curve,
    creep_displacements,
    default_loads,
    line_average,
    rough_table,
    static_contact,
    virtual_time,
)
from .elastic import Moduli, equal_bodies, two_bodies
from .hysteresis import Hysteresis, damping_ratio, loop_area, microslip_ring_down, power_law_damping_ratio
from .indentation import Indentation, SaturationWarning, check_saturation, indentation
from .memory import Arrest, arrest, arrest_force, loading_displacement, reload_displacement
from .power_law import mixture, normal_scores, power_law_backbone, power_law_bank
from .profiles import (
    Profile,
    add_curvature,
    cone,
    exponential_gaps,
    flat_punch,
    from_heights,
    heights_from_scan,
    power_law,
    profile_from_heights,
    sphere,
)
from .rough_bank import bank_from_contact, rough_bank, spring_bank
from .roughness import cut_to_line_factor, line_phasors, lines_from_phasors, rough_lines
from .tangential import StaticContact
from .touching import touching

__all__ = [
    "Arrest",
    "Bank",
    "CreepCurve",
    "Hysteresis",
    "Indentation",
    "Moduli",
    "Profile",
    "SaturationWarning",
    "StaticContact",
    "add_curvature",
    "arrest",
    "arrest_force",
    "bank_from_backbone",
    "bank_from_contact",
    "binning_error",
    "check_saturation",
    "concatenate",
    "cone",
    "creep_curve",
    "creep_displacements",
    "cut_to_line_factor",
    "damping_ratio",
    "default_edges",
    "default_loads",
    "equal_bodies",
    "exponential_gaps",
    "flat_punch",
    "from_heights",
    "heights_from_scan",
    "indentation",
    "line_average",
    "line_phasors",
    "lines_from_phasors",
    "loading_displacement",
    "loop_area",
    "microslip_ring_down",
    "mixture",
    "normal_scores",
    "power_law",
    "power_law_backbone",
    "power_law_bank",
    "power_law_damping_ratio",
    "profile_from_heights",
    "reload_displacement",
    "return_map",
    "rough_bank",
    "rough_lines",
    "rough_table",
    "sphere",
    "spring_bank",
    "static_contact",
    "touching",
    "two_bodies",
    "virtual_time",
]
