"""Pictures for people: matplotlib without a screen, units on every axis, lines that differ in grey too."""

from .creep import creep_figure, static_against_inertial
from .effect import effect_figure
from .series import series_figure
from .style import save
from .trace import trace_figure

__all__ = ["creep_figure", "effect_figure", "save", "series_figure", "static_against_inertial", "trace_figure"]
