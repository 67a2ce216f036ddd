"""The static contact: rough lines, indentation, tangential loading, banks of Jenkins elements, hysteresis."""

from .. import precision  # noqa: F401  (64-bit before the first array)
from .bank import Bank, bank_from_backbone, binning_error, concatenate, default_edges, return_map
from .power_law import mixture, normal_scores, power_law_backbone, power_law_bank

__all__ = [
    "Bank",
    "bank_from_backbone",
    "binning_error",
    "concatenate",
    "default_edges",
    "mixture",
    "normal_scores",
    "power_law_backbone",
    "power_law_bank",
    "return_map",
]
