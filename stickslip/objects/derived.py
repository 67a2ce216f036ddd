"""Quantities that follow from the parameters of a fit, with their deviations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import approx_fprime

from ..errors import InputError, nearest
from ..system.object_repr import quantity
from ..system.units import shown_with

if TYPE_CHECKING:
    from .fit import Fit

STEP = 1e-4  # of a finite difference, in standard deviations


class Derived(NamedTuple):
    """A derived quantity.

    Attributes:
        value: a number or an array, in the unit of the function that made it.
        std: its standard deviation, of the same shape.
    """

    value: Any
    std: Any

    def __repr__(self) -> str:
        if isinstance(self.value, float) and isinstance(self.std, float):
            return f"Derived({shown_with(self.value, self.std)})"
        return f"Derived(shape={np.shape(self.value)}, value={quantity(self.value)}, std={quantity(self.std)})"


class _Values(dict[str, float]):
    def __missing__(self, name: str) -> float:
        raise InputError("no parameter of that name", key="function", value=name, hint=nearest(name, self))


def derived(fit: Fit, function: Callable[[Mapping[str, float]], Any]) -> Derived:
    """A quantity that follows from the parameters, with the deviation that they leave to it:
    ``fit.derived(lambda p: p["weakening.drop"] * p["contact.strength"])``.

    To first order: by the gradient (finite differences) and :attr:`stickslip.Fit.covariance`. What is not fitted is
    exact.

    Args:
        fit: whose parameters; called as its method, the fit itself.
        function: takes :attr:`stickslip.Fit.values` (name -> SI) and returns a number, or an array of any shape.

    Returns:
        ``value`` and ``std``, in the unit of what the function returns and of its shape.

    Raises:
        InputError: the function asks for a parameter that is none, or does not return finite numbers.
    """
    values, names = fit.values, fit.covariance.parameter.values.tolist()
    std = np.array([fit.std[name] for name in names])

    def at(away: np.ndarray) -> np.ndarray:
        moved = {name: values[name] + float(step) for name, step in zip(names, away * std, strict=True)}
        made = function(_Values({**values, **moved}))
        with suppress(TypeError, ValueError):
            found = np.asarray(made, float)
            if np.isfinite(found).all():
                return found
        raise InputError("it does not return finite numbers", key="function", value=made, allowed="a number, an array")

    value = at(np.zeros(std.size))
    slopes = approx_fprime(np.zeros(std.size), lambda away: at(away).ravel(), STEP).reshape(value.size, -1)
    scale = np.where(std > 0.0, std, 1.0)
    correlation = fit.covariance.values / np.outer(scale, scale)
    variance = np.einsum("mi,ij,mj->m", slopes, correlation, slopes).reshape(value.shape)
    both = value, np.sqrt(np.maximum(variance, 0.0))
    return Derived(*(both if value.ndim else (float(part) for part in both)))
