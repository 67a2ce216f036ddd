"""Hum of the mains in a reading: a sine of the sensor's, told in the sticks from the creep that it lies on.

In every stick the creep is a few polynomials in time and in its logarithm, fewer than would follow the sine. A sine
with one phase for the record is what stands on all of them, and is hum where it stands out from what the same fit finds
at frequencies beside: from what creep, walk and counts leave. Sticks shorter than its period tell nothing so: what is
left of it is found with the model (``readings`` of :class:`.problem.Problem`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...data.resolution import MAINS
from ...data.segment import Segmentation
from ...data.trace import Trace
from .sampling import even

Array = NDArray[np.float64]
BESIDE = np.array([-12.0, -9.0, -6.0, 6.0, 9.0, 12.0])  # Hz, where there is no hum
ABOVE = 3.0  # times the root mean square of the amplitudes there
SHORTEST = 1.2  # periods of the mains in a stick that tells of it
BENDS = 1.5  # polynomials in a period
MOST = 9  # of them in a stick
ENOUGH = 2000.0  # Hz, to which a record is thinned for it
SAMPLES = 8  # in a period
CLEAR = (3.0, 2.0)  # slips after an arrest and before an onset that are left out


@dataclass(frozen=True)
class Hum:
    """Hum of the sensor in a campaign.

    Attributes:
        frequency: of the mains (Hz), 0 where none is detected and none stated.
        amplitude: usual one of a run (m).
    """

    frequency: float = 0.0
    amplitude: float = 0.0

    def at(self, t: Array) -> Array:
        """Sine and cosine, each as large as a standard deviation of what is expected of it (m), shape (n, 2)."""
        return self.amplitude / np.sqrt(2.0) * _basis(t, self.frequency)


def detect_hum(runs: Sequence[tuple[Trace, Segmentation]], slip: float) -> Hum:
    """The hum that some of the runs tell, or else what is stated of it.

    Args:
        runs: with displacement and drive, and their slips.
        slip: usual duration of one (s).
    """
    sticks = [_Sticks(*_even(trace), trace, found, slip) for trace, found in runs]
    found = {f: [size for s in sticks if (size := float(np.hypot(*s.hum(f))))] for f in MAINS}
    best = max(MAINS, key=lambda f: len(found[f]))
    if found[best]:
        return Hum(best, float(np.median(found[best])))
    stated = max((trace.hum for trace, _ in runs), default=0.0)
    return Hum(MAINS[0], stated) if stated else Hum()


def hum(t: Array, x: Array, trace: Trace, found: Segmentation, slip: float, mains: Hum) -> Array:
    """What of a reading is hum, as far as its sticks tell (m), shape (n,).

    Args:
        t, x: time (s), in even steps, and displacement (m), shape (n,).
        trace, found: the run and its slips.
        slip: usual duration of one (s).
        mains: what is detected in the campaign.
    """
    if not mains.frequency:
        return np.zeros_like(x)
    return np.asarray(_basis(t, mains.frequency) @ _Sticks(t, x, trace, found, slip).hum(mains.frequency))


def _even(trace: Trace) -> tuple[Array, Array]:
    assert trace.displacement is not None
    return even(trace.time, trace.displacement)


class _Sticks:
    """Pieces of steady creep of a record."""

    def __init__(self, t: Array, x: Array, trace: Trace, found: Segmentation, slip: float) -> None:
        assert trace.drive is not None
        many = max(int(1.0 / ((t[1] - t[0]) * ENOUGH)), 1)
        whole = t.size // many * many
        self.t, self.x = (a[:whole].reshape(-1, many).mean(axis=1) for a in (t, x))
        self.step = many * (t[1] - t[0])
        after, before = CLEAR[0] * slip, CLEAR[1] * slip
        ends = [-np.inf, *(e.t_arrest + after for e in found.events)]
        begins = [*(e.t_onset - before for e in found.events), np.inf]
        breaks = np.searchsorted(self.t, trace.drive.breakpoints)
        self.pieces: list[tuple[int, int]] = []
        for i, j in np.searchsorted(self.t, np.stack([ends, begins], axis=1)):
            self.pieces += pairwise([i, *(k for k in breaks if i < k < j), j])

    def hum(self, frequency: float) -> Array:
        """Sine and cosine (m), shape (2,); zero where they do not stand out."""
        if frequency * SAMPLES * self.step > 1.0:
            return np.zeros(2)
        found, *others = (self._sine(frequency + apart) for apart in (0.0, *BESIDE))
        least = ABOVE * np.sqrt(np.mean(np.square(others).sum(axis=1)))
        return found if np.hypot(*found) > least else np.zeros(2)

    def _sine(self, frequency: float) -> Array:
        width = 1.0 / (frequency * self.step)
        normal, right = np.zeros((2, 2)), np.zeros(2)
        for i, j in self.pieces:
            if j - i < SHORTEST * width:
                continue
            creep = _creep(j - i, int(np.clip(BENDS * (j - i) / width, 2, MOST)))
            both = np.column_stack([_basis(self.t[i:j], frequency), self.x[i:j] - self.x[i]])
            both -= creep @ (creep.T @ both)
            waves, rest = both[:, :2], both[:, 2]
            variance = max(float(rest @ rest) / (j - i), 1e-30)
            normal += waves.T @ waves / variance
            right += waves.T @ rest / variance
        return np.linalg.solve(normal, right) / np.sinc(frequency * self.step) if normal.any() else right


def _creep(samples: int, count: int) -> Array:
    """Orthonormal courses that creep may take over a stick, shape (samples, count)."""
    time = np.linspace(-1.0, 1.0, samples)
    late = np.log(np.arange(samples) + 0.05 * samples)
    late = 2.0 * (late - late[0]) / (late[-1] - late[0]) - 1.0
    powers = [np.polynomial.legendre.legvander(a, MOST // 2)[:, 1:] for a in (late, time)]
    courses = np.column_stack([np.ones(samples), np.stack(powers, axis=2).reshape(samples, -1)])
    return np.linalg.qr(courses[:, :count])[0]


def _basis(t: Array, frequency: float) -> Array:
    turns = 2.0 * np.pi * frequency * t
    return np.column_stack([np.sin(turns), np.cos(turns)])
