"""How much level is missing while the load point still has some way to go to the slip, stick by stick: creep included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from .past import Past

Array = NDArray[np.float64]
POINTS = 400  # of travel at which curves are kept
MOST = 60  # sticks whose curves are kept, even over the part for training
REACH = 1.5  # travel that is looked ahead, in the longest stick's
LAG = 0.1  # travel over which the rise of the level is taken, in that of a mean recurrence
FEWEST = 3  # sticks from which a spread is taken


@dataclass(frozen=True)
class Curves:
    """Sticks of the part for training, seen backwards from their onsets.

    What a stick creeps on its way to the onset, and by how much sticks differ in it, is in these curves: for a spring
    without creep they are one straight line.

    Attributes:
        travel: of the load point still to come, from zero upwards and even, shape (k,); m or s of loading.
        missing: level at the onset less that at the travel, of every stick, shape (sticks, k).
        lag: travel over which a rise is taken.
        rise: mean rise of the level over the last ``lag``, and its standard deviation from stick to stick, shape (k,).
        sticks: number of those.
    """

    travel: Array
    missing: Array
    lag: float
    rise: tuple[Array, Array]
    sticks: int

    @classmethod
    def of(cls, past: Past, slips: NDArray[np.intp]) -> Curves:
        """From sticks of the first part.

        Args:
            past: the run.
            slips: numbers of those that end them, from 1 on.
        """
        arrays, time = past.arrays, past.trace.time
        way = np.maximum.accumulate(past.travel)  # that of a measured load point trembles
        onset_way = np.interp(arrays["time_onset"], time, way)
        lag = LAG * float(np.mean(np.diff(onset_way[np.concatenate([[slips[0] - 1], slips])])))
        chosen = slips[np.unique(np.linspace(0, slips.size - 1, min(MOST, slips.size)).astype(int))]
        longest = float(np.max(onset_way[chosen] - onset_way[chosen - 1]))
        travel = np.linspace(0.0, REACH * longest, POINTS)
        missing, rises = [], []
        for j in chosen:
            low, high = np.searchsorted(time, [past.known[j - 1], arrays["time_onset"][j]])
            if high - low < 3:
                continue
            wanted = onset_way[j] - travel
            inside = wanted >= way[low]
            level = np.interp(wanted, way[low : high + 1], past.level[low : high + 1])
            earlier = np.interp(wanted - lag, way[low : high + 1], past.level[low : high + 1])
            missing.append(np.where(inside, arrays["onset"][j] - level, np.nan))
            rises.append(np.where(wanted - lag >= way[low], level - earlier, np.nan))
        table, risen = np.array(missing), np.array(rises)
        return cls(travel, _extended(table), lag, _spread(risen), len(missing))

    def seen(self, risen: float) -> Array:
        """Likelihood of a rise over the last ``lag`` at each travel, shape (k,): Student's, for sticks are few."""
        mean, std = self.rise
        wide = std * np.sqrt(1.0 + 1.0 / self.sticks)
        return np.asarray(student.pdf((risen - mean) / wide, self.sticks - 1) / wide)


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
            rise = float(np.median(table[:, k - 1] - table[:, k // 2])) / (k - 1 - k // 2)
        table[lacking, k] = table[lacking, k - 1] + rise
    return table


def _spread(risen: Array) -> tuple[Array, Array]:
    """Mean and standard deviation over the sticks that reach so far; beyond, those of the farthest."""
    enough = np.sum(~np.isnan(risen), axis=0) >= FEWEST
    last = int(np.flatnonzero(enough)[-1]) if enough.any() else -1
    if last < 0:
        return np.zeros(risen.shape[1]), np.full(risen.shape[1], np.inf)
    known = risen[:, : last + 1]
    mean, std = np.nanmean(known, axis=0), np.nanstd(known, axis=0, ddof=1)
    rest = risen.shape[1] - last - 1
    return np.pad(mean, (0, rest), "edge"), np.pad(std, (0, rest), "edge")
