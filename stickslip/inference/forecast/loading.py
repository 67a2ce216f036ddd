"""How much level is missing while the load point has some way to go to the slip, stick by stick, creep included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .known_record import Past

Array = NDArray[np.float64]
POINTS = 400  # of travel at which curves are kept
MOST = 60  # sticks whose curves are kept, even over the part for training
TURNED = 5  # of them in which the drive turns, at least, where there are as many
SAMPLES = 100  # of a stick, and
PARTS = 30  # of the travel of sticks without a turn, by which the spread of its rises is told
REACH = 1.5  # travel that is looked ahead, in the longest stick's
LAG = 0.1  # travel over which the rise of the level is taken, in that of a mean recurrence
FEWEST = 3  # sticks


@dataclass(frozen=True)
class Curves:
    """Sticks of the part for training, seen backwards from their onsets.

    What a stick creeps on its way to the onset, and by how much sticks differ in it, is in these curves: for a spring
    without creep they are one straight line. Whether a longer stick creeps longer or only has more of the straight line
    before its creep is estimated (``growth``).

    Attributes:
        travel: of the load point still to come, from zero upwards and even, shape (k,); m or s of loading.
        missing: level at the onset less that at the travel, of every stick, shape (sticks, k).
        length: travel of the whole stick, shape (sticks,).
        growth: 1: curves grow with the length of the stick, 0: they do not.
        lag: travel over which a rise is taken.
        spread: standard deviation of that rise from stick to stick at each travel, shape (k,).
    """

    travel: Array
    missing: Array
    length: Array
    growth: float
    lag: float
    spread: Array

    def ahead(self, turned: bool) -> int:
        """How many points of the travel are looked ahead in a stick: only one in which the drive has turned is long."""
        return self.travel.size if turned else POINTS

    @classmethod
    def of(cls, past: Past, slips: NDArray[np.intp]) -> Curves:
        """From sticks of the first part.

        Args:
            past: the run.
            slips: numbers of those that end them, from 1 on.

        Raises:
            InputError: too few sticks hold three samples.
        """
        arrays, time, way = past.arrays, past.trace.time, past.way_gone
        onset_way, arrest_way = (np.interp(arrays[f"time_{end}"], time, way) for end in ("onset", "arrest"))
        lag = LAG * float(np.mean(onset_way[slips] - onset_way[slips - 1]))
        limits = np.searchsorted(time, np.stack([past.known[slips - 1], arrays["time_onset"][slips]]))
        turns = np.array([after_turn(past.way, int(a), int(b)) for a, b in limits.T])
        turned = turns > limits[0]
        chosen = slips[np.unique(np.linspace(0, slips.size - 1, min(MOST, slips.size)).astype(int))]
        chosen = np.union1d(chosen, slips[turned][:TURNED])
        travel = _grid(onset_way[slips] - arrest_way[slips - 1], turned, np.isin(slips, chosen))
        missing, length, seen = [], [], []
        for j in chosen:
            (own,) = np.flatnonzero(slips == j)
            low, high = int(turns[own]), int(limits[1, own])
            if high - low < 3:
                continue
            wanted = onset_way[j] - travel
            level = np.interp(wanted, way[low : high + 1], past.level[low : high + 1])
            missing.append(np.where(wanted >= way[low], arrays["onset"][j] - level, np.nan))
            length.append(onset_way[j] - (way[low] if turned[own] else arrest_way[j - 1]))
            at = np.unique(np.linspace(low, high - 1, min(high - low, SAMPLES)).astype(int))
            at = at[way[at] - lag >= way[low]]
            earlier = np.interp(way[at] - lag, way[low : high + 1], past.level[low : high + 1])
            seen.append((onset_way[j] - way[at], past.level[at] - earlier))
        if len(missing) < FEWEST:
            raise InputError(
                f"trace '{past.trace.name}' is sampled too coarsely: {len(missing)} sticks hold three samples",
                allowed=f"{FEWEST} or more", hint="a record with a higher sampling rate",
            )  # fmt: skip
        table, lengths = np.array(missing), np.array(length)
        full = _extended(table.copy())
        growth = _growth(travel, table, full, lengths)
        first = cls(travel, full, lengths, growth, lag, np.zeros(travel.size))
        return cls(travel, full, lengths, growth, lag, first._spread(seen))

    def missing_at(self, gone: float, more: float = 0.0) -> Array:
        """Missing level of every curve where the load point has gone so far since the arrest, shape (sticks, k).

        Args:
            gone: travel since the arrest.
            more: added to the travel still to come, of the same sticks.
        """
        asked = self.travel + more
        whole = np.maximum(gone + self.travel, 1e-9 * self.travel[-1])  # of the stick that would end there
        out = np.empty_like(self.missing)
        for j, (row, length) in enumerate(zip(self.missing, self.length, strict=True)):
            unscaled = np.interp(asked, self.travel, row) if more else row
            scaled = whole / length * np.interp(asked / whole * length, self.travel, row)
            out[j] = unscaled + self.growth * (scaled - unscaled)
        return out

    def seen(self, risen: float, gone: float, missing: Array) -> Array:
        """Likelihood of a rise over the last ``lag`` at each travel, shape (k,): Student's, for sticks are few."""
        from scipy.stats import t as student  # half a second, which no other command needs

        mean = np.mean(self.missing_at(gone, self.lag) - missing, axis=0)
        coarse = np.gradient(mean) ** 2 / 12.0  # within one step of travel
        n = self.length.size
        wide = np.sqrt(self.spread**2 * (1.0 + 1.0 / n) + coarse + 1e-300)
        return np.asarray(student.pdf((risen - mean) / wide, n - 1) / wide)

    def _spread(self, seen: list[tuple[Array, Array]]) -> Array:
        """Standard deviation of rises about what the curves together say of them, by travel still to come.

        Args:
            seen: travel to come and rise at samples of every stick.
        """
        rest = []
        for (to_come, risen), length in zip(seen, self.length, strict=True):
            each = [self._of_length(i, length, self.lag) - self._of_length(i, length) for i in range(self.length.size)]
            rest.append(risen - np.interp(to_come, self.travel, np.mean(each, axis=0)))
        every, at = np.concatenate(rest), np.concatenate([s[0] for s in seen])
        parts = round(PARTS * (self.travel.size - 1) / (POINTS - 1))
        part = np.minimum((at / self.travel[-1] * parts).astype(int), parts - 1)
        if every.size < FEWEST:
            return np.full(self.travel.size, np.inf)
        whose = np.repeat(np.arange(len(rest)), [r.size for r in rest])
        count = np.bincount(part, minlength=parts)
        sticks = np.bincount(np.unique(part * len(rest) + whose) // len(rest), minlength=parts)
        known = np.flatnonzero(count)
        own = np.bincount(part, every**2, minlength=parts)[known] / count[known]
        # what few sticks tell leans on what all of them do
        square = (sticks[known] * own + FEWEST * float(np.mean(every**2))) / (sticks[known] + FEWEST)
        middle = (known + 0.5) / parts * self.travel[-1]
        n = self.length.size
        return np.sqrt(np.interp(self.travel, middle, square) * n / (n - 1))

    def _of_length(self, i: int, whole: float, more: float = 0.0) -> Array:
        """Curve of stick ``i`` for a stick of a given length."""
        asked, length = self.travel + more, self.length[i]
        unscaled = np.interp(asked, self.travel, self.missing[i])
        scaled = whole / length * np.interp(asked / whole * length, self.travel, self.missing[i])
        return unscaled + self.growth * (scaled - unscaled)


def _grid(length: Array, turned: NDArray[np.bool_], chosen: NDArray[np.bool_]) -> Array:
    """Travel at which curves are kept: as fine as sticks without a turn need it, as far as any is looked ahead."""
    usual, longest = chosen & ~turned, float(np.max(length[chosen]))
    step = REACH * (float(np.max(length[usual])) if usual.any() else longest) / (POINTS - 1)
    points = max(int(np.ceil(REACH * longest / step - 1e-9)) + 1, POINTS)
    return np.linspace(0.0, step * (points - 1), points)


def after_turn(way: Array | float, low: int, high: int) -> int:
    """First sample of a stick from which the drive does not turn any more: what is loaded before is unloaded again."""
    if not isinstance(way, np.ndarray):
        return low
    other = np.flatnonzero(way[low : high + 1] != way[high])
    return low + int(other[-1]) + 1 if other.size else low


def _growth(travel: Array, table: Array, full: Array, length: Array) -> float:
    """By how far curves grow with the length of their stick: least squares over pairs of sticks, from 0 to 1."""
    chosen = np.unique(np.linspace(0, length.size - 1, min(20, length.size)).astype(int))
    above = below = 0.0
    for i in chosen:
        for j in chosen:
            grown = length[j] / length[i] * np.interp(travel * length[i] / length[j], travel, full[i])
            own = ~np.isnan(table[j])
            turn = (grown - full[i])[own]
            above += float(turn @ (table[j] - full[i])[own])
            below += float(turn @ turn)
    return float(np.clip(above / below, 0.0, 1.0)) if below > 0 else 0.0


def _extended(table: Array) -> Array:
    """Curves of short sticks go on as the others' medians do, and at last straight."""
    for k in range(1, table.shape[1]):
        lacking = np.isnan(table[:, k])
        if not lacking.any():
            continue
        both = ~np.isnan(table[:, k]) & ~np.isnan(table[:, k - 1])
        if both.any():
            rise = float(np.median(table[both, k] - table[both, k - 1]))
        else:
            rise = float(np.median(table[:, k - 1] - table[:, k // 2])) / max(k - 1 - k // 2, 1)
        table[lacking, k] = table[lacking, k - 1] + rise
    return table
