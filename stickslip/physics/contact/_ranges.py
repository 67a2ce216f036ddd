"""Range checks that let traced values pass, so that checked functions can still be jitted and differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from ...errors import InputError
from ...system.units import to_si


def concrete(value: object) -> bool:
    """Whether the value is known now, that is not traced by jit, vmap or a derivative."""
    return not isinstance(value, jax.core.Tracer)


def in_metres(value: Any) -> Any:
    """A length in m from a number, text with a unit, or a list of either; what is traced passes as it is."""
    if isinstance(value, str):
        return to_si(value, "m")
    return np.array([in_metres(one) for one in value]) if isinstance(value, Sequence) else value


def check_within(
    what: str,
    value: object,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    to: float | None = None,
    key: str | None = None,
    unit: str = "",
    hint: str | None = None,
) -> None:
    """Raise unless every entry is finite and inside the range: ``above``/``below`` exclude their bound, the others not.

    Raises:
        InputError: names the first entry outside and the range.
    """
    if not concrete(value):
        return
    entries = np.ravel(np.asarray(value, dtype=float))
    good = np.isfinite(entries)
    for bound, ok in ((above, np.greater), (least, np.greater_equal), (below, np.less), (to, np.less_equal)):
        if bound is not None:
            good &= ok(entries, bound)
    if good.all():
        return
    limits = [("above ", above), ("at least ", least), ("below ", below), ("at most ", to)]
    allowed = ", ".join(f"{word}{bound:g}" for word, bound in limits if bound is not None)
    raise InputError(
        f"{what} is out of range",
        key=key,
        value=float(entries[~good][0]),
        allowed=f"{allowed} {unit}".strip() or "a finite number",
        hint=hint,
    )
