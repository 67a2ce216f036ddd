"""Scale of a spring force, from how fast it rises while the block sticks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..segment import Segmentation
from ..trace import Trace
from .finding import Finding

_FEWEST = 5  # sticks
_CHANCE = 1e-3  # below which runs are not of one scale
_EXACT = 1e-4  # to which a gain is known at best
_SAID = 0.02  # smaller errors of the scale are not spoken of


def stick_gain(trace: Trace, found: Segmentation) -> dict[str, float] | None:
    """Slope of the spring's force in early stick over stiffness times drive, for traces of force alone.

    While the block stands still the force must rise by c_s v0; a median slope that differs is an error of the force's
    scale, of the stiffness or of the drive's velocity (a slope above 1 cannot be creep, which only lowers it).
    """
    stiffness, drive, force = trace.spring_stiffness, trace.drive, trace.spring_force
    if trace.leading != "spring_force" or stiffness is None or drive is None or force is None or not drive.speed:
        return None
    slopes = []
    for event in found.events[1:]:
        if event.holds or not np.isfinite(event.stick_time):
            continue
        begin = event.t_onset - event.stick_time
        low, high = np.searchsorted(trace.time, [begin + 0.15 * event.stick_time, begin + 0.5 * event.stick_time])
        if high - low < 30:
            continue
        t = trace.time[low:high]
        rate = np.polynomial.polynomial.polyfit(t - t.mean(), force[low:high], 1)[1]
        slopes.append(rate / (stiffness * float(drive.velocity(t.mean()))))
    if len(slopes) < _FEWEST:
        return None
    spread = 1.4826 * float(np.median(np.abs(slopes - np.median(slopes))))
    std = 1.2533 * spread / float(np.sqrt(len(slopes)))
    return {"value": float(np.median(slopes)), "std": std, "sticks": float(len(slopes))}


def common_gain(gains: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Mean of gains of :func:`stick_gain`, one or more, by their errors, which are larger where runs differ by more."""
    values, std = (np.array([gain[name] for gain in gains]) for name in ("value", "std"))
    weights = 1.0 / np.maximum(std, _EXACT) ** 2
    mean = float(weights @ values / weights.sum())
    off = float(weights @ (values - mean) ** 2) / max(len(gains) - 1, 1)
    sticks = float(sum(gain["sticks"] for gain in gains))
    return {"value": mean, "std": float(np.sqrt(max(off, 1.0) / weights.sum())), "sticks": sticks}


def gains_agree(gains: Sequence[Mapping[str, float]]) -> bool:
    """Whether gains of runs differ by no more than their errors let expect of one sensor."""
    from scipy.stats import chi2

    values, std = (np.array([gain[name] for gain in gains]) for name in ("value", "std"))
    off = (values - common_gain(gains)["value"]) / np.maximum(std, 0.5 * _SAID)
    return len(gains) < 2 or bool(chi2.sf((off**2).sum(), len(gains) - 1) > _CHANCE)


def gain_is_wrong(gain: Mapping[str, float]) -> bool:
    """Whether the scale of the force must be wrong (see `stick_gain`): it rises faster than the drive can stretch."""
    return gain["value"] - 1.0 > max(_SAID, 3 * gain["std"])


def force_findings(traces: Sequence[Trace], found: Sequence[Segmentation]) -> list[Finding]:
    """A finding for each record of force alone that does not rise as stiffness and drive want it.

    None of them stops a name: a scale that is too large is set right before anything is fitted, and found with the fit;
    a block that creeps along makes one that is too small.
    """
    out = []
    for trace, events in zip(traces, found, strict=True):
        gain = stick_gain(trace, events)
        if gain is None or abs(gain["value"] - 1.0) <= max(_SAID, 3 * gain["std"]):
            continue
        share, wrong = 100 * (gain["value"] - 1.0), gain_is_wrong(gain)
        rises = (
            f"{trace.name}: while the block sticks the force rises {gain['value']:.3f} (+-{gain['std']:.3f}) times as "
            "fast as stiffness times drive"
        )
        scale = f"sensor-gain of about {share:+.0f} %, or the stiffness or the drive's velocity is wrong by as much."
        if wrong:
            text = f"{rises}, which no motion of the block explains (creep can only lower it): {scale}"
        else:
            text = (
                f"{rises}: the block creeps along at {-share:.0f} % of the drive's velocity, or {scale} Force alone "
                "cannot separate the two: measure the block's position as well."
            )
        factor, std = 1.0 / gain["value"], gain["std"] / gain["value"] ** 2
        out.append(Finding("spring force scale", trace.name, 1.0, factor, std, "1", text, stops=False))
    return out
