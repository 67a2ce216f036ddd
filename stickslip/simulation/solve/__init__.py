"""Integrating the equation of motion with diffrax, the return map inside the step.

What needs diffrax is in modules of its own (`by_diffrax`, `stepper`, `derivatives`), for it takes long to import.
"""

from .integrate import integrate
from .tolerance import Tolerance
from .trajectory import Stats, Steps, Trajectory

__all__ = ["Stats", "Steps", "Tolerance", "Trajectory", "integrate"]
