"""A driving spring that is not linear over its stroke."""

from __future__ import annotations

from jax import Array

from ..params import parameter, variant
from .base import Spring
from .catalogue import register

STROKE = 1e-4  # m; the elongation at which both forms have the same relative deviation


@register
class NonlinearSpring(Spring):
    """Stiffness that changes with the elongation: of a bent beam (quadratic), of a stretched wire (cubic)."""

    tag = "nonlinear-spring"
    summary = "force of the driving spring is not proportional to its elongation"
    equation = (
        r"F_{\mathrm{spring}} \to F_{\mathrm{spring}}\,[1 + \beta\,(x_0 - x)] \quad\mathrm{or}\quad"
        r" F_{\mathrm{spring}}\,[1 + \beta\,(x_0 - x)^2/(0.1\,\mathrm{mm})]"
    )
    signature = "relation of recurrence and slip size; recurrence of the first event, which loads the spring from zero"
    confused_with = {
        "tilt": "calibrate the spring with weights",
        "viscous-drag": "calibrate the spring with weights, or free vibration of the block without contact",
        "contact-ageing": "change the drive velocity at the same stroke",
    }
    source = "Nayfeh & Mook, Nonlinear Oscillations (1979), ch. 4"
    family = "block"

    curvature: Array = parameter(
        null=0.0, unit="1/m", lower=-800.0, upper=800.0, symbol=r"\beta",
        doc="relative change of the secant stiffness per metre of elongation (at 0.1 mm in the cubic form)"
    )  # fmt: skip
    form: str = variant("quadratic", ("quadratic", "cubic"), "one-sided (beam) or symmetric (wire)")

    def formula(self) -> str:
        lever = "(x_0 - x)" if self.form == "quadratic" else r"(x_0 - x)^2/(0.1\,\mathrm{mm})"
        return rf"F_{{\mathrm{{spring}}}} \to F_{{\mathrm{{spring}}}}\,[1 + \beta\,{lever}]"

    def pull(self, stretch: Array, pull: Array) -> Array:
        lever = stretch if self.form == "quadratic" else stretch * stretch / STROKE
        return pull * (1.0 + self.curvature * lever)
