"""An independent brute-force simulator of the rig, with its own forms of every effect.

It shares no law, no contact and no solver with the package's model, so that a diagnosis can fail on its data.
"""

from .bank import Bank, make_bank
from .campaigns import make_campaign
from .dynamics import Drive, Result, Rig, simulate
from .forms import CATALOGUED, EFFECTS, OUTSIDE, Setup, hide
from .lines import Surface
from .rigs import draw_setup
from .runs import Run

__all__ = [
    "CATALOGUED",
    "EFFECTS",
    "OUTSIDE",
    "Bank",
    "Drive",
    "Result",
    "Rig",
    "Run",
    "Setup",
    "Surface",
    "draw_setup",
    "hide",
    "make_bank",
    "make_campaign",
    "simulate",
]
