"""What a recorder does to the counts: a counter that starts again, one that is cleared, samples that are lost."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.errors import InputError

Array = np.ndarray
RECORDERS = ("plain", "wrap", "cleared", "drop-outs")
RANGE = 4096  # counts: 12 bits, 32.4 um
LONGEST_LOSS = 6  # samples


@dataclass(frozen=True)
class Recorded:
    """Counts as they are written, shape (n,), NaN where lost; ``keys`` for the file, ``truth`` of what was done."""

    counts: Array
    keys: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)


def record(
    kind: str, read: Array, sticks: list[tuple[float, float]], rate: float, rng: np.random.Generator
) -> Recorded:
    """Put ``kind`` into the counts ``read`` of one run.

    Args:
        kind: one of ``RECORDERS``. A cleared counter is cleared by the user while the block sticks: after the first
            slip, and then after every other one at random. Samples are lost in two to six places of a run, of which
            half are as likely as the block moves fast there, the others anywhere.
        read: counts of one run, shape (n,).
        rate: samples per second.
        rng: draws when and where.
        sticks: (arrest, next onset) of the record, s; a slip that the record does not see both ends of has none.

    Raises:
        InputError: there is no such recorder; no stick phase to clear the counter in.
    """
    if kind == "plain":
        return Recorded(read)
    if kind == "wrap":
        return _wrapped(read)
    if kind == "cleared":
        return _cleared(read, sticks, rate, rng)
    if kind == "drop-outs":
        return _with_losses(read, rng)
    raise InputError("there is no such recorder", key="recorder", value=kind, allowed=", ".join(RECORDERS))


def _wrapped(read: Array) -> Recorded:
    turns, within = np.divmod(read + RANGE // 2, RANGE)
    return Recorded(within - RANGE // 2, {"wrap": RANGE}, {"wraps": int(np.abs(np.diff(turns)).sum())})


def _cleared(read: Array, sticks: list[tuple[float, float]], rate: float, rng: np.random.Generator) -> Recorded:
    if not sticks:
        raise InputError("the counter is cleared between slips, and there are none", key="recorder")
    told = bool(rng.random() < 0.5)  # whether the user noted when
    chosen = [0, *(np.flatnonzero(rng.random(len(sticks) - 1) < 0.5) + 1)]
    counts, places = read.copy(), []
    for i in chosen:
        arrest, onset = sticks[i]
        place = round((arrest + rng.uniform(0.3, 0.7) * (onset - arrest)) * rate)
        if 0 < place < read.size:
            counts[place:] = read[place:] - read[place - 1]
            places.append(place)
    moments = [place / rate for place in places]
    return Recorded(counts, {"resets": moments if told else True}, {"cleared": moments})


def _with_losses(read: Array, rng: np.random.Generator) -> Recorded:
    counts = read.astype(float)
    travel = np.abs(np.diff(read, prepend=read[0])).astype(float)
    lost = []
    for number in range(int(rng.integers(2, 7))):
        fast = number % 2 == 0 and travel.any()
        place = int(rng.choice(read.size, p=travel / travel.sum()) if fast else rng.integers(read.size))
        place = min(max(place, 1), read.size - LONGEST_LOSS - 1)
        length = int(rng.integers(1, LONGEST_LOSS + 1))
        counts[place : place + length] = np.nan
        lost.append([place, length])
    return Recorded(counts, {}, {"lost": int(np.isnan(counts).sum()), "losses": lost})
