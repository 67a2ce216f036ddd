"""The hidden effects: each with one or more functional forms of its own, an amplitude and its plausible range."""

from __future__ import annotations

from typing import Any

import numpy as np

from stickslip.errors import InputError, nearest

from . import contact, friction, machine, outside, readout
from .base import Effect, Form, Setup

EFFECTS: dict[str, Effect] = {
    effect.tag: effect
    for effect in (*friction.EFFECTS, *contact.EFFECTS, *machine.EFFECTS, *readout.EFFECTS, *outside.EFFECTS)
}
CATALOGUED = tuple(tag for tag, effect in EFFECTS.items() if effect.inside)
OUTSIDE = tuple(tag for tag, effect in EFFECTS.items() if not effect.inside)

__all__ = ["CATALOGUED", "EFFECTS", "OUTSIDE", "Effect", "Form", "Setup", "find", "hide"]


def find(tag: str) -> Effect:
    """The effect called ``tag``; InputError with the nearest name where there is none."""
    if tag not in EFFECTS:
        raise InputError(f"there is no effect '{tag}'", key="effect", hint=nearest(tag, EFFECTS))
    return EFFECTS[tag]


def hide(
    setup: Setup, tag: str, amplitude: float | None, rng: np.random.Generator, form: str | None = None
) -> dict[str, Any]:
    """Put an effect into ``setup`` (in place).

    Args:
        setup: the apparatus, changed.
        tag: of the effect.
        rng: draws amplitude and form where they are not given, and inner parameters.
        amplitude: in the effect's SI unit; None draws one, log-uniform over the plausible range.
        form: name of one of its forms; None draws one.

    Returns:
        The truth: tag, amplitude, unit, form, whether the form is an own one, inner parameters, multiple of detection.
    """
    effect = find(tag)
    size = effect.draw(rng) if amplitude is None else float(amplitude)
    chosen = effect.pick(form, rng)
    inner = chosen.apply(setup, size, rng)
    return {
        "tag": tag,
        "amplitude": size,
        "unit": effect.unit,
        "form": chosen.name,
        "own_form": chosen.own,
        "inside": effect.inside,
        "decoy": effect.decoy,
        "inner": inner,
        "detections": None if effect.detect is None else abs(size) / effect.detect,
    }
