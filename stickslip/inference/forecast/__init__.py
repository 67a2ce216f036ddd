"""Slips that are not alike: how their level wanders, and how well the next one can be foretold."""

from .levels import Wandering, levels, wandering
from .predict import METHODS, Compared, Forecaster
from .rolling import Rolled, prepare, roll
from .scoring import crps
from .wander import Component, Filter, Wander, fit, log_likelihood

__all__ = [
    "METHODS",
    "Compared",
    "Component",
    "Filter",
    "Forecaster",
    "Rolled",
    "Wander",
    "Wandering",
    "crps",
    "fit",
    "levels",
    "log_likelihood",
    "prepare",
    "roll",
    "wandering",
]
