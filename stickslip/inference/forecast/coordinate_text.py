"""What levels vary with, in words and numbers: time, slip path or place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .predict import Compared
from .scoring import standard_error
from .wander import KEYS

SURE = 0.95  # weight by which one coordinate is named

SAME = (
    "Place and slip path are one coordinate in a record that never goes back: motion back over the same track "
    "separates them."
)


def steps(arrays: Mapping[str, Any]) -> dict[str, float]:
    """Median distance from one onset to the next along every coordinate (s, m, m), of levels as plain arrays."""
    return {c: float(np.median(np.abs(np.diff(arrays[f"{key}_onset"])))) for c, key in KEYS.items()}


def told(compared: Sequence[Compared], back: bool, step: Mapping[str, float], each: str = "slip") -> dict[str, Any]:
    """What the levels follow.

    Laws are weighed by Akaike's weights (Burnham & Anderson 2002). A coordinate is named if laws that have it hold 95 %
    of the weight, the best law predicts the later slips no worse than the best law without it, and its correlation
    length is longer than the distance from one slip to the next: what ends within a slip carries over to none.

    Args:
        compared: laws with the best first.
        step: distance from one slip to the next along every coordinate, see :func:`steps`.
        back: whether the block goes back over the same track.
        each: what has a level.

    Returns:
        ``coordinate`` (names joined by " and ", "nothing" for scatter alone, or "" where it cannot be told),
        ``weights`` of every coordinate and of "nothing", ``unseen`` (for every coordinate, nats a slip by which the
        best law predicts the later slips better than the best law without it) with standard errors ``unseen_std``, and
        ``text``.
    """
    aic = np.array([c.law.aic for c in compared])
    share = np.exp(-0.5 * (aic - aic.min()))
    share /= share.sum()
    names = sorted({c for found in compared for c in found.law.coordinates})
    weights = {c: float(sum(w for f, w in zip(compared, share, strict=True) if c in f.law.coordinates)) for c in names}
    nothing = float(sum(w for f, w in zip(compared, share, strict=True) if not f.law.components))
    gains, errors, reach = {}, {}, {}
    for c in names:
        without = next((f for f in compared if c not in f.law.coordinates and f.law.components), compared[0])
        with_it = next(f for f in compared if c in f.law.coordinates)
        difference = with_it.unseen - without.unseen
        gains[c] = float(difference.mean()) if difference.size else float("nan")
        errors[c] = standard_error(difference) if difference.size > 1 else float("nan")
        reach[c] = max(part.length for part in with_it.law.components if part.coordinate == c)
    likely = [c for c in names if weights[c] >= SURE and not gains[c] < 0.0]
    named = [c for c in likely if reach[c] > step[c]]
    numbers = "; ".join(
        f"{c}: weight {weights[c]:.2f}, the later {each}s predicted {abs(gains[c]):.3f} (+-{errors[c]:.3f}) nats a "
        f"{each} {'better' if gains[c] >= 0 else 'worse'} than without it"
        for c in sorted(names, key=lambda c: -weights[c])
    )
    if nothing >= SURE:
        coordinate, text = "nothing", f"The levels scatter, no correlation detected ({numbers})."
    elif named:
        coordinate, text = " and ".join(named), f"The levels wander along {' and '.join(named)} ({numbers})."
    elif likely:
        coordinate = ""
        text = (
            f"Levels within a {each} differ along {' and '.join(likely)}, but their correlation ends before the next "
            f"{each}: no correlation from {each} to {each} is detected ({numbers})."
        )
    elif nothing > 1.0 - SURE:
        coordinate, text = "", f"Whether the levels wander or only scatter cannot be determined ({numbers})."
    else:
        coordinate, text = "", f"The levels wander, but along which coordinate cannot be determined ({numbers})."
    if nothing < SURE and not back:
        text += f" {SAME}"
    return {
        "coordinate": coordinate,
        "weights": {**weights, "nothing": nothing},
        "unseen": gains,
        "unseen_std": errors,
        "text": text,
    }
