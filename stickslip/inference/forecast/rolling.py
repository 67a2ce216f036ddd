"""Forecasts along the later part of a run, none of which sees more than what was measured by then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import ArgumentError, InputError
from ...system.progress import Tell
from .known_record import Past
from .predict import METHODS, Compared, Forecaster, training_slips
from .scoring import gains, score
from .wander import Wander, fit

Array = NDArray[np.float64]
MOMENTS = 10  # in a mean recurrence, where forecasts are made all along
MOST = 4000  # moments
INNER = 0.6  # of the part for training, from which laws learn that are tried on its rest
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Rolled:
    """Forecasts at moments of the later part.

    Attributes:
        sample: of each moment, shape (n,).
        slip: number of the slip that came next.
        truth: s, time to its onset.
        members: of every method, a list of n ensembles (s).
    """

    sample: NDArray[np.intp]
    slip: NDArray[np.intp]
    truth: Array
    members: dict[str, list[Array]]

    def ahead(self, lead: float) -> Rolled:
        """Those made ``lead`` seconds or more before the onset.

        If the record is smoothed over less than ``lead``, nothing of the slip is in the samples that they use.
        """
        early = np.flatnonzero(self.truth >= lead)
        members = {name: [found[i] for i in early] for name, found in self.members.items()}
        return Rolled(self.sample[early], self.slip[early], self.truth[early], members)

    def score(self) -> dict[str, dict[str, float]]:
        """Of every method; see :func:`stickslip.inference.forecast.scoring.score`."""
        return {name: score(found, self.truth, self.slip) for name, found in self.members.items()}

    def gains(self) -> dict[str, dict[str, float]]:
        """By what share the CRPS lies below that of the plain methods."""
        others = {name: found for name, found in self.members.items() if name != METHODS[0]}
        return gains(self.members[METHODS[0]], others, self.truth, self.slip)


def choose(past: Past, laws: Sequence[Compared], progress: Tell | None = None) -> tuple[Wander, bool]:
    """Law and use of the rise of late that forecast best within the part for training.

    The best law by its criterion and scatter alone, each with the rise of late and without it, learn from the first
    part of the training and are scored on its rest. Where that holds too few slips the best law with the rise is taken.

    Args:
        past: the run. laws: compared, the best first. progress: told what is done.
    """
    if progress is not None:
        progress(f"choosing a law for {past.trace.name}", 0.0)
    scatter = next(c.law for c in laws if not c.law.components)
    tried = [laws[0].law, scatter] if laws[0].law.components else [scatter]
    found: list[tuple[float, int, bool]] = []
    try:
        inner = Past.of(past.train, INNER)
        for k, law in enumerate(tried):
            own = fit(inner.arrays, law.components, training_slips(inner))
            found += [(roll(inner, own, rise=r).score()[METHODS[0]]["crps"], k, r) for r in (True, False)]
    except InputError:
        return tried[0], True
    _, k, rise = min(found)
    return tried[k], rise


def moments(past: Past, recurrence: float, at: float | None) -> NDArray[np.intp]:
    """Samples of the later part at which forecasts are made.

    Which they are depends on nothing later than they: a share of a stick's own length would tell how long it is.

    Args:
        past: the run.
        recurrence: s, mean of the part for training.
        at: mean recurrences after the last arrest is certain, once in each stick; None for moments all along, even in
            time.
    """
    time = past.trace.time
    if at is None:
        step = max(recurrence / MOMENTS, (time[-1] - past.split) / MOST)
        wanted = np.arange(past.split, time[-1], step)
    else:
        wanted = past.known[past.known >= past.split] + at * recurrence
    found = np.searchsorted(time, wanted)
    return np.unique(found[found < time.size])


def roll(past: Past, law: Wander, at: float | None = None, progress: Tell | None = None, rise: bool = True) -> Rolled:
    """Forecasts at moments of the later part, and what came.

    A moment within a slip, or in a stick whose slip the record does not hold, is left out.

    Raises:
        ArgumentError: no moment is left.
    """
    forecaster = Forecaster(past, law, rise)
    onsets, time = past.arrays["time_onset"], past.trace.time
    wanted = moments(past, forecaster.recurrence, at)
    kept: list[tuple[int, int, float]] = []
    members: dict[str, list[Array]] = {name: [] for name in METHODS}
    last = -1
    for n, i in enumerate(wanted.tolist()):
        t = float(time[i])
        following = int(np.searchsorted(onsets, t))
        if following >= onsets.size:
            break
        if at is not None and following == last:
            continue  # a stick is counted once
        if int(np.sum(past.known <= t)) != following:
            continue  # a slip has begun, seen or not
        found = forecaster.at(i)
        if found is None:
            continue
        last = following
        kept.append((i, following, float(onsets[following]) - t))
        for name, values in found.items():
            members[name].append(values)
        if progress is not None:
            progress(f"forecasts of {past.trace.name}", n / wanted.size)
    if not kept:
        raise ArgumentError(
            f"trace '{past.trace.name}': no slip after the part for training is left to be forecast",
            key="train" if at is None else "at", value=at,
            hint="a smaller share for training" if at is None else "an earlier moment, or a smaller share for training",
        )  # fmt: skip
    samples, slips, truth = zip(*kept, strict=True)
    return Rolled(np.array(samples), np.array(slips), np.array(truth), members)
