"""Which periods the base's residuals hint at, for effects that come back in time, in travel or along the track.

What modulates the threshold or the load point moves the onset to where the spring has caught up: the way the load point
still makes is a sine of the *measured* onset, however far that is from where the base expects it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from ..effects.base import Effect
from ..features.measurement import Measurement
from ..fit.composition import PHASE
from ..fit.parameters import Free

Variable = Literal["time", "load point", "displacement"]
MOST = 20_000  # frequencies tried, in PARTS
PARTS = 20
REFINED, KEPT = 20, 5
FEWEST = 6  # slips
LONGEST = 1.5  # times the record: a longer wave is a trend, which other effects describe
LEAST = 0.03  # of a column's width: what few slips leave by chance is no smaller noise
FAR = 5.0  # standard deviations, from the median of the absolute deviations, at which a deviation is cut


def periods(
    variable: Variable,
    measurement: Measurement,
    model: np.ndarray,
    use: np.ndarray,
    bounds: tuple[float, float],
    *,
    together: bool = False,
) -> list[float]:
    """Periods (s or m) with which onsets and slip sizes deviate most, the strongest first.

    A sine and a cosine over ``variable`` at the onsets are fitted to both for every frequency that the records resolve,
    and ranked by the likelihood of noise of unknown size in either: sizes may tell nothing where onsets tell all. Any
    scale is as likely beforehand (a density of 1/frequency), so of waves that slips at even distances cannot tell
    apart the longest comes first. Neighbours of a frequency already taken are left out.

    Args:
        variable: over which the effect is periodic.
        measurement: the data.
        model: features of the base, shape (R, n, F).
        use: cycles to look at, shape (R, n).
        bounds: shortest and longest period.
        together: whether all runs began at the same phase, which tells more where it is so; else each has its own.
    """
    ok = _complete(measurement, use)
    if ok.sum() < FEWEST:
        return []
    size = measurement.layout.slices()["size"].start
    off = measurement.values - model
    data = np.stack([_cut(_late(measurement, off)[ok]), _cut(off[..., size][ok])], axis=1)
    at, run = _at(variable, measurement, measurement.values)[ok], np.nonzero(ok)[0] * (not together)
    span = max(float(np.ptp(at[run == r])) for r in set(run.tolist()))
    if span <= 0 or not np.any(data):
        return []
    low, high = max(1.0 / bounds[1], 0.3 / span), 1.0 / bounds[0]
    # a fifth of the record's own resolution; where the band is wider than that allows, its lower part
    frequency = np.arange(low, high, 0.2 / span)[:MOST]
    if frequency.size == 0:
        return [bounds[1]]

    def unlikely(some: np.ndarray) -> np.ndarray:
        left = _rest(_waves(some, at, run), data) + len(data) * LEAST**2
        return np.asarray(0.5 * len(data) * np.log(left).sum(axis=1) + np.log(some))

    rest = np.concatenate([unlikely(some) for some in np.array_split(frequency, PARTS)])
    # between the steps lies what decides between waves that are nearly as good
    step = frequency[min(1, frequency.size - 1)] - low
    peaks = [_lowest(unlikely, f, step) for f in _apart(frequency[np.argsort(rest)], 0.5 / span, REFINED)]
    return [1.0 / f for f in _apart([f for _, f in sorted(peaks)], 0.5 / span, KEPT)]


def _lowest(unlikely: Callable[[np.ndarray], np.ndarray], at: float, step: float) -> tuple[float, float]:
    """The least value within a step of a frequency, and where it is."""
    found = minimize_scalar(
        lambda f: float(unlikely(np.array([f]))[0]), bounds=(max(at - step, 0.5 * at), at + step), method="bounded"
    )
    return float(found.fun), float(found.x)


def _apart(frequencies: Iterable[float], least: float, most: int) -> list[float]:
    """The first so many that are not neighbours of one before."""
    out: list[float] = []
    for f in frequencies:
        if len(out) < most and all(abs(f - other) > least for other in out):
            out.append(float(f))
    return out


def within_record(effect: Effect, free: Sequence[Free], measurement: Measurement) -> list[Free]:
    """The effect's free parameters; if it is periodic, with no period beyond LONGEST times the longest run, and with a
    phase for each run: no record begins where another did."""
    if effect.periodic is None:
        return list(free)
    name, variable = effect.periodic
    longest = LONGEST * _span(variable, measurement)
    out = []
    for f in free:
        if f.name == f"{effect.tag}.{PHASE}" and measurement.runs > 1:
            out += [
                replace(f, name=f"{f.name}.{r}", doc=f"{f.doc}, in {run}") for r, run in enumerate(measurement.names)
            ]
        else:
            out.append(_limited(f, name, longest) if f.name == f"{effect.tag}.{name}" else f)
    return out


def _limited(free: Free, name: str, longest: float) -> Free:
    if not longest > 0.0:
        return free
    low, high = free.lower, free.upper
    if name == "frequency":
        low = min(max(low, 1.0 / longest), 0.5 * high)
    else:
        high = max(min(high, longest), 2.0 * low)
    prior = float(np.clip(free.prior, low, high))
    return replace(free, lower=low, upper=high, prior=prior).starting(free.start)


def _span(variable: Variable, m: Measurement) -> float:
    """Length of the longest run (s or m)."""
    used = np.asarray(m.cycles.used)
    s = m.layout.slices()
    begin, end = m.values.copy(), m.values
    begin[..., s["recurrence"].start] = 0.0
    first, last = _at(variable, m, begin), _at(variable, m, end)
    if variable == "displacement":
        last = last + end[..., s["size"].start]
    runs = [
        float(np.nanmax(b[u]) - np.nanmin(a[u]))
        for a, b, u in zip(first, last, used & np.isfinite(last), strict=True)
        if u.any()
    ]
    return max(runs, default=0.0)


def phasor(
    variable: Variable, measurement: Measurement, onsets: np.ndarray, change: np.ndarray, period: float, use: np.ndarray
) -> np.ndarray:
    """How far the onsets are late at this period: amplitude (m of the load point's way) and phase of a sine.

    Args:
        variable: over which it is periodic.
        measurement: the data.
        onsets: features (R, n, F) that tell where the onsets are.
        change: of the features, shape (R, n, F).
        period: s or m.
        use: cycles to look at, shape (R, n).

    Returns:
        One complex number for every run, shape (R,), with the amplitude that all have in common; zero for a run without
        cycles.
    """
    ok = _complete(measurement, use) & np.isfinite(change[..., 0]) & np.isfinite(onsets[..., 0])
    told = np.zeros(measurement.runs, complex)
    if not ok.any():
        return told
    late, run = _late(measurement, change)[ok], np.nonzero(ok)[0]
    basis = _waves(np.array([1.0 / period]), _at(variable, measurement, onsets)[ok], run)[0]
    cut = np.median(late) + _width(late) * _cut(late)
    found = np.linalg.lstsq(basis, cut, rcond=None)[0]
    width = _width(late - basis @ found)
    if width > 0:  # what is far is told by what is left, not by how far a locked onset is late
        found = least_squares(lambda x: (basis @ x - late) / width, found, loss="soft_l1", x_scale=width).x
    for i, r in enumerate(sorted(set(run.tolist()))):
        told[r] = complex(found[2 * i], found[2 * i + 1])
    size = np.sqrt(np.average(np.abs(told) ** 2, weights=np.bincount(run, minlength=measurement.runs)))
    return size * np.exp(1j * np.angle(told)) * (told != 0.0)


def _rest(basis: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Sums of squares (frequencies, d) that a basis (frequencies, N, k) leaves of the columns of ``data`` (N, d)."""
    normal = np.swapaxes(basis, 1, 2) @ basis
    explained = np.linalg.pinv(normal, hermitian=True) @ (np.swapaxes(basis, 1, 2) @ data)
    return np.asarray(np.sum((data - basis @ explained) ** 2, axis=1))


def _complete(m: Measurement, use: np.ndarray) -> np.ndarray:
    s = m.layout.slices()
    return np.asarray(use & m.valid[..., s["recurrence"].start] & m.valid[..., s["size"].start])


def _late(m: Measurement, change: np.ndarray) -> np.ndarray:
    """Way of the load point between the onset expected and that measured (m), shape (R, n)."""
    late: np.ndarray = change[..., m.layout.slices()["recurrence"].start] * np.asarray(m.velocities)[:, None]
    return late


def _width(values: np.ndarray) -> float:
    """Standard deviation, from the median of the absolute deviations."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _cut(values: np.ndarray) -> np.ndarray:
    """Deviations from the median in such standard deviations, far ones cut."""
    return np.clip((values - np.median(values)) / (_width(values) or 1.0), -FAR, FAR)


def _waves(frequency: np.ndarray, at: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Sine and cosine of every run (``run``: of which each point is) and a constant, (frequencies, N, 2R + 1)."""
    turn = 2.0 * np.pi * frequency[:, None] * at
    waves = [wave * (run == r) for r in sorted(set(run.tolist())) for wave in (np.sin(turn), np.cos(turn))]
    return np.stack([*waves, np.ones_like(turn)], axis=-1)


def _at(variable: Variable, m: Measurement, features: np.ndarray) -> np.ndarray:
    """Where the onsets are on the variable, shape (R, n)."""
    if variable == "displacement":
        return np.asarray(m.cycles.position)
    slip = np.asarray(m.cycles.start) + features[..., m.layout.slices()["recurrence"].start]
    if variable == "time":
        return slip
    nodes = zip(np.asarray(m.cycles.load_times), np.asarray(m.cycles.load_positions), strict=True)
    return np.stack([_along(t, p, row) for (t, p), row in zip(nodes, slip, strict=True)])


def _along(times: np.ndarray, positions: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Load point at ``t``; beyond the last node it goes on at the last velocity."""
    last = (positions[-1] - positions[-2]) / (times[-1] - times[-2])
    return np.interp(t, times, positions) + np.maximum(t - times[-1], 0.0) * last
