"""The next slip: the level at which it comes, given that it has not come yet, and the time until the load is there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...errors import ArgumentError
from .known_record import Past
from .loading import Curves, after_turn
from .wander import ARREST, FEWEST, KEYS, ONSET, Component, Coordinate, Filter, Nearby, Wander, fit

Array = NDArray[np.float64]
FIRST = 6  # slip from which predictions are judged: the means are known by then
MEMBERS = 100  # equally likely times that stand for a distribution of them
METHODS = ("wandering strength", "mean recurrence", "constant strength", "slip-predictable")


@dataclass(frozen=True)
class Compared:
    """A law that was fitted, and how well it predicts.

    Attributes:
        law: fitted to the slips for training.
        unseen: logarithm of the density of each later slip's level at onset, given the slips before it, shape (m,).
    """

    law: Wander
    unseen: Array = field(default_factory=lambda: np.zeros(0))


def goes_back(direction: Array) -> bool:
    """Whether the block slips in both directions, so that place and slip path are two things."""
    return bool((direction > 0).any() and (direction < 0).any())


def candidates(direction: Array) -> list[tuple[Component, ...]]:
    """Laws that are compared: scatter alone, either kernel along every coordinate, a smooth wander with a rough one.

    Place counts where the block goes back; else it is the slip path.
    """
    along: tuple[Coordinate, ...] = ("time", "slip path")
    out: list[tuple[Component, ...]] = [()]
    for c in (*along, "place") if goes_back(direction) else along:
        out += [(Component("ornstein-uhlenbeck", c),), (Component("matern-3/2", c),)]
    out += [(Component("matern-3/2", a), Component("ornstein-uhlenbeck", b)) for a in along for b in along]
    return out


def predictor(law: Wander) -> Filter | Nearby:
    """What takes up levels in the order of time."""
    return Nearby(law) if "place" in law.coordinates else Filter(law)


def coordinates(arrays: Mapping[str, Array], slip: int, end: str) -> dict[Coordinate, float]:
    """Time, slip path and place of a slip's ``"onset"`` or ``"arrest"``."""
    return {c: float(arrays[f"{key}_{end}"][slip]) for c, key in KEYS.items()}


def take(own: Filter | Nearby, arrays: Mapping[str, Array], slip: int) -> None:
    """Take up both levels of a slip."""
    own.add(coordinates(arrays, slip, "onset"), ONSET, float(arrays["onset"][slip]))
    own.add(coordinates(arrays, slip, "arrest"), ARREST, float(arrays["arrest"][slip]))


def compare(arrays: Mapping[str, Array], training: int) -> list[Compared]:
    """Every candidate, the best by its criterion first; arguments and errors as of :func:`compared`."""
    return best_first(compared(arrays, c, training) for c in candidates(arrays["direction"][:training]))


def compared(arrays: Mapping[str, Array], components: tuple[Component, ...], training: int) -> Compared:
    """A law fitted to the first slips.

    Args:
        arrays: levels of all slips.
        components: of the law.
        training: how many slips it is fitted to; the rest is predicted slip by slip.

    Raises:
        InputError: too few slips for training.
    """
    law = fit(arrays, components, training)
    return Compared(law, _unseen(arrays, law, training))


def best_first(found: Iterable[Compared]) -> list[Compared]:
    """In the order of their criterion."""
    return sorted(found, key=lambda c: c.law.aic)


@dataclass(frozen=True)
class Ahead:
    """Where the next onset is expected after an arrest: creep moves the block on.

    Attributes:
        path, place: mean creep of the sticks for training, along the way and in the direction of the slip before (m).
    """

    path: float
    place: float

    @classmethod
    def of(cls, arrays: Mapping[str, Array], training: int) -> Ahead:
        """Of the first sticks; those in which the block turns do not count for the place."""
        crept = arrays["path_onset"][1:training] - arrays["path_arrest"][: training - 1]
        sign = arrays["direction"][:training]
        moved = (arrays["place_onset"][1:training] - arrays["place_arrest"][: training - 1]) * sign[:-1]
        kept = moved[sign[1:] == sign[:-1]]
        return cls(float(np.mean(crept)), float(np.mean(kept)) if kept.size else 0.0)

    def __call__(self, arrays: Mapping[str, Array], before: int) -> dict[Coordinate, float]:
        """Slip path and place of the onset after a slip, and the time of its arrest."""
        at = coordinates(arrays, before, "arrest")
        at["slip path"] += self.path
        at["place"] += self.place * float(arrays["direction"][before])
        return at


def spread(arrays: Mapping[str, Array], law: Wander, training: int) -> tuple[float, float] | None:
    """How the level at an onset spreads about its prediction, in its standard deviations.

    A law has one scatter for all levels; where some scatter more than others, as arrests after long slips do, their
    mixture has long tails. Student's t about zero is fitted to the slips for training, each predicted from those
    before it.

    Args:
        arrays: levels of all slips.
        law: fitted to the first ones.
        training: how many these are.

    Returns:
        Degrees of freedom (two or more) and scale; None, for the normal law, where Akaike's criterion for few data does
        not pay for these two.
    """
    from scipy import stats
    from scipy.optimize import minimize

    own, ahead, found = predictor(law), Ahead.of(arrays, training), []
    for i in range(training):
        if i >= FIRST:
            at = {**ahead(arrays, i - 1), "time": float(arrays["time_onset"][i])}
            mean, std = own.predict({c: at[c] for c in law.coordinates or ("time",)}, ONSET)
            found.append((float(arrays["onset"][i]) - float(mean)) / float(std))
        take(own, arrays, i)
    errors = np.array(found)

    def cost(theta: Array) -> float:
        return -float(stats.t.logpdf(errors, 2.0 + np.exp(theta[0]), scale=np.exp(theta[1])).sum())

    best = minimize(cost, [1.0, -0.2], method="Nelder-Mead")
    gain = -best.fun - float(stats.norm.logpdf(errors).sum())
    if not gain > 2.0 + 6.0 / max(errors.size - 3, 1):
        return None
    return 2.0 + float(np.exp(best.x[0])), float(np.exp(best.x[1]))


def _unseen(arrays: Mapping[str, Array], law: Wander, training: int) -> Array:
    """Log densities of later levels at onset."""
    own = predictor(law)
    out = []
    for i, level in enumerate(arrays["onset"]):
        if i >= training:
            mean, std = own.predict(coordinates(arrays, i, "onset"), ONSET)
            out.append(float(-0.5 * ((level - mean) / std) ** 2 - np.log(std) - 0.5 * np.log(2.0 * np.pi)))
        take(own, arrays, i)
    return np.array(out)


class Forecaster:
    """What was learned from the first part of a run, and forecasts from it along the rest.

    With p the density of the level at the next onset, the travel delta that the load point still has to go has the
    density

        p(delta) ~ sum_j p(level + M_j(delta)) L(rise | delta),    delta > 0,

    M_j(delta) being the level that stick j still missed so far from its onset. That the slip has not come yet is in
    delta > 0 (for a straight M it is the truncated p), and the rise of the level of late, less where creep has begun,
    is weighed by what it was that far from the onsets seen.

    Args:
        past: the run.
        law: of the wandering level.
        rise: whether the rise of late is used.
    """

    def __init__(self, past: Past, law: Wander, rise: bool = True) -> None:
        self.past, self.law, self._rising = past, law, rise
        arrays, n = past.arrays, training_slips(past)
        self.training = n
        self._own = predictor(law)
        self._taken = 0
        self._spread = spread(arrays, law, n)
        gained = arrays["onset"][1:n] - arrays["arrest"][: n - 1]
        waits = np.diff(arrays["time_onset"][:n])
        self.curves = Curves.of(past, np.arange(1, n))
        self._ahead = Ahead.of(arrays, n)
        self._strength = float(np.mean(arrays["onset"][:n])), float(np.std(arrays["onset"][:n], ddof=1))
        self._gain = float(np.mean(gained)), float(np.std(gained, ddof=1))
        self.recurrence, self._waits = float(np.mean(waits)), np.sort(waits)

    def at(self, i: int) -> dict[str, Array] | None:
        """Time to the next slip (s) at a sample, by every method: equally likely values.

        Args:
            i: sample; must not go back from call to call.

        Returns:
            None where a slip is seen to go on, or where it is not yet certain that it is over. That one has begun is
            seen half a window later, and until then nothing tells of it.
        """
        past, arrays = self.past, self.past.arrays
        t = float(past.trace.time[i])
        before = int(np.searchsorted(past.known, t, side="right")) - 1
        if before < 0 or int(np.searchsorted(past.visible, t, side="right")) - 1 > before:
            return None
        for j in range(self._taken, before + 1):
            take(self._own, arrays, j)
        self._taken = max(self._taken, before + 1)
        level, arrest = float(past.level[i]), float(arrays["arrest"][before])
        begun = int(np.searchsorted(past.trace.time, arrays["time_arrest"][before]))
        ahead = self.curves.ahead(after_turn(past.way, begun, i) > begun)
        until = past.arrival(i, self.curves.travel[:ahead], self.recurrence)
        mean, std = self._next(before, t + until)
        start = arrest + self._gain[0]
        arrest_at = float(np.interp(arrays["time_arrest"][before], past.trace.time, past.way_gone))
        turn = after_turn(past.way, begun, i)
        if turn > begun:  # what was loaded before is unloaded again, and a stick counts from there
            arrest_at = max(arrest_at, float(past.way_gone[turn]))
        missing = self.curves.missing_at(gone := float(past.way_gone[i]) - arrest_at)
        seen = self._seen(i, before, gone, missing)
        seen = None if seen is None else seen[:ahead]
        at_onset = level + missing[:, :ahead]
        return {
            "wandering strength": times(until, at_onset, mean, std, seen, self._spread),
            "mean recurrence": waiting(self._waits, t - float(arrays["time_onset"][before])),
            "constant strength": times(until, at_onset, *self._strength),
            "slip-predictable": times(until, at_onset, start, self._gain[1]),
        }

    def _next(self, before: int, then: Array) -> tuple[Array, Array]:
        """Mean and standard deviation of the level at the next onset, for every time at which it could be."""
        at: dict[Coordinate, float | Array] = {**self._ahead(self.past.arrays, before)}
        if "time" in self.law.coordinates:
            at["time"] = then
        mean, std = self._own.predict({c: at[c] for c in self.law.coordinates or ("time",)}, ONSET)
        return np.broadcast_to(mean, then.shape), np.broadcast_to(std, then.shape)

    def _seen(self, i: int, before: int, gone: float, missing: Array) -> Array | None:
        """Likelihood of the rise of late at each travel to go; None where the stick is too young to tell."""
        past, lag = self.past, self.curves.lag
        begun = after_turn(past.way, int(np.searchsorted(past.trace.time, past.known[before])), i)
        if not self._rising or past.way_gone[i] - lag < past.way_gone[begun]:
            return None
        part = slice(begun, i + 1)
        earlier = float(np.interp(past.way_gone[i] - lag, past.way_gone[part], past.level[part]))
        return self.curves.seen(float(past.level[i]) - earlier, gone, missing)


def times(
    until: Array, level: Array, mean: Array | float, std: Array | float, seen: Array | None = None,
    tails: tuple[float, float] | None = None,
) -> Array:  # fmt: skip
    """Equally likely times to a slip whose level at onset has a known distribution.

    Args:
        until: times (s) at which it could come, ascending, of even travel, shape (k,).
        level: what the level at onset would be then, by every curve, shape (sticks, k).
        mean, std: of that level, shape (k,).
        seen: likelihood of what else was seen, shape (k,).
        tails: degrees of freedom and scale (in ``std``) of Student's t; None: it is normal.
    """
    z = (level - mean) / std
    if tails is None:
        logs = -0.5 * z**2 - np.log(std)
    else:
        freedom, scale = tails
        logs = -0.5 * (freedom + 1.0) * np.log1p((z / scale) ** 2 / freedom) - np.log(std)
    if seen is not None:
        logs = logs + np.log(np.maximum(seen, 1e-300))
    density = np.exp(logs - logs.max()).sum(axis=0)
    share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp((np.arange(MEMBERS) + 0.5) / MEMBERS * share[-1], share, until)


def waiting(sorted_times: Array, elapsed: float) -> Array:
    """Time left by the recurrences that were seen, of those longer than what has elapsed; equally likely values.

    Beyond the longest one an exponential distribution of their standard deviation goes on: no recurrence tells of it.
    """
    longer = sorted_times[sorted_times > elapsed]
    if longer.size:
        return longer - elapsed
    middle = (np.arange(MEMBERS) + 0.5) / MEMBERS
    return -float(np.std(sorted_times, ddof=1)) * np.log1p(-middle)


def training_slips(past: Past) -> int:
    """How many slips are over within the part for training.

    Raises:
        ArgumentError: too few.
    """
    number = int(np.sum(past.known <= past.split))
    if number < FEWEST:
        raise ArgumentError(
            f"trace '{past.trace.name}' has {number} slips in the part for training", key="train",
            allowed=f"{FEWEST} or more", hint="a larger share, a longer record, or a smaller 'minimum_slip'",
        )  # fmt: skip
    return number
