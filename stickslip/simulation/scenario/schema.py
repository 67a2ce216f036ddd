"""What may stand in a scenario file: the rig, its drive, its contacts, what else acts, and what is written."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, create_model, model_validator

from ...data.campaign.fields import faults, quantity
from ...errors import InputError, nearest
from .contact_tables import CONTACTS, ContactTable, Table


class BlockTable(Table):
    """The moving body and its spring."""

    mass: Annotated[float, quantity("kg", above=0, most=1e6)]
    spring_stiffness: Annotated[float, quantity("N/m", above=0, most=1e9)]
    damping: Annotated[float, quantity("N s/m", least=0, most=1e6)] = 10.0


class Piece(Table):
    """The drive at one velocity for a while; zero is a hold."""

    velocity: Annotated[float, quantity("m/s", least=-10, most=10)]
    duration: Annotated[float, quantity("s", above=0)]


class Column(Table):
    """A column of a file, by name or number from 1, and its unit."""

    column: str | int
    unit: str | None = None


class DriveTable(Table):
    """How the load point moves: one velocity, pieces, or sampled positions from a file."""

    velocity: Annotated[float | None, quantity("m/s", least=-10, most=10)] = None
    duration: Annotated[float | None, quantity("s", above=0)] = None
    events: Annotated[int, Field(ge=1, le=100_000)] | None = None
    piece: Annotated[list[Piece], Field(min_length=1)] | None = None
    file: str | None = None
    time: Column = Column(column="time", unit="s")
    position: Column | None = None
    tolerance: Annotated[float, quantity("m", above=0)] = 1e-9
    start: Literal["rest", "steady"] = "rest"

    @model_validator(mode="after")
    @faults()
    def _one_kind(self) -> Self:
        given = [key for key in ("velocity", "piece", "file") if getattr(self, key) is not None]
        if len(given) != 1:
            what = "the drive is not given" if not given else f"the drive is given more than once: {', '.join(given)}"
            raise InputError(what, allowed="one of velocity, piece, file", hint='velocity = "50 um/s"')
        if self.velocity is None and self.events is not None:
            raise InputError("'events' needs a drive of one velocity", hint="remove 'events'")
        if self.velocity is not None and (self.duration is None) == (self.events is None):
            what = "neither 'duration' nor 'events' is given" if self.events is None else "both 'duration' and 'events'"
            raise InputError(what, hint='write  duration = "14 s"  or  events = 5')
        if self.velocity == 0.0 and self.events is not None:
            raise InputError("without drive motion there is no slip", hint="give 'duration' instead")
        if self.piece is not None and self.duration is not None:
            raise InputError("every piece has its own duration", hint="remove 'duration' of [drive]")
        if self.file is not None and self.position is None:
            raise InputError("'position' is missing", hint='position = { column = "drive", unit = "um" }')
        return self


class WeakeningTable(Table):
    """The base law of friction."""

    ratio: Annotated[float, quantity("1", least=0, most=1)] = 0.85
    slip_distance: Annotated[float, quantity("m", least=1e-10, most=1e-2)] = 1e-6
    healing_time: Annotated[float, quantity("s", least=1e-6, most=1e4)] = 0.02


class SensorTable(Table):
    """The vibrometer; keys as of `ss.Vibrometer`. Whatever is not given is off, but for the counts."""

    resolution: Annotated[float, quantity("m", least=0, most=1e-3)] = 7.91e-9
    counter_steps: Annotated[int, Field(ge=0, le=2**40)] = 0
    clear_at_arrest: bool = False
    gain: Annotated[float, quantity("1", above=-1, most=1)] = 0.0
    interpolation_error: Annotated[float, quantity("m", least=0, most=1e-6)] = 0.0
    delay: Annotated[float, quantity("s", least=0, most=1)] = 0.0
    low_pass: Annotated[float, quantity("s", least=0, most=10)] = 0.0
    high_pass: Annotated[float, quantity("Hz", least=0, most=1e6)] = 0.0
    drift: Annotated[float, quantity("m/s", least=-1e-3, most=1e-3)] = 0.0
    random_walk: Annotated[float, quantity("m/s**0.5", least=0, most=1e-3)] = 0.0
    white: Annotated[float, quantity("m/Hz**0.5", least=0, most=1e-3)] = 0.0
    flicker: Annotated[float, quantity("m", least=0, most=1e-3)] = 0.0
    mains: Annotated[float, quantity("m", least=0, most=1e-3)] = 0.0
    mains_frequency: Annotated[float, quantity("Hz", above=0, most=1e6)] = 50.0
    speckle_rate: Annotated[float, quantity("1/m", least=0, most=1e9)] = 0.0
    speckle_jump: Annotated[float, quantity("m", least=0, most=1e-3)] = 3e-8
    dropout_rate: Annotated[float, quantity("1/m", least=0, most=1e9)] = 0.0
    dropout_time: Annotated[float, quantity("s", above=0, most=10)] = 1e-3
    clock_error: Annotated[float, quantity("1", above=-0.01, below=0.01)] = 0.0
    dither: bool = False
    seed: Annotated[int, Field(ge=0)] = 0


class SolverTable(Table):
    """Error allowed in a step (see `stickslip.simulation.solve.Tolerance`) and the longest step.

    The defaults keep the recurrence to 2e-5 of itself and creep to 0.3 nm on the paper's rig.
    """

    relative: Annotated[float, quantity("1", above=0, most=1)] = 3e-5
    displacement: Annotated[float, quantity("m", above=0, most=1e-6)] = 1e-12
    velocity: Annotated[float, quantity("m/s", above=0, most=1e-3)] = 1e-8
    largest_step: Annotated[float, quantity("s", above=0, most=100)] = 0.05


Channel = Literal["displacement", "velocity", "spring_force", "drive_position"]
ENDINGS = (".csv", ".nc", ".mat", ".uff")


class OutputTable(Table):
    """What is written besides pictures and numbers."""

    sampling_rate: Annotated[float, quantity("Hz", above=0, most=1e8)] = 10_000.0
    trace: str | None = None
    channels: Annotated[list[Channel], Field(min_length=1)] = ["displacement"]

    @model_validator(mode="after")
    @faults()
    def _plain_name(self) -> Self:
        if self.trace is None:
            return self
        if "/" in self.trace or "\\" in self.trace or self.trace.startswith("."):
            raise InputError("'trace' is a file name in the run folder, without folders", value=self.trace)
        if not self.trace.isprintable():
            raise InputError("'trace' is no name of a file", value=self.trace)
        if not self.trace.lower().endswith(ENDINGS) or self.trace.lower() == "arrays.nc":
            allowed = f"a name with {' '.join(ENDINGS)}"
            raise InputError("unknown ending of the trace", value=self.trace, allowed=allowed)
        if set(self.channels) == {"drive_position"}:
            raise InputError("a trace needs a signal besides the drive", value=self.channels)
        return self


class SweepTable(Table):
    """One key of the scenario taken through a series of values."""

    key: str
    start: float | str | None = None
    stop: float | str | None = None
    points: Annotated[int, Field(ge=2, le=10_000)] | None = None
    values: Annotated[list[float | str], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    @faults()
    def _either(self) -> Self:
        span = [self.start is not None, self.stop is not None, self.points is not None]
        if (self.values is None) == (not all(span)) or (self.values is not None and any(span)):
            hint = 'start = "20 um/s"; stop = "1 mm/s"'
            raise InputError("a series needs start, stop and points, or values", hint=hint)
        return self


class EffectEntry(BaseModel):
    """One effect of the catalogue: its type, and its parameters under their own names."""

    model_config = ConfigDict(extra="allow", frozen=True)

    type: str = Field(min_length=1)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters as written."""
        return dict(self.model_extra or {})


class ScenarioFile(Table):
    """The whole file; ``contact`` becomes the table of its kind."""

    schema_version: Literal[1] = Field(alias="schema")
    title: str = ""
    note: str = ""
    block: BlockTable
    drive: DriveTable
    contact: ContactTable
    weakening: WeakeningTable = WeakeningTable()
    effect: list[EffectEntry] = []
    sensor: SensorTable | None = None
    solver: SolverTable = SolverTable()
    output: OutputTable = OutputTable()
    sweep: SweepTable | None = None


@cache
def _file_of(kind: str) -> type[ScenarioFile]:
    """The model of files with contacts of one kind (made when it is needed: all of them take a tenth of a second)."""
    return create_model(f"ScenarioFile_{kind}", __base__=ScenarioFile, contact=(CONTACTS[kind], ...))


def file_model(content: dict[str, Any]) -> type[ScenarioFile]:
    """The model that fits the kind of contact a file names.

    Raises:
        InputError: the kind is unknown.
    """
    contact = content.get("contact")
    if not isinstance(contact, dict) or "kind" not in contact:
        return ScenarioFile
    kind = contact["kind"]
    if not isinstance(kind, str) or kind not in CONTACTS:
        raise InputError("unknown kind of contact", key="contact.kind", value=kind, hint=nearest(str(kind), CONTACTS))
    return _file_of(kind)
