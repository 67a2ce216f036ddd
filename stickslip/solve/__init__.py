"""Integrating the equation of motion with diffrax, the return map inside the step."""

from .integrate import integrate
from .stepper import ContactStepper, Tolerance
from .trajectory import Stats, Steps, Trajectory

__all__ = ["ContactStepper", "Stats", "Steps", "Tolerance", "Trajectory", "integrate"]
