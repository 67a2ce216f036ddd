"""One measured (or simulated) run: SI arrays that nobody can change, where they came from and what was mended."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..system.object_repr import Shown, facts
from ..system.units import ends, shown, to_si
from .channels import CHANNELS, SIGNALS
from .coarsening import COARSENED, Means, hum_of_mean, noise_of_mean
from .drive import Drive
from .from_arrays import trace_fields
from .provenance import Provenance, Repair
from .read_only import Rebuilt, read_only

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
ROLES = ("", "train", "held-out")
SIZES = ("resolution", "noise", "walk", "hum", "spring_stiffness", "minimum_slip")  # of a trace: numbers, not negative


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Shown, Rebuilt):
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
        time = read_only(self.time, f"{self.name}: time")
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
            array = read_only(values, f"{self.name}: {name}")
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
        found = trace_fields(
            name, time, given, drive_velocity, drive_position, drive, resolution, noise, spring_stiffness
        )
        return cls(name, **found, virgin=virgin, role=role)

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
        means = Means(self.time, self.missing, size)
        if len(means) < 2:
            raise InputError(f"trace '{self.name}': less than two means of {size} samples", key="rate", value=rate)
        time = means(self.time)
        noise, rounded = noise_of_mean(self.noise, self.resolution, size)
        warning = (
            f"counts that noise hardly blurs: means of {size} keep their rounding, which a fit can no longer correct"
        )
        lost, rates = self.time.size - time.size, f"{shown(1.0 / step, 'Hz')} to {shown(1.0 / (size * step), 'Hz')}"
        note = Repair(COARSENED, lost, "all channels", f"means of {size} samples, {rates}")
        return self.replace(
            **{name: means(values) for name, values in self.channels.items()}, time=time, noise=noise,
            resolution=None if self.resolution is None else self.resolution / size,
            hum=hum_of_mean(self.hum, size * step), missing=tuple(time[means.before_gaps].tolist()),
            repairs=(*self.repairs, note), warnings=(*self.warnings, *([warning] if rounded else [])),
        )  # fmt: skip

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
