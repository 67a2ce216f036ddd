"""The ringing that goes on where samples are not followed any more: the block turns twice a period, at known places.

In windows a reading is its mean, and the way that the block rings in them is lost. It is some nanometres a swing and
adds up: where junctions are replaced along the path, or the contact is weakened by it, it is much of the path
between two slips.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
PART = 3  # periods of which an amplitude is told
DETECTED = 3.0  # deviations by which it stands out
LAST = 0.05  # of the amplitude where the samples end, down to which the ringing goes on


class Turns(NamedTuple):
    """Where the block turns after the last sample that is followed.

    Attributes:
        begin, mean: last sample's time (s), and place around which it rings there (m), shape (m,).
        t: time (s), shape (m,).
        away: displacement from the place around which it rings (m), shape (m,).
    """

    begin: Array
    mean: Array
    t: Array
    away: Array

    def knots(self, t: Array, x: Array, slow: NDArray[np.bool_], period: float) -> tuple[Index, Array, Array, Array]:
        """Those where the block turns, between knots that are means over windows.

        Args:
            t, x: of the knots (s, m), shape (n,).
            slow: whether they are means.
            period: of the ringing (s).

        Returns:
            Knots before them, their share of the time to the next one, displacement (m) and velocity (m/s).
        """
        before = np.searchsorted(t, self.t) - 1
        own = np.flatnonzero((before >= 0) & (before < t.size - 1))
        own = own[slow[before[own] + 1]]
        at, away, before = self.t[own], self.away[own], before[own]
        first = ~slow[before]  # of a sample the mean is not known
        t0, x0 = np.where(first, self.begin[own], t[before]), np.where(first, self.mean[own], x[before])
        share = (at - t[before]) / (t[before + 1] - t[before])
        speed = (x[before + 1] - x0) / (t[before + 1] - t0)
        keep = (np.abs(speed) < 2.0 * np.pi / period * np.abs(away)) & (share < 1.0)
        way = x0 + speed * (at - t0) + away
        return before[keep], share[keep], way[keep], np.zeros(np.count_nonzero(keep))


def later_turns(t: Array, x: Array, stretches: Sequence[tuple[int, int]], period: float, noise: float) -> Turns:
    """Where the block goes on to turn in stretches that are not followed.

    Amplitude, phase and mean are those of a wave in the last periods that are followed. How the ringing dies away is
    measured in all stretches of a run together, so that it is detected below the noise of one: while elements slide at
    every swing, it is no exponential.

    Args:
        t, x: times (s) and readings (m), shape (N,).
        stretches: for every arrest, the last sample that is followed and the first one that is again.
        period: of the ringing (s); with 0 there is none.
        noise: of a sample (m).
    """
    none = Turns(*(np.zeros(0) for _ in range(4)))
    size = round(PART * period / (t[1] - t[0]))
    stretches = [(end, again) for end, again in stretches if end + 1 >= size]
    if size < 4 * PART or not stretches:
        return none
    turn = 2.0 * np.pi / period
    tau = t[:size] - t[size - 1]
    solve = np.linalg.pinv(np.column_stack([tau**0, tau, tau**2, np.cos(turn * tau), np.sin(turn * tau)]))
    error = noise**2 * float((solve[3:] ** 2).sum())  # of an amplitude's square
    fits = np.array([solve @ x[end + 1 - size : end + 1] for end, _ in stretches])
    amplitude = np.hypot(fits[:, 3], fits[:, 4])
    detected = np.flatnonzero(amplitude > DETECTED * np.sqrt(error))
    if not detected.size:
        return none
    course = _course(x, [stretches[i] for i in detected], solve, amplitude[detected] ** 2 - error, error)
    middles = PART * period * (np.arange(course.size) - 0.5)
    parts = []
    for i in detected:
        end, again = stretches[i]
        phase = float(np.arctan2(-fits[i, 4], fits[i, 3]))
        room = min(middles[-1], t[min(again, t.size - 1)] - t[end])
        later = (np.pi * np.arange(1, int(turn * room / np.pi) + 1) - phase % np.pi) / turn
        away = amplitude[i] * np.exp(np.interp(later, middles, np.log(course))) * np.cos(turn * later + phase)
        parts.append(Turns(np.full(later.size, t[end]), np.full(later.size, fits[i, 0]), t[end] + later, away))
    return Turns(*map(np.concatenate, zip(*parts, strict=True)))


def _course(x: Array, stretches: Sequence[tuple[int, int]], solve: Array, first: Array, error: float) -> Array:
    """Amplitudes after the last samples in parts, over that in them, as long as they are detected; begins with 1.

    Args:
        x: readings (m), shape (N,).
        stretches: as of :func:`later_turns`.
        solve: from the samples of a part to a wave's coefficients.
        first: squares of the amplitudes in the last samples (m^2).
        error: of a square (m^2).
    """
    size, out = solve.shape[1], [1.0]
    while True:
        low = (len(out) - 1) * size + 1
        there = [k for k, (end, again) in enumerate(stretches) if end + low + size <= min(again, x.size)]
        squares = np.array([((solve[3:] @ x[stretches[k][0] + low :][:size]) ** 2).sum() for k in there])
        loud = float((squares - error).sum())
        if not there or loud < DETECTED * error * np.sqrt(len(there)):
            break
        out.append(min(float(np.sqrt(loud / first[there].sum())), out[-1]))
        if out[-1] < LAST:
            break
    return np.array(out)
