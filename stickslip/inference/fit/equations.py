"""The equations that a fitted model solves: those of its block, friction and effects, and the backbone of its bank."""

from __future__ import annotations

from ...physics.effects.equations import Equations, PowerLaw, of_model
from .serialised import Fitted, constant_drive


def solved(found: Fitted) -> Equations:
    """Equations and parameters with their fitted values."""
    values, composition = found.values, found.composition
    contact = PowerLaw(
        strength=values["contact.strength"],
        u_max=values["contact.u_max"],
        p=values["contact.p"],
        spread=values["contact.spread"],
        contacts=composition.contacts,
        elements=composition.bins,
    )
    return of_model(found.model(constant_drive(1e-4)), contact)
