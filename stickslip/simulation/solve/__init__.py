"""Integrating the equation of motion with diffrax, the return map inside the step."""

from .derivatives import Slips, slip_derivatives
from .integrate import integrate
from .stepper import ContactStepper, Increments, Tolerance
from .trajectory import Stats, Steps, Trajectory

__all__ = [
    "ContactStepper",
    "Increments",
    "Slips",
    "Stats",
    "Steps",
    "Tolerance",
    "Trajectory",
    "integrate",
    "slip_derivatives",
]
