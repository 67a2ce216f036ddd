"""Friction that follows a normal load which was measured beside it."""

from __future__ import annotations

from typing import Any

from jax import Array

from ..params import parameter
from .base import Contact, Motion, Threshold
from .catalogue import register


@register
class MeasuredLoad(Threshold):
    """Caps in proportion to the normal load of the record's own channel (Amontons), or to a share of its changes.

    Only along a measured motion: a simulation has no measured load, and the law does nothing there.
    """

    tag = "measured-load"
    summary = "friction follows the measured normal load"
    equation = r"\mu \to \mu\,\left[1 + s\,(N/N_m - 1)\right]"
    symbols = {"N": "measured normal load (N)", "N_m": "its median over all runs (N)"}
    signature = "friction rises and falls with the load of the record; a share of 1 is Amontons' law"
    confused_with = {
        "load-modulation": "measure the load: a share of 1 with the measured load leaves no wave",
        "tilt": "measure the load: a tilt changes it in proportion to the spring's force",
        "position-dependent-friction": "go back over the same place at another load",
    }
    source = "Amontons (1699); Linker & Dieterich, J. Geophys. Res. 97 (1992) 4923, where the share is less than 1"
    family = "contact"
    measured = "normal_load"

    share: Array = parameter(
        null=0.0, unit="1", lower=-1.0, upper=5.0, symbol="s", doc="share of the load's changes in friction"
    )

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.share * (motion.load - 1.0)
