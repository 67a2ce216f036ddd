"""What a file with a law of one's own imports: the roles, the declaration of parameters, the catalogue and its checks.

>>> from stickslip.effects import Threshold, parameter

The laws themselves are in :mod:`stickslip.physics.effects`.
"""

from .physics.effects.base import (
    BodyForce,
    Contact,
    Drive,
    Effect,
    Flow,
    Geometry,
    Inertia,
    Memory,
    Motion,
    Sensor,
    Spring,
    Stiffness,
    Threshold,
)
from .physics.effects.catalogue import forms, get, make, register, roles, table, tags
from .physics.params import parameter, variant
from .simulation.conformance import check_effect, load_file

__all__ = [
    "BodyForce",
    "Contact",
    "Drive",
    "Effect",
    "Flow",
    "Geometry",
    "Inertia",
    "Memory",
    "Motion",
    "Sensor",
    "Spring",
    "Stiffness",
    "Threshold",
    "check_effect",
    "forms",
    "get",
    "load_file",
    "make",
    "parameter",
    "register",
    "roles",
    "table",
    "tags",
    "variant",
]
