"""What may stand in ``[contact]``, one table for every kind of contact."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ...data.campaign.fields import faults, quantity
from ...errors import InputError

FORCE = quantity("N", above=0)
FRICTION = quantity("1", above=0, most=10)
LENGTH = quantity("m", above=0)
HURST = quantity("1", above=0, below=1)
EXPONENT = quantity("1", above=1, most=100)
SLOPE = quantity("1", above=0)


class Table(BaseModel):
    """Base of all tables: unknown keys are errors, nothing changes after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Each(Table):
    """One contact that differs from the others."""

    normal_force: Annotated[float | None, FORCE] = None
    friction_coefficient: Annotated[float | None, FRICTION] = None


class ContactTable(Table):
    """What all kinds share. ``each`` holds one table for every contact where they differ.

    Keys: contacts (how many), normal_force of one contact (N), friction_coefficient, bins (Jenkins elements of all
    contacts together; 256 for rough lines, whose last springs slide one by one, 128 for what is smooth), residual
    (share of the load left by a slip event that the contact starts with; 0 virgin).
    """

    kind: str
    contacts: Annotated[int, Field(ge=1, le=10_000)] = 1
    normal_force: Annotated[float, FORCE]
    friction_coefficient: Annotated[float, FRICTION]
    bins: Annotated[int, Field(ge=8, le=100_000)] = 128
    residual: Annotated[float, quantity("1", least=0, most=1)] = 0.0

    @model_validator(mode="before")
    @classmethod
    @faults()
    def _count(cls, content: Any) -> Any:
        """The number of contacts follows from ``each`` where that is given."""
        if not isinstance(content, dict) or not isinstance(content.get("each"), list):
            return content
        number = len(content["each"])
        if content.get("contacts", number) != number:
            what = "'contacts' and the number of [[contact.each]] differ"
            raise InputError(what, value=content["contacts"], allowed=str(number), hint="remove 'contacts'")
        return {**content, "contacts": number}

    def of(self, i: int, key: str) -> Any:
        """A key's value for the i-th contact (from 0)."""
        each = getattr(self, "each", None)
        own = getattr(each[i], key, None) if each else None
        return getattr(self, key) if own is None else own


class ElasticTable(ContactTable):
    """Kinds made of an elastic profile."""

    youngs_modulus: Annotated[float, quantity("Pa", above=0)] = 210e9
    poisson_ratio: Annotated[float, quantity("1", above=-1, most=0.5)] = 0.3


class EachRoughLine(Each):
    """A rough line of its own."""

    H: Annotated[float | None, HURST] = None
    h_rms: Annotated[float | None, LENGTH] = None


class RoughLineTable(ElasticTable):
    """Self-affine rough lines; every contact its own line (``realisation = "each"``) or the mean of many."""

    kind: Literal["rough-line"]
    bins: Annotated[int, Field(ge=8, le=100_000)] = 256
    H: Annotated[float, HURST]
    h_rms: Annotated[float, LENGTH]
    line_length: Annotated[float, LENGTH] = 20e-6
    springs: Annotated[int, Field(ge=16, le=10_000_000, multiple_of=2)] = 4096
    realisation: Literal["each", "mean"] = "each"
    lines: Annotated[int, Field(ge=1, le=100_000)] = 100
    seed: Annotated[int, Field(ge=0)] = 0
    roll_off: Annotated[float | None, LENGTH] = None
    cut_off: Annotated[float | None, LENGTH] = None
    curvature: Annotated[float, quantity("1/m", least=0)] = 0.0
    each: list[EachRoughLine] | None = None


class EachPowerLaw(Each):
    """A power law of its own."""

    u_max: Annotated[float | None, LENGTH] = None
    p: Annotated[float | None, EXPONENT] = None


class PowerLawTable(ContactTable):
    """The backbone 1 - (1 - u/u_max)^p; ``spread`` is the rms of ln(u_max) over equally loaded contacts."""

    kind: Literal["power-law"]
    u_max: Annotated[float, LENGTH]
    p: Annotated[float, EXPONENT]
    spread: Annotated[float, quantity("1", least=0, most=3)] = 0.0
    each: list[EachPowerLaw] | None = None


class RoundTable(ElasticTable):
    """Kinds that touch at a point: the springs cover ``reach`` times the contact radius of Hertz."""

    springs: Annotated[int, Field(ge=16, le=10_000_000)] = 4096
    reach: Annotated[float, quantity("1", above=1, most=1000)] = 2.5


class EachSphere(Each):
    """A sphere of its own."""

    radius: Annotated[float | None, LENGTH] = None


class SphereTable(RoundTable):
    """Spheres on flats."""

    kind: Literal["sphere"]
    radius: Annotated[float, LENGTH]
    each: list[EachSphere] | None = None


class EachCone(Each):
    """A cone of its own."""

    slope: Annotated[float | None, SLOPE] = None


class ConeTable(RoundTable):
    """Cones on flats; ``slope`` is the tangent of the angle between flank and flat."""

    kind: Literal["cone"]
    slope: Annotated[float, SLOPE]
    each: list[EachCone] | None = None


class FlatPunchTable(ElasticTable):
    """Flat punches: no creep, all springs slide at once."""

    kind: Literal["flat-punch"]
    half_width: Annotated[float, LENGTH]
    each: list[Each] | None = None


class HeightColumn(Table):
    """A column of a file of heights, by name or number from 1, and its unit."""

    column: str | int
    unit: str


class HeightsTable(ElasticTable):
    """A measured profile: a file with heights, at positions of their own or evenly spaced."""

    kind: Literal["heights"]
    file: str = Field(min_length=1)
    height: HeightColumn
    position: HeightColumn | None = None
    spacing: Annotated[float | None, LENGTH] = None
    springs: Annotated[int, Field(ge=16, le=10_000_000)] | None = None
    scale: Annotated[float, quantity("1", above=0)] = 1.0
    each: list[Each] | None = None

    @model_validator(mode="after")
    @faults()
    def _spaced(self) -> Self:
        if (self.position is None) == (self.spacing is None):
            hint = 'spacing = "0.1 um"  where there is no position'
            raise InputError("give either 'position' or 'spacing'", hint=hint)
        return self


CONTACTS: dict[str, type[ContactTable]] = {
    "rough-line": RoughLineTable,
    "power-law": PowerLawTable,
    "sphere": SphereTable,
    "cone": ConeTable,
    "flat-punch": FlatPunchTable,
    "heights": HeightsTable,
}
