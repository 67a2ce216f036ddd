"""Checks on what an effect says of itself: metadata, bounds, and that its values do not decide about compilation."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import equinox as eqx
import jax
import numpy as np

from ...errors import InputError
from ...physics.effects import catalogue
from ...physics.effects.base import Effect
from ...physics.params import Spec, check, specs, variants


def check_metadata(cls: type[Effect], full: bool) -> Iterator[str]:
    """What is missing for a person to understand the effect."""
    for name in ("summary", "equation", *(("signature", "source", "confused_with") if full else ())):
        if not getattr(cls, name):
            yield f"{name} is empty"
    told: dict[str, dict[str, str]] = {}
    for form in catalogue.forms(cls) if full else ():
        other = told.setdefault(cls(**form).formula(), form)
        if other is not form:
            yield f"the forms {other} and {form} have the same equation"
    for tag, experiment in cls.confused_with.items():
        if tag not in catalogue.all() or tag == cls.tag:
            yield f"confused with '{tag}', which is no other effect"
        if not experiment:
            yield f"no experiment separates it from '{tag}'"
    for name in set(cls.exponents) - specs(cls).keys():
        yield f"the exponent '{name}' is no parameter"
    for name, spec in specs(cls).items():
        if not spec.doc or (full and not spec.symbol):
            yield f"parameter {name} lacks {'a symbol' if spec.doc else 'words'}"
        if spec.log and spec.lower <= 0.0:
            yield f"parameter {name} is logarithmic and its lower bound is not positive"
        if any(not spec.lower <= value <= spec.upper for value in spec.grid):
            yield f"the grid of parameter {name} leaves its range"
        if full and name != cls.amplitude and spec.null is None and not spec.grid and not spec.log:
            yield f"inner parameter {name} has neither a grid nor a logarithmic range to start a search from"


def check_bounds(cls: type[Effect]) -> Iterator[str]:
    """Values beyond the bounds, and an unknown form, must be refused with a message that says what is allowed."""
    trials: list[tuple[str, float | str]] = [
        (name, value)
        for name, spec in specs(cls).items()
        for value in (_beyond(spec, -1), _beyond(spec, 1), float("nan"), float("inf"))
    ]
    trials += [(name, "no such form") for name in variants(cls)]
    for name, value in trials:
        try:
            check(cls(**{name: value}), where=cls.tag)
        except InputError as error:
            if name not in str(error) or "allowed" not in str(error):
                yield f"the message for {name} = {value} does not say where or what is allowed"
        except Exception as error:
            yield f"{name} = {value} raises {type(error).__name__} instead of a message"
        else:
            yield f"{name} = {value} is not refused"


def check_compilation(cls: type[Effect]) -> Iterator[str]:
    """Effects that differ in values alone must share one compilation, and values must be numbers of 64 bits."""
    traces = 0

    @eqx.filter_jit
    def leaves(effect: Effect) -> list:
        nonlocal traces
        traces += 1
        return jax.tree.leaves(eqx.filter(effect, eqx.is_array))

    for values in corners(cls):
        effect = cls(**values)
        if any(leaf.dtype != np.float64 or leaf.shape != () for leaf in leaves(effect)):
            yield "a parameter is not a 64-bit number"
            return
    if traces != 1:
        yield f"{traces} compilations for one structure"


def corners(cls: type[Effect] | Effect, most: int = 64) -> list[dict[str, float]]:
    """Every combination of lower and upper bounds, at most ``most`` of them (evenly picked), and the defaults first."""
    known = specs(cls)
    combinations = list(itertools.product(*((spec.lower, spec.upper) for spec in known.values())))
    picked = [combinations[i] for i in np.unique(np.linspace(0, len(combinations) - 1, most).astype(int))]
    return [{}, *(dict(zip(known, values, strict=True)) for values in picked)]


def _beyond(spec: Spec, side: int) -> float:
    reach = spec.upper - spec.lower
    return spec.upper + 0.01 * reach if side > 0 else spec.lower - 0.01 * reach
