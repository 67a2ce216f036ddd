"""How large a hidden effect is, in multiples of the amplitude from which it can be seen at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .generator.forms import Effect

LARGEST = 30.0  # multiples of detection
# the median of (low end of the plausible range) / (noise-only limit) of the effects that have both
USUAL = 5.0


def detection(effect: Effect) -> float:
    """The amplitude from which an effect can be seen, in its unit.

    It is the generator's noise-only limit (five standard deviations of noise alone, the same contact at every event).
    Where there is none, or thirty times it lies below the plausible range, it is a fifth of that range's low end, as
    is usual among the others. It says nothing of the scatter of the contact, which as a rule hides far more.
    """
    if effect.detect is None or LARGEST * effect.detect <= effect.low:
        return effect.low / USUAL
    return effect.detect


def largest_multiple(effect: Effect) -> float:
    """The largest multiple to be drawn: 30, or less where the block would no longer stick and slip."""
    return min(LARGEST, effect.high / detection(effect))


def draw_multiple(effect: Effect, rng: np.random.Generator) -> float:
    """A multiple of detection, log-uniform from 1 to the largest."""
    return float(np.exp(rng.uniform(0.0, np.log(largest_multiple(effect)))))


def amplitude(effect: Effect, multiple: float, sign: float) -> float:
    """Amplitude of an effect at a multiple of detection; ``sign`` counts where either sign makes sense."""
    return multiple * detection(effect) * (sign if effect.signed else effect.sign)
