"""Faults of recorders: found, mended or left out, and counted. Every function says what it did as a `Repair`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...system.units import shown
from ..channels import CHANNELS
from ..drive import Drive
from ..provenance import Repair
from ..trace import Trace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_COUNTS = 2.0**53  # beyond which whole counts cannot be distinguished
FIRST_SAMPLES = 5  # of a record, which tell where it begins


def unwrap(values: Array, period: float, channel: str, resolution: float | None = None) -> tuple[Array, list[Repair]]:
    """Undo the wrapping of a counter: whole periods are added where it jumps by more than half of one.

    Args:
        values: shape (n,); NaN is passed over.
        period: range of the counter, in the unit of the values (4096 counts of 7.91 nm: 32.4 um).
        channel: for messages; the name of a trace's channel, whose values are in its SI unit, or any other name.
        resolution: if given, the period is rounded to whole counts, so that many wraps add up exactly.

    Raises:
        InputError: jumps that lie near half a period, which may be of either sign.
    """
    if resolution and period < MOST_COUNTS * resolution:
        period = max(1.0, round(period / resolution)) * resolution
    valid = np.flatnonzero(np.isfinite(values))
    jumps = np.diff(values[valid])
    turns = np.round(jumps / period)
    if not turns.any():
        return values, []
    rest = np.abs(jumps - turns * period)
    doubtful = np.flatnonzero(rest > 0.4 * period)
    if doubtful.size:
        raise InputError(
            f"{channel}: at sample {int(valid[doubtful[0] + 1])} the counter jumps by nearly half its range, so the "
            f"wrap could be of either sign ({doubtful.size} such places)",
            allowed="less than half the counter's range between two samples",
            hint="correct 'wrap', or record faster",
        )
    result = values.copy()
    result[valid[1:]] -= period * np.cumsum(turns)
    places = np.flatnonzero(turns)
    count = int(np.abs(turns).sum())
    where = f"{channel}, first at sample {int(valid[places[0] + 1])}"
    span = shown(period, CHANNELS.get(channel, "1"), 6)
    return result, [Repair("wrap", count, where, f"the counter ran over its range of {span}")]


def join_resets(
    time: Array, values: Array, channel: str, resets: Sequence[float] | bool, resolution: float | None, noise: float
) -> tuple[Array, list[Repair]]:
    """Take out the jumps of a counter that was cleared.

    Args:
        time, values: s and unit of the channel, shape (n,).
        resets: times (s) at which it was cleared, or True: every jump to (nearly) zero by one sample is one.
        resolution, noise: in the unit of the values, for what "nearly zero" means.

    Raises:
        InputError: no jump near a given time.
    """
    if resets is False:
        return values, []
    jumps = np.diff(values)
    step = max(resolution or 0.0, noise, 1e-300)
    if resets is True:
        sudden = np.abs(jumps) > 20 * step
        alone = np.ones_like(sudden)
        alone[1:] &= np.abs(jumps[:-1]) < 0.2 * np.abs(jumps[1:])
        alone[:-1] &= np.abs(jumps[1:]) < 0.2 * np.abs(jumps[:-1])
        places = np.flatnonzero(sudden & alone & (np.abs(values[1:]) < 5 * step))
    else:
        found = []
        for moment in resets:
            middle = int(np.searchsorted(time, moment))
            low, high = max(middle - 4, 0), min(middle + 4, jumps.size)
            place = low + int(np.argmax(np.abs(jumps[low:high]))) if high > low else -1
            if place < 0 or abs(jumps[place]) < 5 * step:
                raise InputError(f"{channel}: no jump of the counter near {moment:g} s", hint="correct 'resets'")
            found.append(place)
        places = np.unique(found)
    if places.size == 0:
        return values, []
    # what the block moved during that one sample is lost: the motion just before stands in for it
    before = np.where(places > 0, jumps[np.maximum(places - 1, 0)], 0.0)
    offsets = jumps[places] - np.where(np.abs(before) < 0.2 * np.abs(jumps[places]), before, 0.0)
    if resolution and np.max(np.abs(offsets)) < MOST_COUNTS * resolution:
        offsets = np.round(offsets / resolution) * resolution
    result = values.copy()
    edges = np.concatenate([places + 1, [values.size]])
    for start, stop, offset in zip(edges[:-1], edges[1:], np.cumsum(offsets), strict=True):
        result[start:stop] -= offset
    where = f"{channel}, first at {time[places[0] + 1]:.6g} s"
    return result, [Repair("reset", int(places.size), where, "the counter was cleared; the record is joined there")]


def despike(values: Array, channel: str, time: Array, noise: float, passes: int = 3) -> tuple[Array, list[Repair]]:
    """Replace single samples that stand out from both neighbours by the neighbours' mean.

    A sample is a spike if it lies at least 8 standard deviations of the noise outside both neighbours, by more than the
    neighbours differ, and by 8 times the steps usual within 9 samples (so that noisier stretches, tips of a sawtooth,
    and the crests of a ring-down sampled only a few times a period are left alone).

    Args:
        values: finite, shape (n,).
        noise: standard deviation of one sample.
    """
    if values.size < 20 or noise <= 0:
        return values, []
    result, marked = values, np.zeros(values.size, bool)
    for _ in range(passes):
        spikes = _spikes(result, noise) & ~marked[1:-1]
        if not spikes.any():
            break
        places = np.flatnonzero(spikes) + 1
        if result is values:
            result = values.copy()
        result[places] = 0.5 * (result[places - 1] + result[places + 1])
        marked[places] = True
    count = int(marked.sum())
    if count == 0:
        return values, []
    where = f"{channel}, first at {time[np.argmax(marked)]:.6g} s"
    return result, [Repair("spike", count, where, "one sample far outside its neighbours, replaced by their mean")]


def _spikes(x: Array, noise: float) -> Mask:
    outside = x[1:-1] - x[:-2]
    other = x[1:-1] - x[2:]
    size = np.minimum(np.abs(outside), np.abs(other))
    size[np.sign(outside) != np.sign(other)] = 0.0
    candidates = (size > 8 * noise) & (size > np.abs(x[2:] - x[:-2]))
    places = np.flatnonzero(candidates)
    if places.size == 0:
        return candidates
    # steps nearby, the largest left out (they may belong to further spikes): what noise, motion or ringing do here
    offsets = np.r_[-9:-2, 2:9]
    around = np.clip(places[:, None] + 1 + offsets, 0, x.size - 2)
    steps = np.sort(np.abs(x[around + 1] - x[around]), axis=1)[:, :-4]
    candidates[places] = size[places] > 8 * steps.mean(axis=1)
    return candidates


def drop_nan(time: Array, channels: dict[str, Array]) -> tuple[Mask | None, list[Repair]]:
    """Which rows to keep so that no channel holds NaN or infinity, None for all, and the runs that are lost."""
    keep: Mask | None = None
    repairs = []
    for name, values in {"time": time, **channels}.items():
        good = np.isfinite(values)
        if good.all():
            continue
        bad = ~good
        first = int(np.argmax(bad))
        runs = int(np.count_nonzero(np.diff(bad.astype(np.int8)) == 1) + bad[0])
        reason = f"not a number, in {runs} run{'s' if runs > 1 else ''}; these samples are left out"
        at = f" ({time[first]:.6g} s)" if np.isfinite(time[first]) else ""
        repairs.append(Repair("nan", int(bad.sum()), f"{name}, first at sample {first}{at}", reason))
        keep = good if keep is None else keep & good
    return keep, repairs


def drop_duplicates(time: Array) -> tuple[Mask | None, list[Repair]]:
    """Which rows to keep so that no time stamp comes twice (the first stays), None for all.

    Raises:
        InputError: time runs backwards, or more than a tenth of the stamps are double (a clock rounded too coarsely).
    """
    same = time[1:] == time[:-1]
    if not same.any():
        return None, []
    count = int(same.sum())
    if count > 0.1 * time.size:
        what = f"{count} of {time.size} time stamps are the same as the one before: the clock is rounded too coarsely"
        raise InputError(what, hint="export time with more digits, or give 'sampling_rate' in place of 'time'")
    first = int(np.argmax(same)) + 1
    where = f"time, first at sample {first} ({time[first]:.6g} s)"
    keep = np.concatenate([[True], ~same])
    return keep, [Repair("duplicate-time", count, where, "a time stamp came twice; the first sample is kept")]


def find_gaps(time: Array) -> tuple[Array, list[Repair]]:
    """Times (s) of the last sample before each gap, and how many samples are missing. Nothing is filled in.

    A gap is a step of more than 1.5 times the usual one. Where such steps are not rare (a twentieth of them or more)
    the sampling rate changes within the record, and only steps longer than those on both sides are gaps.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    if steps.size < 7 or float(steps.max()) <= 1.5 * usual:
        return np.zeros(0), []
    reference = np.full(steps.size, usual)
    if np.count_nonzero(steps > 1.5 * usual) > 0.05 * steps.size:
        from scipy import ndimage  # a fifth of a second that ordinary records do not need

        local = ndimage.median_filter(steps, 5, mode="nearest")
        before, after = np.roll(local, 3), np.roll(local, -3)
        before[:3], after[-3:] = local[:3], local[-3:]
        reference = np.maximum(before, after)
    places = np.flatnonzero(steps > 1.5 * reference)
    if places.size == 0:
        return np.zeros(0), []
    lost = int(np.sum(np.maximum(np.round(steps[places] / reference[places]) - 1, 1)))
    where = f"time, {places.size} gap{'s' if places.size > 1 else ''}, first after {time[places[0]]:.6g} s"
    return time[places], [Repair("dropped-samples", lost, where, "samples are missing; nothing is filled in")]


def correct_clock(time: Array, error: float) -> tuple[Array, list[Repair]]:
    """True time from a clock that runs fast by ``error`` (1e-6 for 1 ppm); the first sample's time stays."""
    if error == 0:
        return time, []
    if not -0.01 < error < 0.01:
        raise InputError("a clock error beyond one per cent", value=error, allowed="-1e4 ppm to 1e4 ppm")
    reason = f"the recorder's clock runs {'fast' if error > 0 else 'slow'} by {abs(error) * 1e6:.4g} ppm, as stated"
    return time[0] + (time - time[0]) / (1.0 + error), [Repair("clock", time.size, "time", reason)]


def from_load_point(trace: Trace) -> Trace:
    """A virgin run with load point and displacement counted from where the load point is as the record begins.

    The spring of a freshly set down block is not stretched then, so what the displacement is off the load point is the
    sensor's own zero. Within noise and counts nothing is changed, nor is any run that does not begin virgin, nor one
    that was cut where the load point was read: it may have been loaded before the part asked for.
    """
    if not trace.virgin or trace.displacement is None or trace.drive is None:
        return trace
    if trace.drive_position is not None and any(r.kind == "cut" for r in trace.repairs):
        return trace
    begins = float(trace.drive.position(trace.time[0]))
    first = trace.displacement[:FIRST_SAMPLES]
    off = float(np.median(first)) - begins
    apart = 3.0 * float(np.median(np.abs(first - np.median(first))))
    least = max(5.0 * (trace.noise or 0.0), 2.0 * (trace.resolution or 0.0), 2.0 * trace.hum, apart, 1e-15)
    off, begins = (v if abs(v) > least else 0.0 for v in (off, begins))
    said = []
    if begins:
        said.append(f"the load point begins at {shown(begins, 'm')}, from where both are counted")
    if off:
        said.append(
            f"the displacement starts {shown(off, 'm')} from the load point; treated as a zero offset of the sensor: "
            "the spring of a freshly placed block (virgin = true) is not stretched"
        )
    if not said:
        return trace
    position = trace.drive_position
    return trace.replace(
        displacement=trace.displacement - (off + begins),
        drive=Drive(trace.drive.times, trace.drive.positions - begins),
        drive_position=None if position is None else position - begins,
        repairs=(*trace.repairs, Repair("zero", trace.time.size, "displacement", "; ".join(said))),
    )
