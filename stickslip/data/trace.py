"""One measured (or simulated) run: SI arrays that nobody can change, where they came from and what was mended."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..system.object_repr import Shown, facts
from ..system.units import ends, factor_to_si, shown, to_si
from .resolution import estimate_resolution, noise_level, rounding_of_mean

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
SIGNALS = {"displacement": "m", "velocity": "m/s", "spring_force": "N"}
CHANNELS = {**SIGNALS, "drive_position": "m", "normal_load": "N"}
MAINS = (50.0, 60.0)  # Hz
COARSENED = "coarsened"  # what a repair of this kind is called
ROLES = ("", "train", "held-out")
SIZES = ("resolution", "noise", "walk", "hum", "spring_stiffness", "minimum_slip")  # of a trace: numbers, not negative


@dataclass(frozen=True)
class Repair:
    """Something changed or left out between the file and the trace.

    Args:
        kind: a short name such as ``"spike"``, ``"wrap"``, ``"nan"``, ``"dropped-samples"``.
        count: how many samples or places.
        where: the channel and the first place.
        reason: why it was necessary, in words.
    """

    kind: str
    count: int
    where: str
    reason: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.count} ({self.where}): {self.reason}"


class _Rebuilt:
    """Pickled and copied as what it is made of: the copy is checked, and its arrays are read-only again."""

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        values = (getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]  # a dataclass
        return type(self), tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)


@dataclass(frozen=True)
class Provenance(_Rebuilt):
    """Where a trace came from: file, its SHA-256, the reader, and quantity -> column and unit."""

    file: str = ""
    sha256: str = ""
    reader: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))


@dataclass(frozen=True, eq=False, repr=False)
class Drive(_Rebuilt):
    """The load point's position against time, piecewise linear.

    Args:
        times: breakpoints, s, shape (k,), k >= 2, strictly increasing.
        positions: load-point positions there, m, shape (k,).

    Beyond its ends the drive goes on with the velocity of its first and last piece.

    Raises:
        InputError: fewer than two times, other than as many positions, times that do not increase, values that are not
            finite.

    Examples:
        A drive that is halted for a second:

        >>> from stickslip.data.trace import Drive
        >>> drive = Drive.from_pieces([4.0, 5.0, 9.0], [50e-6, 0.0, 50e-6])
        >>> drive
        Drive(from 0 s: 50 µm/s until 4 s, 0 m/s until 5 s, 50 µm/s until 9 s)
        >>> drive.holds(0.0, 9.0)
        [(4.0, 5.0)]
        >>> round(float(drive.position(7.0)), 9)  # m
        0.0003
    """

    times: Array
    positions: Array

    def __post_init__(self) -> None:
        times, positions = _frozen(self.times, "drive times"), _frozen(self.positions, "drive positions")
        if times.size < 2 or times.shape != positions.shape:
            what = "a drive needs at least two times and as many positions"
            raise InputError(what, value=(times.size, positions.size))
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(positions)) and np.all(np.diff(times) > 0)):
            raise InputError("the times of a drive must be finite and increase", hint="check the drive's 'until' times")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)

    def __repr__(self) -> str:
        ends, speeds = self.times[1:].tolist(), self.velocities.tolist()
        pieces = [f"{shown(v, 'm/s')} until {shown(end, 's')}" for v, end in zip(speeds[:5], ends[:5], strict=True)]
        if len(ends) > len(pieces):
            pieces.append(f"... {len(ends)} pieces until {shown(ends[-1], 's')}")
        return f"{type(self).__name__}(from {shown(float(self.times[0]), 's')}: {', '.join(pieces)})"

    @classmethod
    def constant(cls, velocity: float, start: float = 0.0, stop: float | None = None) -> Drive:
        """A drive at one velocity (m/s), at position zero at ``start`` (s)."""
        end = start + 1.0 if stop is None or stop <= start else stop
        return cls(np.array([start, end]), np.array([0.0, velocity * (end - start)]))

    @classmethod
    def from_pieces(cls, until: ArrayLike, velocities: ArrayLike, start: float = 0.0) -> Drive:
        """A drive of constant velocities (m/s), each lasting until a time (s), at position zero at ``start``."""
        ends, speeds = np.asarray(until, float), np.asarray(velocities, float)
        if ends.shape != speeds.shape or ends.ndim != 1 or ends.size == 0:
            raise InputError("every piece of a drive needs one end time and one velocity")
        times = np.concatenate([[start], ends])
        if not np.all(np.diff(times) > 0):
            raise InputError("the times of a drive must be finite and increase", hint="check the drive's 'until' times")
        return cls(times, np.concatenate([[0.0], np.cumsum(speeds * np.diff(times))]))

    @classmethod
    def from_samples(cls, time: ArrayLike, position: ArrayLike, tolerance: float) -> Drive:
        """Few straight pieces that stay within about ``tolerance`` (m) of sampled positions (never beyond its double).

        The "swinging door" of process historians: a piece is stretched as long as one slope serves all its
        samples, so a million samples of steady drive become one piece while ripple above the tolerance stays. Each
        piece ends at the mean of a few samples: one that ended at the tolerance's edge would make the next one short.
        """
        t, y = np.asarray(time, float), np.asarray(position, float)
        knots, values, n = [0], [float(y[0])], t.size
        while knots[-1] < n - 1:
            i = knots[-1]
            stop = _reach(t, y, i, values[-1], tolerance)
            near = min(3, stop - i - 1, n - 1 - stop)
            value = float(y[stop - near : stop + near + 1].mean())
            knots.append(stop)
            values.append(min(max(value, float(y[stop]) - tolerance), float(y[stop]) + tolerance))
        return cls(t[knots], np.array(values))

    @classmethod
    def sampled(
        cls, time: ArrayLike, position: ArrayLike, resolution: float = 0.0, noise: float | None = None
    ) -> Drive:
        """A drive from measured positions (m), straight within a few counts and what their noise (m) makes."""
        values = np.asarray(position, float)
        level = noise_level(values, resolution or None) if noise is None else noise
        return cls.from_samples(time, values, max(1.5 * resolution, 4 * level, 1e-9 * float(np.ptp(values)), 1e-15))

    @property
    def velocities(self) -> Array:
        """Velocity of each piece, m/s, shape (k - 1,)."""
        return np.diff(self.positions) / np.diff(self.times)

    def _piece(self, time: ArrayLike) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, self.times.size - 2)

    def velocity(self, time: ArrayLike) -> Array:
        """Load-point velocity, m/s, same shape as ``time``; at a breakpoint that of the piece it opens."""
        return self.velocities[self._piece(time)]

    def position(self, time: ArrayLike) -> Array:
        """Load-point position, m, same shape as ``time`` (s)."""
        t = np.asarray(time, float)
        if self.times.size == 2:  # one piece: no search through millions of samples
            speed = (self.positions[1] - self.positions[0]) / (self.times[1] - self.times[0])
            return np.asarray(self.positions[0] + speed * (t - self.times[0]))
        piece = self._piece(t)
        return self.positions[piece] + self.velocities[piece] * (t - self.times[piece])

    @property
    def breakpoints(self) -> Array:
        """Times (s) where the velocity changes, the two ends left out."""
        return self.times[1:-1]

    @property
    def speed(self) -> float:
        """Median over time of the speeds at which the drive moves, its holds left out, m/s."""
        lengths, speeds = np.diff(self.times), np.abs(self.velocities)
        moving = speeds > 0.05 * speeds.max(initial=0.0)
        if not moving.any():
            return 0.0
        order = np.argsort(speeds[moving])
        weight = np.cumsum(lengths[moving][order])
        return float(speeds[moving][order][np.searchsorted(weight, 0.5 * weight[-1])])

    def speeds(self, apart: float, share: float = 0.05) -> list[float]:
        """The speeds at which the drive moves for a share of the time that it moves (m/s), the least first.

        Args:
            apart: pieces whose speeds are closer than this factor count as one speed, their mean over time.
            share: of the time.
        """
        lengths, speeds = np.diff(self.times), np.abs(self.velocities)
        moving = np.flatnonzero(speeds > 0.05 * self.speed)
        moving = moving[np.argsort(speeds[moving])]
        edges = np.flatnonzero(speeds[moving][1:] > apart * speeds[moving][:-1]) + 1
        groups = [g for g in np.split(moving, edges) if lengths[g].sum() > share * lengths[moving].sum()]
        return [float(np.average(speeds[g], weights=lengths[g])) for g in groups]

    def holds(self, start: float, stop: float, fraction: float = 0.05) -> list[tuple[float, float]]:
        """Stretches (s, s) within [start, stop] where the drive is slower than ``fraction`` of its usual speed."""
        limit = fraction * self.speed
        if limit == 0:
            return [(start, stop)]
        slow = np.abs(self.velocities) < limit
        edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(np.int8)))
        found = []
        for first, last in edges.reshape(-1, 2):
            a = start if first == 0 else max(start, self.times[first])
            b = stop if last == slow.size else min(stop, self.times[last])
            if b > a:
                found.append((float(a), float(b)))
        return found


def _reach(t: Array, y: Array, i: int, anchor: float, tolerance: float) -> int:
    """Last index that one line from ``anchor`` at sample ``i`` reaches within the tolerance."""
    low, high, j, chunk = -np.inf, np.inf, i + 1, 64
    while j < t.size:
        part = slice(j, min(j + chunk, t.size))
        dt = t[part] - t[i]
        lows = np.maximum.accumulate(np.maximum((y[part] - tolerance - anchor) / dt, low))
        highs = np.minimum.accumulate(np.minimum((y[part] + tolerance - anchor) / dt, high))
        bad = np.flatnonzero(lows > highs)
        if bad.size:
            return max(j + int(bad[0]) - 1, i + 1)
        low, high, j, chunk = float(lows[-1]), float(highs[-1]), part.stop, min(2 * chunk, 1 << 20)
    return t.size - 1


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Shown, _Rebuilt):
    """A run in SI units; every array read-only, shape (n,).

    Args:
        name: unique within its campaign.
        time: s, strictly increasing.
        displacement, velocity, spring_force: of the block in m, m/s, N; at least one.
        drive: the load point, if known.
        drive_position: the measured load point, m, if there is a channel.
        normal_load: N, if measured.
        resolution: one count of the leading signal, in its unit.
        noise: standard deviation of one sample of the leading signal, in its unit.
        walk: random walk of the displacement, m/sqrt(s), where somebody stated it.
        hum: amplitude of the displacement's error at the mains frequency, m, where somebody stated it.
        spring_stiffness: N/m, where this run's spring is known.
        force_scale: measured over true force of the spring (1), with which a displacement not measured was made.
        virgin: whether the run starts from a freshly set down, never loaded contact.
        role: ``"train"``, ``"held-out"`` or ``""`` (undecided).
        minimum_slip: m, the smallest slip that counts as an event, where somebody stated it.
        missing: times (s) of the last sample before each gap in the record.
        repairs, warnings, provenance: what was mended, what looks odd, where it came from.

    Raises:
        InputError: no signal, lengths that differ, time that does not increase, values that are not finite, a role that
            is none, a size that is no number in SI.
    """

    name: str
    time: Array
    displacement: Array | None = None
    velocity: Array | None = None
    spring_force: Array | None = None
    drive: Drive | None = None
    drive_position: Array | None = None
    normal_load: Array | None = None
    resolution: float | None = None
    noise: float | None = None
    walk: float = 0.0
    hum: float = 0.0
    spring_stiffness: float | None = None
    force_scale: float | None = None
    virgin: bool = False
    role: str = ""
    minimum_slip: float | None = None
    missing: tuple[float, ...] = ()
    repairs: tuple[Repair, ...] = ()
    warnings: tuple[str, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        time = _frozen(self.time, f"{self.name}: time")
        if time.size < 2:
            raise InputError(f"trace '{self.name}' has {time.size} samples", allowed="at least 2")
        # one pass without a copy of the differences: long records must fit in memory
        if not (time[1:] > time[:-1]).all():
            row = int(np.flatnonzero(~(time[1:] > time[:-1]))[0]) + 1
            raise InputError(f"trace '{self.name}': time does not increase at sample {row}", value=float(time[row]))
        object.__setattr__(self, "time", time)
        if all(getattr(self, name) is None for name in SIGNALS):
            raise InputError(f"trace '{self.name}' has no signal", allowed="displacement, velocity or spring_force")
        for name, values in self.channels.items():
            array = _frozen(values, f"{self.name}: {name}")
            if array.shape != time.shape:
                raise InputError(f"trace '{self.name}': {name} has {array.size} samples, time has {time.size}")
            if not np.isfinite(array).all():
                raise InputError(f"trace '{self.name}': {name} holds values that are not finite")
            object.__setattr__(self, name, array)
        if self.role not in ROLES:
            what, allowed = f"trace '{self.name}': there is no such role", '"train", "held-out", or "" for undecided'
            raise InputError(what, key="role", value=self.role, allowed=allowed)
        for name in SIZES:
            value = getattr(self, name)
            if value is not None and (isinstance(value, str) or not 0.0 <= value < math.inf):
                what = f"trace '{self.name}': {name} is not possible"
                raise InputError(what, key=name, value=value, allowed="a number in SI, 0 or more; None: not known")

    @classmethod
    def from_arrays(
        cls, name: str = "run", *, time: Any = None, displacement: Any = None, velocity: Any = None,
        spring_force: Any = None, drive_velocity: float | str | None = None, drive_position: Any = None,
        drive: Sequence[tuple[float | str, float | str]] | None = None, resolution: float | str | None = None,
        noise: float | str | None = None, spring_stiffness: float | str | None = None, virgin: bool = False,
        role: str = "",
    ) -> Trace:  # fmt: skip
        """A run from arrays, without a file.

        Args:
            name: unique within its campaign.
            time: s, shape (n,). Arrays, lists, pandas Series and xarray DataArrays are taken; those of xarray may have
                ``attrs["units"]``, all others are in SI. Default the index of the first signal that is a Series (but
                not one that only counts samples), or its coordinate if it is a DataArray; dates count from the first.
            displacement, velocity, spring_force: of the block (m, m/s, N), shape (n,); at least one.
            drive_velocity: of the load point, a number in m/s or text such as ``"50 um/s"``; or
            drive: until when and how fast, piece by piece: ``[("4.3 s", "100 um/s"), ("5.3 s", 0), ...]``; or
            drive_position: the measured load point (m), shape (n,).
            resolution, noise: one count, and the standard deviation of one sample, of the leading signal; default what
                the record itself shows.
            spring_stiffness: N/m or text, where this run's spring is known.
            virgin, role: as of the class.

        Raises:
            InputError: no signal, no times, lengths that differ, times that do not increase, values that are not
                finite, two ways of giving the drive, a unit that cannot be read, a role that is none.

        Examples:
            >>> import numpy as np
            >>> import stickslip as ss
            >>> t = np.arange(0.0, 2.0, 1e-3)
            >>> x = 1e-5 * np.floor(2.0 * t)
            >>> ss.Trace.from_arrays("v050", time=t, displacement=x, drive_velocity="20 um/s", noise="8 nm")
            <Trace>
            <BLANKLINE>
            run: v050; samples: 2000; length: 1.999 s; sampling: 1 kHz; drive: 20 µm/s
            <BLANKLINE>
            displacement: 0 m to 30 µm
        """
        given = {"displacement": displacement, "velocity": velocity, "spring_force": spring_force}
        arrays: dict[str, Any] = {
            key: _si_array(v, SIGNALS[key], f"{name}: {key}") for key, v in given.items() if v is not None
        }
        t = _si_array(_times(given) if time is None else time, "s", f"{name}: time")
        if sum(way is not None for way in (drive_velocity, drive_position, drive)) > 1:
            hint = "keep one of drive_velocity, drive_position, drive"
            raise InputError(f"trace '{name}': the drive is given more than once", hint=hint)
        if not arrays:
            raise InputError(f"trace '{name}' has no signal", allowed="displacement, velocity or spring_force")
        leading = next(key for key in SIGNALS if key in arrays)

        def known(value: float | str | None, unit: str, key: str) -> float | None:
            return None if value is None else to_si(value, unit, key=f"{name}: {key}")

        count = known(resolution, SIGNALS[leading], "resolution")
        count = estimate_resolution(arrays[leading]) if count is None else count
        level = known(noise, SIGNALS[leading], "noise")
        level = noise_level(arrays[leading], count) if level is None else level
        speed = known(drive_velocity, "m/s", "drive_velocity")
        motion = None if speed is None else Drive.constant(speed, float(t[0]), float(t[-1]))
        if drive is not None:
            until = [to_si(end, "s", key=f"{name}: drive") for end, _ in drive]
            motion = Drive.from_pieces(until, [to_si(v, "m/s", key=f"{name}: drive") for _, v in drive], float(t[0]))
        if drive_position is not None:
            arrays["drive_position"] = position = _si_array(drive_position, "m", f"{name}: drive_position")
            motion = Drive.sampled(t, position)
        digest = hashlib.sha256(t.tobytes())
        for key, values in arrays.items():
            digest.update(key.encode() + values.tobytes())
        return cls(
            name, t, **arrays, drive=motion, resolution=count, noise=level, virgin=virgin, role=role,
            spring_stiffness=known(spring_stiffness, "N/m", "spring_stiffness"),
            provenance=Provenance("", digest.hexdigest(), "arrays"),
        )  # fmt: skip

    @property
    def leading(self) -> str:
        """Name of the measured signal that tells events best (displacement, else velocity, else force)."""
        return next(name for name in SIGNALS if getattr(self, name) is not None)

    @property
    def channels(self) -> dict[str, Array]:
        """Every channel that is there, by name, SI, each of shape (n,)."""
        return {name: values for name in CHANNELS if (values := getattr(self, name)) is not None}

    @property
    def signal(self) -> Array:
        """The leading signal, SI, shape (n,)."""
        return getattr(self, self.leading)

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def sampling_rate(self) -> float:
        """Mean sampling rate, Hz."""
        return (self.time.size - 1) / self.duration

    @property
    def drive_velocity(self) -> float | None:
        """The drive's usual speed, m/s, or None where no drive is known."""
        return None if self.drive is None else self.drive.speed

    def replace(self, **changes: object) -> Trace:
        """A copy with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def to_xarray(self) -> xarray.Dataset:
        """Every channel, and the load point of the drive, over ``time`` (s); SI units in ``attrs["units"]``.

        :meth:`from_arrays` takes its variables back; its own ``to_dataframe`` and ``to_netcdf`` make tables and files.
        No array is copied, so none can be changed.
        """
        import xarray

        known = {name: ("time", values, {"units": CHANNELS[name]}) for name, values in self.channels.items()}
        if self.drive is not None:
            known["load_point"] = ("time", self.drive.position(self.time), {"units": "m"})
        return xarray.Dataset(known, coords={"time": ("time", self.time, {"units": "s"})}, attrs={"title": self.name})

    def between(self, start: float | str | None = None, stop: float | str | None = None) -> Trace:
        """The part of the record from ``start`` to ``stop`` (s or text), both included; times stay what they are.

        It counts as virgin only where nothing is left out at its beginning. What was left out is among its repairs.

        Raises:
            InputError: less than two samples are left.
        """
        first = 0 if start is None else int(np.searchsorted(self.time, to_si(start, "s", key="start")))
        end = float(self.time[-1]) if stop is None else to_si(stop, "s", key="stop")
        last = int(np.searchsorted(self.time, end, side="right"))
        if last - first < 2:
            allowed = f"{shown(float(self.time[0]), 's')} to {shown(float(self.time[-1]), 's')}"
            what = f"trace '{self.name}': less than two samples are left"
            raise InputError(what, key="start, stop", value=(start, stop), allowed=allowed)
        if last - first == self.time.size:
            return self
        cut = Repair("cut", self.time.size - (last - first), "all channels", "outside of what was asked for")
        time = self.time[first:last]
        return self.replace(
            **{name: values[first:last] for name, values in self.channels.items()},
            time=time, virgin=self.virgin and first == 0, repairs=(*self.repairs, cut),
            missing=tuple(t for t in self.missing if time[0] <= t < time[-1]),
        )  # fmt: skip

    def coarsened(self, rate: float | str) -> Trace:
        """The record at a lower sampling rate: means of as many samples as come nearest to it.

        The mean is the low-pass before the thinning. Unlike a sharp filter it does not ring where the block slips, and
        noise that is independent from sample to sample stays so. Means of time go with means of values. No mean reaches
        over a gap; samples before a gap, and at the end, that are too few for one are left out.

        ``noise`` becomes that of a mean of white noise and of rounding to counts, ``resolution`` the step between means
        of counts, ``hum`` what a mean leaves of it. Counts that noise does not blur are best left as they are: a fit
        corrects their rounding, but not that of their means. The trace's warnings say where it is so.

        Args:
            rate: at most the record's own (Hz or text). A slip, and each period of the ringing after it, needs some
                samples.

        Raises:
            InputError: the rate is not positive or above that of the record, a unit that cannot be read, less than two
                means, or means already.

        Examples:
            >>> import stickslip as ss
            >>> trace = ss.load_example()["v050"]
            >>> coarse = trace.coarsened("2 kHz")
            >>> print(coarse.repairs[-1])
            coarsened: 113680 (all channels): means of 5 samples, 10 kHz to 2 kHz
        """
        step = float(np.median(np.diff(self.time[:200_001])))
        wanted = to_si(rate, "Hz", key="rate")
        if not 0.0 < wanted <= 1.001 / step:
            allowed = f"above 0 Hz, up to {shown(1.0 / step, 'Hz')}"
            raise InputError(f"trace '{self.name}': no coarser sampling", key="rate", value=rate, allowed=allowed)
        size = round(1.0 / (wanted * step))
        if size == 1:
            return self
        if any(r.kind == COARSENED for r in self.repairs):
            what = f"trace '{self.name}' is coarsened already: what rounding leaves of its means is not known any more"
            raise InputError(what, key="rate", value=rate, hint="coarsen the record itself, at once")
        edges = [0, *np.searchsorted(self.time, self.missing, side="right").tolist(), self.time.size]
        numbers = [(stop - start) // size for start, stop in pairwise(edges)]  # of means between gaps
        if sum(numbers) < 2:
            raise InputError(f"trace '{self.name}': less than two means of {size} samples", key="rate", value=rate)

        def means(values: Array) -> Array:
            parts = [values[a : a + size * n].reshape(n, size) for a, n in zip(edges[:-1], numbers, strict=True)]
            return np.concatenate([part.mean(axis=1) for part in parts])

        time = means(self.time)
        last = np.unique(np.cumsum(numbers)) - 1
        noise, rounded = self._noise_of_mean(size)
        warning = (
            f"counts that noise hardly blurs: means of {size} keep their rounding, which a fit can no longer correct"
        )
        lost, rates = self.time.size - time.size, f"{shown(1.0 / step, 'Hz')} to {shown(1.0 / (size * step), 'Hz')}"
        note = Repair(COARSENED, lost, "all channels", f"means of {size} samples, {rates}")
        return self.replace(
            **{name: means(values) for name, values in self.channels.items()}, time=time, noise=noise,
            resolution=None if self.resolution is None else self.resolution / size,
            hum=self.hum * max(abs(float(np.sinc(f * size * step))) for f in MAINS),
            missing=tuple(time[last[(last >= 0) & (last < time.size - 1)]].tolist()),
            repairs=(*self.repairs, note), warnings=(*self.warnings, *([warning] if rounded else [])),
        )  # fmt: skip

    def _noise_of_mean(self, size: int) -> tuple[float | None, bool]:
        """Noise of the mean of so many samples, and whether most of it is rounding, an error common to all of them."""
        if self.noise is None:
            return None, False
        whole, rounding, count = self.noise**2, 0.0, self.resolution
        if count:
            spread = math.sqrt(max(whole - count**2 / 12.0, 0.0))
            rounding = min(float(rounding_of_mean(np.zeros(()), count, spread)), whole)
        return math.sqrt((whole - rounding) / size + rounding), 2.0 * rounding > whole

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that a fit takes of the trace; equal traces have the same."""
        found = hashlib.sha256()
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Drive):
                value = np.stack([value.times, value.positions])
            if f.name not in ("name", "repairs", "warnings", "provenance"):
                found.update(f.name.encode())
                if f.name in SIZES and value is not None:
                    value = float(value)
                found.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
        return found.hexdigest()

    def _parts(self) -> list[str]:
        speed, spring = self.drive_velocity, self.spring_stiffness
        what = {
            "run": self.name,
            "samples": self.time.size,
            "length": shown(self.duration, "s"),
            "sampling": shown(self.sampling_rate, "Hz"),
            "drive": None if speed is None else shown(speed, "m/s"),
            "spring": None if spring is None else shown(spring, "N/m"),
            "contact": "virgin" if self.virgin else None,
            "role": self.role,
        }
        ranges = {name: ends(values, CHANNELS[name]) for name, values in self.channels.items()}
        return [facts(what), facts(ranges), *map(str, self.repairs), *self.warnings]


def _times(signals: Mapping[str, Any]) -> Any:
    """Times that the first of the signals carries: of dates the seconds since the first one."""
    first: Any = next((values for values in signals.values() if values is not None), None)
    found: Any = None
    if hasattr(first, "coords"):
        found = next((first.coords[dim] for dim in first.dims if dim in first.coords), None)
    elif hasattr(first, "index") and hasattr(first, "iloc") and type(first.index).__name__ != "RangeIndex":
        found = first.index
    if found is None:
        hint = "give time, a Series with times as its index, or a DataArray with a coordinate of times"
        raise InputError("no times are given", key="time", hint=hint)
    if found.dtype.kind in "mM":
        moments = np.asarray(found)
        found = (moments - moments[0]) / np.timedelta64(1, "s")
    return found


def _si_array(values: Any, unit: str, what: str) -> Array:
    """Values as an array of its own in the SI ``unit``; text in ``attrs["units"]`` says another unit of theirs."""
    written = getattr(values, "attrs", {}).get("units")
    factor = 1.0 if written is None else factor_to_si(str(written), unit, key=what)
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} holds no numbers ({error})") from None
    return array * factor


def _frozen(values: ArrayLike, what: str) -> Array:
    """A read-only float view; copies only what someone else could still write to."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(f"{what} must be one-dimensional", value=array.shape)
    if array.flags.writeable:
        array = array.copy() if array.base is not None or array is values else array
        array.flags.writeable = False
    return array
