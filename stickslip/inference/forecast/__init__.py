"""Slips that vary: how the level of friction wanders, and how well the next slip can be predicted."""

from .levels import levels, wandering
from .scoring import crps
from .wander import Component, Wander, fit

__all__ = [
    "Component",
    "Wander",
    "crps",
    "fit",
    "levels",
    "wandering",
]
