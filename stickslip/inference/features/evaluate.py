"""The features of one cycle: the same lines for the measurement and for the model."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ...simulation.shooting import Track
from .curve import Curve, StepCurve
from .layout import HOLD, LEVELS, RING_SAMPLES, RING_WINDOWS, SETTLE, Layout


class Anchors(NamedTuple):
    """When to look, taken from the data.

    Attributes:
        start: of the cycle (s), its arrest; shape ().
        creep: times before the slip's first twentieth (s), shape (CREEP_POINTS,).
        hold: start and end of the longest hold (s), shape (2,).
        ring_period: expected period of the contact resonance (s).
    """

    start: Any
    creep: Any
    hold: Any
    ring_period: Any


def features(curve: Curve, anchors: Anchors, layout: Layout) -> Any:
    """All features of a cycle, shape (layout.size,), in SI units; those that do not apply hold some finite number."""
    xp = np if isinstance(anchors.start, (float, np.floating)) else jnp
    start, settling = anchors.start, layout.settling
    rest = curve.mean(xp.asarray([start + 1.15 * settling]), 0.3 * settling)[0]
    _, peak = curve.top
    size = peak - rest
    levels = xp.asarray((0.5, *LEVELS))
    times = curve.rise(rest + levels * size, start + settling)
    half, first = times[0], times[1]
    creep_times = first - anchors.creep
    creep = curve.mean(creep_times, xp.maximum(0.12 * anchors.creep, 0.25 * layout.shortest)) - rest
    settle = curve.mean(start + xp.asarray(SETTLE) * settling, 0.1 * settling) - rest
    begin, end = anchors.hold[0], anchors.hold[1]
    length = end - begin
    hold = curve.mean(begin + xp.asarray(HOLD) * length, 0.08 * length) - curve.mean(
        xp.asarray([begin + 0.02 * length]), 0.03 * length
    )
    overshoot = curve.value(xp.asarray([start]))[0] - rest
    ring, frequency = _ringing(curve, start, settling, anchors.ring_period, xp)
    return xp.concatenate(
        [
            xp.stack([half - start, size]),
            times[1:] - half,
            xp.stack([overshoot]),
            ring,
            xp.stack([frequency]),
            creep,
            settle,
            hold,
        ]
    )


@jax.jit
def of_tracks(tracks: Track, anchors: Anchors, times: Any) -> Any:
    """Features of the model in every cycle of a run, shape (n, layout.size).

    Args:
        tracks, anchors: with a leading axis of cycles.
        times: the layout's settling and shortest (s), shape (2,).
    """
    layout = Layout(times[0], times[1])
    return jax.lax.map(lambda pair: features(StepCurve(pair[0]), pair[1], layout), (tracks, anchors))


def _ringing(curve: Curve, start: Any, settling: float, period: Any, xp: Any) -> tuple[Any, Any]:
    """Rms of the reading about its running mean in each window (m), and the frequency of the first part (Hz)."""
    s = xp.linspace(0.0, RING_WINDOWS[-1][1], RING_SAMPLES) * settling
    y = curve.value(start + s)
    # the slow settling is taken out as the mean over a period around every sample
    swing = y - curve.mean(start + s, period)
    rms = []
    for a, b in RING_WINDOWS:
        inside = (s >= a * settling) & (s < b * settling)
        inside = inside & (s > 0.5 * period)
        n = xp.maximum(xp.sum(inside), 1)
        rms.append(xp.sqrt(xp.sum(xp.where(inside, swing**2, 0.0)) / n + 1e-24))
    lag = period / 8.0
    grid = xp.linspace(0.6, 4.0, 64) * period
    z = curve.value(start + grid) - curve.mean(start + grid, period)
    before = curve.value(start + grid - lag) - curve.mean(start + grid - lag, period)
    after = curve.value(start + grid + lag) - curve.mean(start + grid + lag, period)
    # three-term recurrence of a sine: y(t - lag) + y(t + lag) = 2 cos(2 pi f lag) y(t), in least squares
    cosine = xp.sum(z * (before + after)) / xp.maximum(2.0 * xp.sum(z * z), 1e-30)
    frequency = xp.arccos(xp.clip(cosine, -0.999, 0.999)) / (2.0 * np.pi * lag)
    return xp.stack(rms), frequency
