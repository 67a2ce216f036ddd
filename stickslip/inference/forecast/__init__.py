"""Slips that are not alike: how their level wanders, and how well the next one can be foretold."""

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
