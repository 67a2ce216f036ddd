"""What may stand in ``[contact]``, one table for every kind of contact."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..campaign.fields import fault, quantity
from ..errors import InputError


class Table(BaseModel):
    """Base: unknown keys are errors, nothing changes after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Each(Table):
    """One contact that differs from the others."""

    normal_force: quantity("N", above=0) | None = None  # type: ignore[valid-type]
    friction_coefficient: quantity("1", above=0, most=10) | None = None  # type: ignore[valid-type]


class ContactTable(Table):
    """What all kinds share. ``each`` holds one table for every contact where they differ.

    Keys: contacts (how many), normal_force of one contact (N), friction_coefficient, bins (Jenkins elements), residual
    (share of the load left by a slip event that the contact starts with; 0 virgin).
    """

    kind: str
    contacts: Annotated[int, Field(ge=1, le=10_000)] = 1
    normal_force: quantity("N", above=0)  # type: ignore[valid-type]
    friction_coefficient: quantity("1", above=0, most=10)  # type: ignore[valid-type]
    bins: Annotated[int, Field(ge=8, le=100_000)] = 128
    residual: quantity("1", least=0, most=1) = 0.0  # type: ignore[valid-type]

    @model_validator(mode="before")
    @classmethod
    def _count(cls, content: Any) -> Any:
        """The number of contacts follows from ``each`` where that is given."""
        if not isinstance(content, dict) or not isinstance(content.get("each"), list):
            return content
        number = len(content["each"])
        if content.get("contacts", number) != number:
            raise fault(
                InputError(
                    "'contacts' and the number of [[contact.each]] differ",
                    value=content["contacts"],
                    allowed=str(number),
                    hint="remove 'contacts'",
                )
            )
        return {**content, "contacts": number}

    def of(self, i: int, key: str) -> Any:
        """A key's value for the i-th contact (from 0)."""
        each = getattr(self, "each", None)
        own = getattr(each[i], key, None) if each else None
        return getattr(self, key) if own is None else own


class ElasticTable(ContactTable):
    """Kinds made of an elastic profile."""

    youngs_modulus: quantity("Pa", above=0) = 210e9  # type: ignore[valid-type]
    poisson_ratio: quantity("1", above=-1, most=0.5) = 0.3  # type: ignore[valid-type]


class EachRoughLine(Each):
    """A rough line of its own."""

    H: quantity("1", above=0, below=1) | None = None  # type: ignore[valid-type]
    h_rms: quantity("m", above=0) | None = None  # type: ignore[valid-type]


class RoughLineTable(ElasticTable):
    """Self-affine rough lines; every contact its own line (``realisation = "each"``) or the mean of many."""

    kind: Literal["rough-line"]
    H: quantity("1", above=0, below=1)  # type: ignore[valid-type]
    h_rms: quantity("m", above=0)  # type: ignore[valid-type]
    line_length: quantity("m", above=0) = 20e-6  # type: ignore[valid-type]
    springs: Annotated[int, Field(ge=16, le=10_000_000, multiple_of=2)] = 4096
    realisation: Literal["each", "mean"] = "each"
    lines: Annotated[int, Field(ge=1, le=100_000)] = 100
    seed: Annotated[int, Field(ge=0)] = 0
    roll_off: quantity("m", above=0) | None = None  # type: ignore[valid-type]
    cut_off: quantity("m", above=0) | None = None  # type: ignore[valid-type]
    curvature: quantity("1/m", least=0) = 0.0  # type: ignore[valid-type]
    each: list[EachRoughLine] | None = None


class EachPowerLaw(Each):
    """A power law of its own."""

    u_max: quantity("m", above=0) | None = None  # type: ignore[valid-type]
    p: quantity("1", above=1, most=100) | None = None  # type: ignore[valid-type]


class PowerLawTable(ContactTable):
    """The backbone 1 - (1 - u/u_max)^p; ``spread`` is the rms of ln(u_max) over equally loaded contacts."""

    kind: Literal["power-law"]
    u_max: quantity("m", above=0)  # type: ignore[valid-type]
    p: quantity("1", above=1, most=100)  # type: ignore[valid-type]
    spread: quantity("1", least=0, most=3) = 0.0  # type: ignore[valid-type]
    each: list[EachPowerLaw] | None = None


class EachSphere(Each):
    """A sphere of its own."""

    radius: quantity("m", above=0) | None = None  # type: ignore[valid-type]


class SphereTable(ElasticTable):
    """Spheres on flats; the springs cover ``reach`` times the contact radius of Hertz."""

    kind: Literal["sphere"]
    radius: quantity("m", above=0)  # type: ignore[valid-type]
    springs: Annotated[int, Field(ge=16, le=10_000_000)] = 4096
    reach: quantity("1", above=1, most=1000) = 1.5  # type: ignore[valid-type]
    each: list[EachSphere] | None = None


class EachCone(Each):
    """A cone of its own."""

    slope: quantity("1", above=0) | None = None  # type: ignore[valid-type]


class ConeTable(ElasticTable):
    """Cones on flats; ``slope`` is the tangent of the angle between flank and flat."""

    kind: Literal["cone"]
    slope: quantity("1", above=0)  # type: ignore[valid-type]
    springs: Annotated[int, Field(ge=16, le=10_000_000)] = 4096
    reach: quantity("1", above=1, most=1000) = 1.5  # type: ignore[valid-type]
    each: list[EachCone] | None = None


class FlatPunchTable(ElasticTable):
    """Flat punches: no creep, all springs slide at once."""

    kind: Literal["flat-punch"]
    half_width: quantity("m", above=0)  # type: ignore[valid-type]
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
    spacing: quantity("m", above=0) | None = None  # type: ignore[valid-type]
    springs: Annotated[int, Field(ge=16, le=10_000_000)] | None = None
    scale: quantity("1", above=0) = 1.0  # type: ignore[valid-type]
    each: list[Each] | None = None

    @model_validator(mode="after")
    def _spaced(self) -> Self:
        if (self.position is None) == (self.spacing is None):
            raise fault(
                InputError("give either 'position' or 'spacing'", hint='spacing = "0.1 um"  where there is no position')
            )
        return self


CONTACTS: dict[str, type[ContactTable]] = {
    "rough-line": RoughLineTable,
    "power-law": PowerLawTable,
    "sphere": SphereTable,
    "cone": ConeTable,
    "flat-punch": FlatPunchTable,
    "heights": HeightsTable,
}
