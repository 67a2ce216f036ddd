"""What is known of a run at a moment: samples up to it, and the slips that are over by then. Nothing looks ahead."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...data.checks.spring_force import gain_is_wrong, stick_gain
from ...data.drive import Drive
from ...data.resolution import estimate_resolution, noise_level
from ...data.segment import Event, Segmentation, Settings, block_motion, position_at, segment, velocity
from ...data.segment.find_slips import directions, half_of, pick
from ...data.segment.kinematics import loading_rate
from ...data.trace import Trace
from ...errors import ArgumentError, InputError
from .levels import Scale, level_arrays, scale_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Past:
    """A run whose first part is for training and whose rest is followed as it comes.

    Settings of the events (window, threshold, smallest slip), noise, count and the scale of a measured force are from
    the first part. A measured load point is taken sample by sample, for a line through many samples looks ahead.

    Args:
        trace: the run, as it is followed.
        train: that part of it.
        learned: its events.
        split: s, where the first part ends.
    """

    trace: Trace
    train: Trace
    learned: Segmentation
    split: float

    @classmethod
    def of(cls, trace: Trace, share: float) -> Past:
        """Divide a run.

        Args:
            trace: the run.
            share: of its length that is for training.

        Raises:
            InputError: a share that leaves nothing of either part, or neither load point nor force is known.
        """
        if not 0.0 < share < 1.0:
            raise ArgumentError("the part for training must leave something to forecast", key="train", value=share,
                                allowed="between 0 and 1")  # fmt: skip
        split = float(trace.time[0] + share * (trace.time[-1] - trace.time[0]))
        train = _until(trace, split)
        learned = segment(train)
        gain = stick_gain(train, learned)
        if gain is not None and train.spring_stiffness is not None and gain_is_wrong(gain):
            learned = segment(train, spring_stiffness=train.spring_stiffness * gain["value"])
        scale_of(train, learned)  # without a load point or a force nothing can be told
        return cls(trace, train, learned, split)

    @property
    def settings(self) -> Settings:
        """Of the events, from the first part."""
        return self.learned.settings

    @cached_property
    def scale(self) -> Scale:
        """What turns elongations into levels."""
        return scale_of(self.train, self.learned)

    @cached_property
    def half(self) -> int:
        """Samples in half a window of the events."""
        return half_of(self.trace.time, self.settings)

    @cached_property
    def load_point(self) -> Array:
        """Sample by sample (m); time itself where no drive is known (s of loading)."""
        trace = self.trace
        if trace.drive_position is not None:
            return trace.drive_position
        if self.settings.unit != "m" or trace.drive is None:
            return self._way * (trace.time - trace.time[0])
        return np.asarray(trace.drive.position(trace.time))

    @cached_property
    def _way(self) -> float:
        """Direction in which the block is pulled in the first part, on the whole."""
        train = self.train
        if train.drive is not None and self.settings.unit == "m":
            return 1.0 if float(np.sum(np.diff(train.drive.position(train.time[[0, -1]])))) >= 0 else -1.0
        assert train.spring_force is not None
        return float(np.copysign(1.0, loading_rate(train.time, train.spring_force, train.noise or 0.0)))

    @cached_property
    def way(self) -> Array | float:
        """Direction in which the block is pulled: one number, or one for each sample where it changes."""
        drive = self.trace.drive
        if self.trace.drive_position is None:
            return self._way if drive is None else directions(self.trace.time, self.load_point, drive)
        assert self.train.drive_position is not None
        ways = directions(self.train.time, self.train.drive_position, self.train.drive)
        if not isinstance(ways, np.ndarray):
            return ways
        # as the load point went over so long before that noise is small beside it
        back = 4 * self.half
        gone = np.zeros(self.load_point.size)
        gone[back:] = self.load_point[back:] - self.load_point[:-back]
        far = np.abs(gone) > 0.05 * self.settings.speed * back * self.step
        last = np.maximum.accumulate(np.where(far, np.arange(gone.size), 0))
        return np.where(gone[last] < 0, -1.0, 1.0)

    @cached_property
    def position(self) -> Array:
        """The block's, sample by sample (m, or seconds of loading)."""
        trace, gain = self.trace, self.settings.gain
        if trace.leading == "spring_force":
            assert trace.spring_force is not None and gain is not None
            return self.load_point - trace.spring_force / gain
        return block_motion(trace)[0]

    @cached_property
    def events(self) -> list[Event]:
        """Slips of the whole run, by the settings of its first part."""
        time, settings = self.trace.time, self.settings
        speed = velocity(time, self.position, half_of(time, settings)) * self.way
        return pick(time, self.position, speed, None, settings, self.trace.missing)[0]

    @cached_property
    def arrays(self) -> dict[str, Array]:
        """Levels of all slips; each is known from :attr:`known` on."""
        third = max(1, self.half // 3)

        def load_point(moments: Array) -> Array:
            return np.array([position_at(self.trace.time, self.load_point, t, third) for t in moments])

        return level_arrays(self.events, self.scale.factor, load_point)

    @cached_property
    def known(self) -> Array:
        """Time (s) from which the end of each slip is certain, shape (n,).

        Its arrest is told by samples half a window further on. A slip whose end is where it falls behind the drive
        could still have come to a stop: that takes as long again as it took to become slow.
        """
        out = []
        for e in self.events:
            late = (self.half + 2) * self.step
            if e.arrest == "drive" and self.settings.arrest != "drive":
                late += max(e.t_arrest - e.t_onset, 2 * self.settings.window) + 2 * self.step
            out.append(e.t_arrest + late)
        return np.array(out)

    @cached_property
    def visible(self) -> Array:
        """Time (s) from which each onset can be seen, shape (n,): velocities are of half a window on both sides."""
        return np.array([e.t_onset + (self.half + 2) * self.step for e in self.events])

    @cached_property
    def step(self) -> float:
        """Usual time between samples, s."""
        return float(np.median(np.diff(self.train.time)))

    @cached_property
    def level(self) -> Array:
        """Level at each sample from it and those before it: mean of half a window, shape (samples,)."""
        raw = self.scale.factor * self.way * (self.load_point - self.position)
        sums = np.cumsum(np.concatenate([[0.0], raw - raw[0]]))
        n = np.arange(1, raw.size + 1)
        first = np.maximum(n - self.half, 0)
        return (sums[n] - sums[first]) / (n - first) + raw[0]

    @cached_property
    def travel(self) -> Array:
        """Way of the load point up to each sample (m, or s of loading), shape (samples,)."""
        ways = self.way[1:] if isinstance(self.way, np.ndarray) else self.way
        return np.concatenate([[0.0], np.cumsum(ways * np.diff(self.load_point))])

    @cached_property
    def way_gone(self) -> Array:
        """As :attr:`travel`, without the trembling of a measured load point: it never decreases."""
        return np.maximum.accumulate(self.travel)

    def arrival(self, i: int, further: Array, recent: float) -> Array:
        """Time (s) from sample ``i`` until the load point has gone further by so much.

        A drive that was set is followed as set; of a measured one only the speed over the time ``recent`` (s) before is
        known.
        """
        drive, t = self.trace.drive, float(self.trace.time[i])
        if self.settings.unit != "m" or drive is None:
            return further
        if self.trace.drive_position is not None:
            first = int(np.searchsorted(self.trace.time, t - recent))
            first = min(first, i - 1) if i else 0
            speed = (self.travel[i] - self.travel[first]) / max(t - float(self.trace.time[first]), 1e-300)
            return further / max(speed, 1e-300)
        if drive.times.size == 2:
            return further / max(drive.speed, 1e-300)
        ends = drive.times[drive.times > t]
        last = ends[-1] if ends.size else t
        knots = np.concatenate([[t], ends, [max(last, t) + 1.0]])
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(drive.position(knots))))])
        slope = (way[-1] - way[-2]) / (knots[-1] - knots[-2])
        beyond = np.maximum(further - way[-1], 0.0) / max(slope, 1e-300)
        # where the drive stands still the later end of the pause is meant: nothing is loaded within it
        return np.interp(np.minimum(further, way[-1]), way, knots) + beyond - t


def _until(trace: Trace, moment: float) -> Trace:
    """The run up to a moment, with noise and count as these samples show them."""
    try:
        part = trace.between(stop=moment)
    except InputError as error:
        raise error.but(key="train") from None
    count = estimate_resolution(part.signal)
    drive = part.drive
    if part.drive_position is not None:
        drive = Drive.sampled(part.time, part.drive_position)
    return part.replace(resolution=count, noise=noise_level(part.signal, count), drive=drive)
