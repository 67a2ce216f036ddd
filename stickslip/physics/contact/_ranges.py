"""Quantities as a person writes them, and their ranges; traced values pass, to be jitted and differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ...errors import InputError
from ...system.units import to_si


def concrete(value: object) -> bool:
    """Whether the value is known now, that is not traced by jit, vmap or a derivative."""
    return not isinstance(value, jax.core.Tracer)


def in_si(value: Any, unit: str, *, key: str | None = None) -> Any:
    """A quantity in SI from a number, text with a unit, or a list of either; what is traced passes as it is."""
    if isinstance(value, str):
        return to_si(value, unit, key=key)
    return jnp.asarray([in_si(one, unit, key=key) for one in value]) if isinstance(value, Sequence) else value


def check_within(
    what: str,
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    to: float | None = None,
    key: str | None = None,
    unit: str = "",
    hint: str | None = None,
) -> Any:
    """The quantity in SI (see `in_si`), every entry finite and inside the range.

    ``above`` and ``below`` exclude their bound, the others not. What is traced is not checked.

    Raises:
        InputError: names the first entry outside and the range, or says why a text cannot be read.
    """
    value = in_si(value, unit or "1", key=key)
    if not concrete(value):
        return value
    entries = np.ravel(np.asarray(value, dtype=float))
    good = np.isfinite(entries)
    for bound, ok in ((above, np.greater), (least, np.greater_equal), (below, np.less), (to, np.less_equal)):
        if bound is not None:
            good &= ok(entries, bound)
    if good.all():
        return value
    limits = [("above ", above), ("at least ", least), ("below ", below), ("at most ", to)]
    allowed = ", ".join(f"{word}{bound:g}" for word, bound in limits if bound is not None)
    raise InputError(
        f"{what} is out of range",
        key=key,
        value=float(entries[~good][0]),
        allowed=f"{allowed} {unit}".strip() or "a finite number",
        hint=hint,
    )
