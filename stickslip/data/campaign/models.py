"""What may stand in a campaign file: one rig, and a table for each trace."""

from __future__ import annotations

from itertools import pairwise
from pathlib import PurePath
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from ...errors import InputError
from ...system.units import factor_to_si, to_si
from ..channels import SIGNALS
from .fields import Unmeasured, faults, quantity

Measured = float | Unmeasured
CHANNELS = (*SIGNALS, "normal_load", "drive_position")  # keys of a trace that are channels


@faults()
def _column(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (str, int)) or value == "":
        raise InputError("not a column", value=value, allowed="its name in the file, or its number from 1")
    return value


Column = Annotated[str | int, BeforeValidator(_column)]


class Model(BaseModel):
    """Base of all tables: unknown keys are errors, nothing changes after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)


class RigKeys(Model):
    """What is known of the apparatus, SI; None where nothing is known. A trace may give any of these anew."""

    mass: Annotated[Measured | None, quantity("kg", above=0, unmeasured=True)] = None
    spring_stiffness: Annotated[Measured | None, quantity("N/m", above=0, unmeasured=True)] = None
    contacts: Annotated[int, Field(ge=1, le=10000)] | None = None
    normal_force: Annotated[Measured | None, quantity("N", above=0, unmeasured=True)] = None
    friction_coefficient: Annotated[Measured | None, quantity("1", above=0, most=5, unmeasured=True)] = None
    youngs_modulus: Annotated[Measured | None, quantity("Pa", above=0, unmeasured=True)] = None
    poisson_ratio: Annotated[Measured | None, quantity("1", above=-1, below=0.5, unmeasured=True)] = None
    line_length: Annotated[Measured | None, quantity("m", above=0, unmeasured=True)] = None
    springs: Annotated[int, Field(ge=16, le=10_000_000)] | None = None
    temperature: Annotated[float | None, quantity("K", above=0)] = None
    note: str = ""


class Rig(RigKeys):
    """The apparatus: mass of the block (kg), spring (N/m), contacts, normal force of one contact (N), material.

    ``H`` and ``h_rms`` are the roughness of the line of ``line_length`` and ``springs``, where somebody measured it.
    """

    H: Annotated[Measured | None, quantity("1", above=0, below=1, unmeasured=True)] = None
    h_rms: Annotated[Measured | None, quantity("m", above=0, unmeasured=True)] = None


MOST_SLOW = 1e-3  # of a sensor's walk and hum (SI); above it is a slip of the pen
LEAST_SIZE = 1e-18  # of a count or a counter's range (SI); below it is a slip of the pen


class _Scaled(Model):
    """A column with a unit; ``factor`` turns it into SI (None: the file's own header must say the unit)."""

    si: ClassVar[str] = "1"
    column: Column
    unit: str | None = None

    @field_validator("unit")
    @classmethod
    @faults()
    def _known(cls, value: str | None) -> str | None:
        if value is not None:
            factor_to_si(value, cls.si)
        return value

    @property
    def factor(self) -> float | None:
        """SI value of one, or None."""
        return None if self.unit is None else factor_to_si(self.unit, self.si)


class TimeColumn(_Scaled):
    """Column of times."""

    si: ClassVar[str] = "s"


class Channel(_Scaled):
    """A measured channel.

    Keys: column, unit, resolution (one count), wrap (range of a counter), resets (true, or the times at which the
    counter was cleared), and for a channel of another file: file, time, reader.
    """

    resolution: float | None = None
    wrap: float | None = None
    resets: bool | list[float] = False
    file: str | None = None
    time: TimeColumn | None = None
    reader: str | None = None

    @field_validator("resolution", "wrap", mode="before")
    @classmethod
    @faults()
    def _size(cls, value: Any) -> float | None:
        number = None if value is None else to_si(value, cls.si)
        if number is not None and number < LEAST_SIZE:
            raise InputError("out of range", value=value, allowed=f"at least {LEAST_SIZE:g} {cls.si}")
        return number

    @field_validator("resets", mode="before")
    @classmethod
    @faults()
    def _times(cls, value: Any) -> Any:
        if isinstance(value, bool):
            return value
        if not isinstance(value, list):
            raise InputError("not a list of times", value=value, allowed='true, or such as ["2.3 s", "5.1 s"]')
        return [to_si(moment, "s") for moment in value]


class DisplacementChannel(Channel):
    """Position of the block.

    Keys beside those of a channel, for what the record itself does not tell from creep: walk (random walk of the
    reading, m/sqrt(s)) and hum (amplitude at the mains frequency). A record of the block at rest tells both.
    """

    si: ClassVar[str] = "m"
    walk: float = 0.0
    hum: float = 0.0

    @field_validator("walk", "hum", mode="before")
    @classmethod
    @faults()
    def _slow(cls, value: Any, info: ValidationInfo) -> float:
        number = to_si(value, "m/s**0.5" if info.field_name == "walk" else "m")
        if not 0.0 <= number < MOST_SLOW:
            raise InputError("out of range", value=value, allowed=f"0 to {MOST_SLOW:g}, SI")
        return number


class VelocityChannel(Channel):
    """Velocity of the block."""

    si: ClassVar[str] = "m/s"


class ForceChannel(Channel):
    """Force of the drive spring, or normal load."""

    si: ClassVar[str] = "N"


class DrivePiece(Model):
    """The drive at one velocity until a time of the record."""

    until: Annotated[float, quantity("s")]
    velocity: Annotated[float, quantity("m/s")]


class TraceEntry(RigKeys):
    """One run: its file, its channels, its drive."""

    file: str = Field(min_length=1)
    name: str = ""
    reader: str | None = None
    outside: bool = False
    time: TimeColumn | None = None
    sampling_rate: Annotated[float | None, quantity("Hz", least=1e-9)] = None
    clock_error: Annotated[float, quantity("1", above=-0.01, below=0.01)] = 0.0
    start: Annotated[float | None, quantity("s")] = None
    stop: Annotated[float | None, quantity("s")] = None
    displacement: DisplacementChannel | None = None
    velocity: VelocityChannel | None = None
    spring_force: ForceChannel | None = None
    normal_load: ForceChannel | None = None
    drive_velocity: Annotated[float | None, quantity("m/s")] = None
    drive_position: DisplacementChannel | None = None
    drive: Annotated[list[DrivePiece], Field(min_length=1)] | None = None
    virgin: bool = False
    role: Literal["train", "held-out"] | None = None
    spikes: bool = True
    minimum_slip: Annotated[float | None, quantity("m", above=0)] = None

    @model_validator(mode="after")
    @faults()
    def _complete(self) -> TraceEntry:
        if (self.time is None) == (self.sampling_rate is None):
            given = "neither {} nor {} is given" if self.time is None else "both {} and {} are given"
            what = given.format("'time'", "'sampling_rate'")
            raise InputError(what, hint='write  time = { column = "...", unit = "s" }  or  sampling_rate = "10 kHz"')
        if self.displacement is None and self.velocity is None and self.spring_force is None:
            allowed = "at least one of displacement, velocity, spring_force"
            hint = 'write such as  displacement = { column = "x", unit = "um" }'
            raise InputError("no signal is given", allowed=allowed, hint=hint)
        drives = [key for key in ("drive_velocity", "drive_position", "drive") if getattr(self, key) is not None]
        if len(drives) > 1:
            raise InputError(f"the drive is given more than once: {', '.join(drives)}", hint="keep one of them")
        if not drives and self.spring_force is None:
            allowed = "drive_velocity, drive_position or drive (may be left out only where spring_force is measured)"
            hint = 'write such as  drive_velocity = "0.05 mm/s"'
            raise InputError("the drive is not given", allowed=allowed, hint=hint)
        if self.drive is not None:
            ends = [piece.until for piece in self.drive]
            if any(b <= a for a, b in pairwise(ends)):
                raise InputError("the 'until' times of the drive do not increase", value=ends, hint="sort the pieces")
        if self.start is not None and self.stop is not None and self.stop <= self.start:
            raise InputError("'stop' is not after 'start'", value=f"start {self.start:g} s, stop {self.stop:g} s")
        return self

    @property
    def label(self) -> str:
        """The trace's name: ``name``, or the file's name without its ending."""
        return self.name or PurePath(self.file).stem


class CampaignFile(Model):
    """The whole file."""

    schema_version: Literal[1] = Field(alias="schema")
    title: str = ""
    note: str = ""
    rig: Rig = Rig()
    trace: Annotated[list[TraceEntry], Field(min_length=1)]
