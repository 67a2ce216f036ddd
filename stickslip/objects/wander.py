"""What the level of friction follows from slip to slip, or from stroke to stroke: time, slip path or place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..data.prescribed import prescribed, with_motion
from ..errors import InputError
from ..inference.forecast.coordinate_text import steps, told
from ..inference.forecast.levels import levels
from ..inference.forecast.predict import compare, goes_back
from ..inference.forecast.strokes import Strokes
from ..system.units import shown

if TYPE_CHECKING:
    from .campaign import Campaign

MANY = 30  # slips, or strokes, from which on it is said what their level follows
LEARNED = 0.7  # of them, from which that is learned
MOSTLY = 0.5  # of a level's variance in strokes, from which on it follows the place


def most_slips(campaign: Campaign) -> int:
    """Number of the run with the most slips."""
    return int(np.argmax([len(s.events) for s in campaign.events]))


def wander(campaign: Campaign) -> dict[str, Any] | None:
    """What the level of friction follows from slip to slip, or from stroke to stroke, in the run with the most of them.

    Laws are compared as for a forecast, with the last part of the slips left for prediction. Where the motion is
    prescribed, levels are those of strokes that slide over the same places both ways
    (:class:`stickslip.inference.forecast.strokes.Strokes`).

    Returns:
        ``run``, ``slips`` or ``strokes``, ``coordinate``, ``weights`` and ``text`` (see
        :func:`stickslip.inference.forecast.coordinate_text.told`), the best law with ``size`` (share of the mean
        level) and ``length``; of strokes also ``track`` (m), ``variation`` (share of the level), and ``shares`` of its
        variance.
        None where fewer than :data:`MANY` slips or strokes, or no level, can be had.
    """
    number = most_slips(campaign)
    trace, found = campaign.traces[number], campaign.scaled[0][number]
    if prescribed(trace, found):
        return _of_strokes(campaign)
    if len(found.events) < MANY:
        return None
    try:
        data = levels(trace, found)
    except InputError:
        return None
    arrays = {str(name): np.asarray(data[name].values, float) for name in data.data_vars}
    count = {"run": trace.name, "slips": len(found.events)}
    return count | _followed(arrays, abs(float(arrays["onset"].mean())))


def _of_strokes(campaign: Campaign) -> dict[str, Any] | None:
    """The same of a run whose motion is prescribed."""
    given = [with_motion(t) for t, s in zip(campaign.displaced[0], campaign.events, strict=True) if prescribed(t, s)]
    every = [(t.name, found) for t in given if (found := Strokes.of(t)) is not None]
    name, found = max(every, key=lambda one: one[1].time.size, default=("", None))
    if found is None or found.time.size < MANY:
        return None
    mean, shares = float(found.level.mean()), found.shares
    followed = _followed(found.arrays, mean, "stroke")
    if (by_place := shares["by the place"]) > MOSTLY:
        text = f"The level follows the place: {100 * by_place:.0f} % of its variance are the same in every stroke."
        followed |= {"coordinate": "place", "text": f"{text} From stroke to stroke: {followed['text']}"}
    return {
        "run": name, "strokes": int(found.time.size), "track": float(np.ptp(found.place)),
        "variation": float(found.level.std()) / mean, "shares": shares, **followed,
    }  # fmt: skip


def _followed(arrays: dict[str, np.ndarray], mean: float, each: str = "slip") -> dict[str, Any]:
    """What levels follow, with the best law as a share of their mean."""
    laws = compare(arrays, int(LEARNED * arrays["onset"].size))
    best = laws[0].law
    return {
        **told(laws, goes_back(arrays["direction"]) or each == "stroke", steps(arrays), each),
        "law": [
            {"kernel": c.kernel, "coordinate": c.coordinate, "size": abs(c.size[0]) / mean, "length": c.length,
             "unit": "s" if c.coordinate == "time" else "m"}
            for c in best.components
        ],
        "scatter": best.scatter[0] / mean,
    }  # fmt: skip


def wander_sentence(found: dict[str, Any]) -> str:
    """The same in a sentence."""
    parts = [
        f"{100 * c['size']:.2g} % along the {c['coordinate']} with a length of {shown(c['length'], c['unit'], 2)}"
        for c in found["law"]
    ]
    each = "slip" if "slips" in found else "stroke"
    parts.append(f"a scatter of {100 * found['scatter']:.2g} % from {each} to {each}")
    of = f"{found[f'{each}s']} {each}s"
    if "shares" in found:
        shares = ", ".join(f"{100 * share:.0f} % {name}" for name, share in found["shares"].items())
        of += (
            f" over {shown(found['track'], 'm', 2)} of track that are slid both ways (variance of the level: {shares})"
        )
    return f"{found['run']}, {of}: {found['text']} Best law: {' and '.join(parts)}."
