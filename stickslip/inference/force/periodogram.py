"""The period of a wave with a phase for each run: a periodogram of the residual force.

A wave keeps its phase over a whole run, hundreds of periods long, so its frequency must be met to a fraction of one
over the length of the run. Signatures at so many frequencies would take minutes. Within one event a frequency counts
only to one over the length of the event: signatures are taken on that coarse grid, and between its frequencies each
event's pair of columns (sine and cosine) is turned by the phase that it gains since the run began.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...physics.params import specs
from .fit import Fit
from .linearised import Array
from .signatures import CHUNK, Explained, signatures

LONGEST = 1.5  # of a record: a longer wave is a trend
SHORTEST = 60.0  # periods a stick: beyond them the windows of the creep see nothing of a wave
RATIO = 1.04  # of neighbours on the coarse grid, where an event is shorter than a period or two
FINE = 3.0  # frequencies for each one that a run resolves
CLOSE = 0.5  # of one over the median stick: spacing of the coarse grid
PEAKS = 6  # the highest are evaluated without turning
NEARER = np.array([-0.5, -0.25, 0.0, 0.25, 0.5])  # about each of them, in units of what the longest run resolves
LEAST = 0.3  # of its standard deviation that a wave's amplitude is: with none it has no phase
TOGETHER = CHUNK // 2  # frequencies whose signatures are taken at once


@dataclass(frozen=True)
class Wave:
    """The wave that explains most of the residual force.

    Attributes:
        value: of the effect's period or frequency (SI).
        fall: of the cost, with one amplitude and a phase for each run.
        sine, cosine: their amplitudes, each of shape (R,).
        amplitude: of all runs together, at the phases of each.
        columns: derivatives of the residual force in the two, shape (2, p).
        tried: how many frequencies the records resolve.
    """

    value: float
    fall: float
    sine: Array
    cosine: Array
    amplitude: float
    columns: Array
    tried: int

    @property
    def phases(self) -> Array:
        """Of the runs (rad), shape (R,)."""
        return np.arctan2(self.cosine, self.sine)

    def column(self, run: NDArray[np.intp]) -> Array:
        """Derivative of the residual force in one amplitude of all runs, at the phase of each, shape (p,).

        ``run`` is that of each point, shape (p,).
        """
        return np.asarray(self.columns[0] * np.cos(self.phases)[run] + self.columns[1] * np.sin(self.phases)[run])


def waves(effect: Any) -> bool:
    """Whether an effect has a period to be sought and a phase of each run."""
    return effect.periodic is not None and hasattr(effect, "phase") and getattr(effect, "form", None) != "trend"


def best_wave(base: Fit, explained: Explained, effect: Any) -> Wave | None:
    """The best period of an effect on top of a model; None where the records are too short for one."""
    name, variable = effect.periodic
    spec = specs(effect)[name]
    along = {"time": "t", "load point": "drive", "displacement": "x"}[variable]
    grid, step = _grid(base, along, spec, name)
    if grid.size == 0:
        return None
    frequencies = _Frequencies(base, effect)
    edges = np.concatenate([[grid[0]], 0.5 * (grid[1:] + grid[:-1]), [grid[-1]]])
    found = []
    for at in range(0, grid.size, TOGETHER):  # all signatures at once would fill the memory
        part = grid[at : at + TOGETHER]
        found.append(_turned(base, explained, frequencies(part), part, edges[at : at + part.size + 1], step, along))
    fine, falls = (np.concatenate(parts) for parts in zip(*found, strict=True))
    near = np.concatenate([peak + step * NEARER for peak in _peaks(fine, falls, step)])
    near = np.clip(near, grid[0], grid[-1])  # where the parameter's bounds are
    pairs = frequencies(near).reshape(near.size, 2, -1)
    tried = max(round(fine.size / FINE), 1)
    highest = (_wave(base, explained, frequencies.value(f), p, tried) for f, p in zip(near, pairs, strict=True))
    return max(highest, key=lambda wave: wave.fall)


def _wave(base: Fit, explained: Explained, value: float, pair: Array, tried: int) -> Wave:
    """The wave of one period; a run that hardly sees it has a phase, and says little of the amplitude."""
    sizes = explained.gain(by_run(base, pair))[1]
    wave = Wave(value, 0.0, sizes[0::2], sizes[1::2], 0.0, pair, tried)
    (fall,), (size,), (error,) = explained.singly(explained.orthogonal(wave.column(base.problem.run)[:, None]))
    return replace(wave, fall=float(fall), amplitude=max(float(size), LEAST * float(error)))


class _Frequencies:
    """Signatures of an effect at frequencies, always as many together, so that one program serves."""

    def __init__(self, base: Fit, effect: Any) -> None:
        self.base, self.effect, self.name = base, effect, effect.periodic[0]

    def value(self, frequency: float) -> float:
        """Of the effect's parameter (SI)."""
        return float(frequency if self.name == "frequency" else 1.0 / frequency)

    def __call__(self, frequencies: Array) -> Array:
        """Sine and cosine of each in turn, shape (2 frequencies, p)."""
        number = frequencies.size
        padded = np.concatenate([frequencies, np.full(TOGETHER - number, frequencies[-1])])
        turns = (0.0, 0.5 * np.pi)
        members = [{self.name: self.value(f), "phase": turn} for f in padded for turn in turns]
        return signatures(self.base, self.effect, members)[: 2 * number]


def _grid(base: Fit, along: str, spec: Any, name: str) -> tuple[Array, float]:
    """The coarse frequencies that the records hold, and the width of what the longest run resolves."""
    runs = base.problem.runs
    spans = np.array([max(float(np.ptp(getattr(k, along))), 1e-300) for k in runs])
    sticks = spans / np.array([max(k.events, 1) for k in runs])
    low, high = (spec.lower, spec.upper) if name == "frequency" else (1.0 / spec.upper, 1.0 / spec.lower)
    low = max(low, 1.0 / (LONGEST * spans.max()))
    high = min(high, SHORTEST / sticks.min())
    if high <= low:
        return np.zeros(0), 0.0
    apart = CLOSE / float(np.median(sticks))
    knee = min(max(apart / (RATIO - 1.0), low), high)
    slow = np.geomspace(low, knee, max(int(np.ceil(np.log(knee / low) / np.log(RATIO))) + 1, 2))
    fast = np.arange(knee + apart, high, apart)
    return np.concatenate([slow, fast]), 1.0 / float(spans.max())


def by_run(base: Fit, pair: Array) -> Array:
    """The two columns of every run by themselves, shape (p, 2 R)."""
    number = len(base.problem.runs)
    out = np.zeros((pair.shape[1], 2 * number))
    for r in range(number):
        own = base.problem.run == r
        out[own, 2 * r : 2 * r + 2] = pair[:, own].T
    return out


def _turned(
    base: Fit, explained: Explained, columns: Array, grid: Array, edges: Array, step: float, along: str
) -> tuple[Array, Array]:
    """Frequencies as close as the longest run asks for, within ``edges``, and the fall of the cost at each.

    Run by run: what two runs have in common through the model's own parameters is left out.
    """
    white, onto, rest = explained.by_event(columns.T)
    place, run_of = _places(base, along, columns), base.problem.event_run
    fine, falls = [], []
    for i, centre in enumerate(grid):
        number = max(int(np.ceil(FINE * (edges[i + 1] - edges[i]) / step)), 1)
        near = edges[i] + (np.arange(number) + 0.5) * (edges[i + 1] - edges[i]) / number
        # the pair as one complex column, sine - i cosine: a turn by theta multiplies it by exp(i theta)
        column = white[:, :, 2 * i] - 1j * white[:, :, 2 * i + 1]
        bent = onto[:, :, 2 * i] - 1j * onto[:, :, 2 * i + 1]
        turn = np.exp(2j * np.pi * np.outer(near - centre, place[:, i]))
        square, twice = (np.abs(column) ** 2).sum(axis=1), (column**2).sum(axis=1)
        upon = (column * rest).sum(axis=1)
        total = np.zeros(number)
        for r in range(len(base.problem.runs)):
            own = np.flatnonzero(run_of == r)
            if own.size == 0:
                continue
            t = turn[:, own]
            z = t @ upon[own]
            model = t @ bent[own]
            norm = square[own].sum() - (np.abs(model) ** 2).sum(axis=1)
            skew = (t**2) @ twice[own] - (model**2).sum(axis=1)
            total += _fall(z, norm, skew)
        fine.append(near)
        falls.append(total)
    return np.concatenate(fine), np.concatenate(falls)


def _fall(z: Array, norm: Array, skew: Array) -> Array:
    """Fall of the cost with both parts of a complex column: of it the product with the residual, and its two norms.

    With s and c its parts, norm = s.s + c.c, skew = s.s - c.c - 2 i s.c, z = s.rest - i c.rest.
    """
    ss, cc, sc = 0.5 * (norm + skew.real), 0.5 * (norm - skew.real), -0.5 * skew.imag
    determinant = ss * cc - sc**2
    fall = (cc * z.real**2 + ss * z.imag**2 + 2.0 * sc * z.real * z.imag) / np.maximum(determinant, 1e-300)
    return np.where(determinant > 1e-6 * norm**2, fall, 0.0)


def _places(base: Fit, along: str, columns: Array) -> Array:
    """Where along its variable each event sees a wave, shape (E, frequencies)."""
    at = np.concatenate(
        [run.mean @ getattr(run, along) / (run.mean @ np.ones(run.t.size)) for run in base.problem.runs]
    )
    weights = columns[0::2] ** 2 + columns[1::2] ** 2
    places = base.blocks(at)
    shares = base.blocks(weights.T)
    return np.einsum("en,enf->ef", places, shares) / (shares.sum(axis=1) + 1e-300)


def _peaks(fine: Array, falls: Array, step: float) -> list[float]:
    """The highest frequencies, no two of which one run would take for the same."""
    chosen: list[float] = []
    for i in np.argsort(-falls):
        if all(abs(fine[i] - f) > step for f in chosen):
            chosen.append(float(fine[i]))
        if len(chosen) == PEAKS:
            break
    return chosen
