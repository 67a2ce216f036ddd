"""Velocity, scale of the reading and clock of every run, by what its slips and those of the other runs agree on.

That a block does not travel as its load point is stated to may be the fault of the velocity, the reading's scale or the
clock. The slips tell: a wrong velocity leaves them alone, a wrong scale makes them larger, a wrong clock longer, than
slips of the other runs. A gain that all runs share, up to some per cent, is physics, as is friction that changes along
the way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...system.units import shown
from ..campaign import Campaign, Rig
from ..trace import Trace
from .finding import Finding
from .travel import Array, Travel

CHANCE = 3.5  # standard deviations
LEAST = 0.01  # smaller differences between runs are not spoken of
COMMON = 0.04  # an error of scale that all runs share, up to which it may be a sensor's gain or wear
IMPOSSIBLE = 30.0  # factor beyond which nothing can be made of block and drive together
_SIZE, _TIME = 0.015, 0.015  # to which slips of the same rig are as large and as long at all velocities (relative)
_DELTA_CHI2 = 4.0  # up to which two explanations are both given
_CLOCK = 0.004  # standard deviation of a clock found from the pieces of a drive
_VELOCITY, _SCALE, _CLOCKED = "drive velocity", "scale", "time"


def scale_findings(campaign: Campaign, traces: Sequence[Trace], travels: Sequence[Travel | None]) -> list[Finding]:
    """What is off in velocities, scales and clocks; ``travels`` is one for each trace."""
    out = []
    known: list[tuple[Trace, Travel]] = []
    for trace, seen in zip(traces, travels, strict=True):
        if seen is None or (seen.slope <= 0.0 and seen.slips < 4):
            continue
        if seen.slips >= 4 and not 1 / IMPOSSIBLE < seen.slope < IMPOSSIBLE:
            out.append(_impossible(trace, seen))
            continue
        known.append((trace, seen))
    if not known:
        return out
    off, agreed = _outliers([seen for _, seen in known])
    centre = float(np.median([known[i][1].slope for i in agreed]))
    common = _common([known[i] for i in agreed], len(traces))
    for i, (trace, seen) in enumerate(known):
        rig = campaign.rig_of(trace.name)
        others = [
            t for j, (o, t) in enumerate(known) if j in agreed and j != i and _same_rig(rig, campaign.rig_of(o.name))
        ]
        if i in off:
            out.append(_one(trace, seen, 1.0 if common else centre, off[i], others))
        if seen.clock is not None and abs(seen.clock - 1.0) > CHANCE * _clock_std(seen):
            out.append(_clock(trace, seen))
    return [*out, *common]


def _same_rig(a: Rig, b: Rig) -> bool:
    """Whether two runs should have the same slips."""
    names = ("mass", "spring_stiffness", "contacts", "normal_force", "friction_coefficient")
    return all(getattr(a, name) == getattr(b, name) for name in names)


def _outliers(seen: Sequence[Travel]) -> tuple[dict[int, float], list[int]]:
    """Runs whose slope differs from the others' beyond its error, with that error; and the runs that agree."""
    off: dict[int, float] = {}
    agreed = list(range(len(seen)))
    while len(agreed) > 1:
        found: list[tuple[float, int, float]] = []
        for i in agreed:
            others = [seen[j] for j in agreed if j != i]
            slopes = np.array([o.slope for o in others])
            variance = float(np.mean([o.std**2 for o in others]))
            middle = float(np.median(slopes))
            spread = (1.4826 * float(np.median(np.abs(slopes - middle)))) ** 2
            drifting = seen[i].trend_std(float(np.median([o.trend for o in others])))
            std = float(np.sqrt(seen[i].std ** 2 + drifting**2 + max(spread, variance / len(others))))
            away = seen[i].slope - middle
            if abs(away) > max(LEAST, CHANCE * std):
                # of two runs nobody knows which is wrong but by the file itself
                found.append((abs(seen[i].slope - 1.0) if len(agreed) == 2 else abs(away) / std, i, std))
        if not found:
            break
        _, worst, std = max(found)
        off[worst] = std
        agreed.remove(worst)
    return off, agreed


def _common(agreed: Sequence[tuple[Trace, Travel]], runs: int) -> list[Finding]:
    """The finding on a factor that all runs which agree share, if it is more than a sensor's gain may be."""
    slopes = np.array([seen.slope for _, seen in agreed])
    # the allowances are common to all runs: their mean is no better known
    allowed = np.mean([s.allowance**2 + s.trend_std(0.0) ** 2 for _, s in agreed])
    std = float(np.sqrt(allowed + np.mean([s.scatter**2 for _, s in agreed]) / slopes.size))
    factor = float(np.median(slopes))
    if abs(factor - 1.0) < max(COMMON, CHANCE * std):
        return []
    name = agreed[0][0].name if len(agreed) == 1 else None
    where = _listed([t.name for t, _ in agreed])
    trace, seen = agreed[0]
    pair = (
        _diverging(where, seen)
        if len(agreed) == 1
        else f"{where}: over whole cycles the block moves {factor:.3f} (+-{std:.3f}) times as far as the drive is "
        "stated to, and the spring would stretch without limit"
    )
    velocities = "drive's velocity" if len(agreed) == 1 else "drive's velocities"
    sentence = (
        f"{pair}. The {velocities} or the {trace.leading}'s unit or the clock is wrong: check drive_velocity, the unit "
        f"of {trace.leading} and sampling_rate or the unit of time; multiplied by {factor:.3f} the drive agrees with "
        "the block."
    )
    what = f"{_VELOCITY} or {trace.leading} {_SCALE} or {_CLOCKED}"
    return [Finding(what, name if runs > 1 else None, 1.0, factor, std, "1", sentence)]


def _impossible(trace: Trace, seen: Travel) -> Finding:
    what = f"{_VELOCITY} or {trace.leading} {_SCALE} or {_CLOCKED}"
    text = _diverging(trace.name, seen)
    return Finding(what, trace.name, 1.0, seen.slope, seen.std, "1", text, impossible=True)


def _diverging(where: str, seen: Travel) -> str:
    block, drive = shown(seen.block, "m/s", 3), shown(seen.drive, "m/s", 3)
    return (
        f"{where}: from slip to slip the block moves {block}, the drive {drive}; the spring would stretch without limit"
    )


def _clock_std(seen: Travel) -> float:
    return float(np.sqrt(seen.std**2 + seen.trend_std(0.0) ** 2 + _CLOCK**2))


def _clock(trace: Trace, seen: Travel) -> Finding:
    """A clock that the pieces of the drive contradict."""
    assert seen.clock is not None
    std = _clock_std(seen)
    rate, true = trace.sampling_rate, trace.sampling_rate / seen.clock
    sentence = (
        f"{trace.name}: slips and drive segments agree if the time axis is stretched by a factor of "
        f"{seen.clock:.3f} (+-{std:.3f}). Check sampling_rate ({shown(rate, 'Hz', 4)} stated, the motion gives "
        f"{shown(true, 'Hz', 3)}) or the unit of time, and the drive's 'until' times."
    )
    return Finding(_CLOCKED, trace.name, rate, true, true * std / seen.clock, "Hz", sentence)


def _one(trace: Trace, seen: Travel, centre: float, std: float, others: Sequence[Travel]) -> Finding:
    """The finding on one run that differs from the others, by as much as its slips explain."""
    factor, error = seen.slope / centre, std / centre
    likely, why = _explained(seen, factor, others)
    leading = trace.leading
    head = (
        f"{trace.name}: over {seen.slips - 1} whole cycles the block moves {seen.slope:.3f} (+-{std:.3f}) times as "
        f"far as the drive is stated to, and {centre:.3f} times in the runs that agree"
    )
    speed = trace.drive_velocity or 0.0
    told = {
        _VELOCITY: f"drive_velocity (the motion gives {_with_error(speed * factor, speed * error, 'm/s')}, stated "
        f"{shown(speed, 'm/s', 4)})",
        _SCALE: f"the unit of {leading} (multiplied by {1 / factor:.3f} +-{error / factor**2:.3f} it agrees with the "
        "drive)",
        _CLOCKED: f"sampling_rate or the unit of time (the motion gives {shown(trace.sampling_rate / factor, 'Hz', 4)},"
        f" stated {shown(trace.sampling_rate, 'Hz', 4)})",
    }
    sentence = f"{head}. {why} Check {', or '.join(told[k] for k in likely)}."
    first = likely[0]
    numbers = {
        _VELOCITY: (speed, speed * factor, speed * error, "m/s"),
        _SCALE: (1.0, 1.0 / factor, error / factor**2, "1"),
        _CLOCKED: (trace.sampling_rate, trace.sampling_rate / factor, trace.sampling_rate * error / factor**2, "Hz"),
    }[first]
    names = {_VELOCITY: _VELOCITY, _SCALE: f"{leading} {_SCALE}", _CLOCKED: _CLOCKED}
    return Finding(" or ".join(names[k] for k in likely), trace.name, *numbers, sentence)


def _explained(seen: Travel, factor: float, others: Sequence[Travel]) -> tuple[list[str], str]:
    """Which of velocity, scale and clock explain a run's slope, the likeliest first, and what its slips say."""
    clocks = [_CLOCKED] if seen.clock is None else []  # the pieces of a drive have told of the clock
    every = [_VELOCITY, _SCALE, *clocks]
    size, size_std = _against(seen, others, "release", _SIZE)
    lasts, lasts_std = _against(seen, others, "duration", _TIME)
    if not np.isfinite([size, lasts]).all():
        return every, "Slips cannot be compared with those of other runs."
    wanted = {_VELOCITY: (1.0, 1.0), _SCALE: (factor, 1.0), _CLOCKED: (1.0, 1.0 / factor)}
    away = {
        k: (np.log(size / large) / size_std) ** 2 + (np.log(lasts / long) / lasts_std) ** 2
        for k, (large, long) in wanted.items()
    }
    order = sorted(every, key=lambda k: away[k])
    likely = [k for k in order if away[k] < away[order[0]] + _DELTA_CHI2]
    return likely, f"Its slips are {size:.2f} times as large and last {lasts:.2f} times as long as theirs."


def _against(seen: Travel, others: Sequence[Travel], name: str, scatter: float) -> tuple[float, float]:
    """A property of a run's slips over that which the other runs let expect, and the deviation of its logarithm.

    Where the others have several velocities, it is followed along the velocity and along its logarithm.
    """
    known = [o for o in others if getattr(o, name) > 0 and o.speed > 0]
    value = getattr(seen, name)
    if not known or not value > 0 or not seen.speed > 0:
        return float("nan"), float("nan")
    y = np.log([getattr(o, name) for o in known])
    speeds = np.array([o.speed for o in known])
    if y.size >= 4 and np.unique(np.log(speeds).round(2)).size >= 3:
        # two courses that agree where there are runs, and beyond them only as well as one may go on
        either = [_line(f(speeds) - f(seen.speed), y) for f in (np.log, np.asarray)]
        expected = float(np.mean([e for e, _ in either]))
        std = float(np.hypot(max(s for _, s in either), abs(either[0][0] - either[1][0])))
    else:
        expected, std = float(np.mean(y)), float(np.ptp(y)) if y.size > 1 else 2.0 * scatter
    return float(np.exp(np.log(value) - expected)), float(np.hypot(std, scatter))


def _line(x: Array, y: Array) -> tuple[float, float]:
    """Value at zero of a straight line through points, and its standard deviation."""
    a = np.stack([np.ones(y.size), x / np.abs(x).max()], axis=1)
    found = np.linalg.lstsq(a, y, rcond=None)[0]
    level = float(np.sqrt(np.sum((y - a @ found) ** 2) / (y.size - 2)))
    return float(found[0]), level * float(np.sqrt(np.linalg.inv(a.T @ a)[0, 0]))


def _with_error(value: float, std: float, unit: str) -> str:
    return f"{shown(value, unit, 4)} +-{shown(std, unit, 2)}"


def _listed(names: Sequence[str], most: int = 4) -> str:
    told = ", ".join(names[:most])
    return told if len(names) <= most else f"{told} and {len(names) - most} more"
