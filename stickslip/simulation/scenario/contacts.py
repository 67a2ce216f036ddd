"""From ``[contact]`` to one bank of Jenkins elements, and what a person wants to know of it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...data.readers import read_columns
from ...errors import InputError
from ...physics import contact as physics
from ...physics.contact import Bank, Profile, StaticContact
from ...system.units import factor_to_si
from . import contact_tables as tables


class Elastic(eqx.Module):
    """Contacts with tables of their own, in parallel; ``contact`` has them on its last axis, or is one contact."""

    contact: StaticContact
    number: float = 1.0

    def backbone(self, u: Array) -> Array:
        """Force (n,) in N at displacements (n,) in m."""
        lead = self.contact.indentation.gaps.ndim - 1
        force = self.contact.force(u.reshape(u.shape + (1,) * lead))
        return self.number * jnp.sum(force, axis=tuple(range(1, 1 + lead)))

    @property
    def u_max(self) -> Array:
        return jnp.ravel(self.contact.u_max)


class MeanLine(eqx.Module):
    """Equal contacts that follow the mean of many lines: mean displacement at the same load."""

    u: Array
    force: Array

    def backbone(self, u: Array) -> Array:
        """As of `Elastic`."""
        return jnp.interp(u, self.u, self.force)

    @property
    def u_max(self) -> Array:
        return self.u[-1:]


class PowerLaw(eqx.Module):
    """The power-law backbone, of one contact or of a mixture."""

    strength: Array
    length: Array
    p: Array
    spread: Array
    contacts: int = eqx.field(static=True)

    def _mixed(self) -> tuple[Any, Array]:
        alone = partial(physics.power_law_backbone, u_max=self.length, strength=self.strength, p=self.p)
        return physics.mixture(alone, self.spread, self.contacts)

    def backbone(self, u: Array) -> Array:
        """As of `Elastic`."""
        return self._mixed()[0](u)

    @property
    def u_max(self) -> Array:
        scores = jnp.asarray(physics.normal_scores(self.contacts))
        return jnp.asarray(self.length * jnp.exp(self.spread * scores))


Part = Elastic | MeanLine | PowerLaw


@dataclass(frozen=True)
class Built:
    """A bank and its facts.

    Attributes:
        bank: all contacts together.
        strength: full friction force (N).
        stiffness: of the virgin contacts together (N/m).
        u_max: mean displacement at which a contact's last spring slides (m).
        binning_error: bound of the error of the bank's curve, share of the strength.
        contact_share: mean share of a line in contact, nan where there is no line.
        warnings: what looks odd.
    """

    bank: Bank
    strength: float
    stiffness: float
    u_max: float
    binning_error: float
    contact_share: float
    warnings: tuple[str, ...]


def build_contact(table: tables.ContactTable, folder: Path = Path()) -> Built:
    """Make the bank of a scenario's contacts.

    Args:
        table: ``[contact]``.
        folder: where a file of heights is looked for.

    Raises:
        InputError: a line in contact over its whole length, or a file that cannot be used.
    """
    parts = tuple(_parts(table, folder))
    bank, facts, found = _make_bank(parts, table.bins)
    shares = np.asarray(found)
    notes: list[str] = []
    if shares.size and not isinstance(table, tables.FlatPunchTable):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            physics.check_saturation(shares, key="contact")
        notes += [str(w.message) for w in caught]
    strength, stiffness, u_max, error = np.asarray(facts).tolist()
    touching = float(shares.mean()) if shares.size else float("nan")
    return Built(bank, strength, stiffness, u_max, error, touching, tuple(notes))


@partial(jax.jit, static_argnames="n")
def _make_bank(parts: tuple[Part, ...], n: int) -> tuple[Bank, Array, Array]:
    """The bank; its strength, stiffness, mean u_max and binning error; shares of the lines in contact."""

    def backbone(u: Array) -> Array:
        return sum((part.backbone(u) for part in parts), jnp.zeros_like(u))

    reaches = jnp.concatenate([part.u_max for part in parts])
    edges = physics.default_edges(n)
    bank = physics.bank_from_backbone(backbone, jnp.max(reaches), edges)
    error = physics.binning_error(backbone, jnp.max(reaches), edges)
    facts = jnp.stack([bank.total_strength, bank.total_stiffness, jnp.mean(reaches), error])
    shares = [jnp.ravel(part.contact.contact_share) for part in parts if isinstance(part, Elastic)]
    return bank, facts, jnp.concatenate([jnp.zeros(0), *shares])


def _parts(table: tables.ContactTable, folder: Path) -> list[Part]:
    match table:
        case tables.RoughLineTable():
            return _rough_parts(table)
        case tables.PowerLawTable():
            return _power_law_parts(table)
        case tables.ElasticTable():
            return [_elastic(profile, table, i, number) for i, number, profile in _profiles(table, folder)]
    raise InputError("unknown kind of contact", key="contact.kind", value=table.kind)


def moduli(table: tables.ElasticTable) -> physics.Moduli:
    """E* and G* of two bodies of the table's material."""
    return physics.equal_bodies(table.youngs_modulus, table.poisson_ratio)


def _rough_parts(table: tables.RoughLineTable) -> list[Part]:
    if table.realisation == "mean":
        return [_mean_line(table, i, number) for i, number in _distinct(table, "H", "h_rms")]
    exponents = [table.of(i, "H") for i in range(table.contacts)]
    parts: list[Part] = []
    for H in dict.fromkeys(exponents):
        rows = np.array([i for i in range(table.contacts) if exponents[i] == H])
        heights = np.array([table.of(i, "h_rms") for i in rows])
        lines = rough_indentation(table, H, heights, table.contacts, rows)
        loads = np.array([table.of(i, "normal_force") for i in rows])
        frictions = np.array([table.of(i, "friction_coefficient") for i in rows])
        parts.append(Elastic(physics.static_contact(lines, loads, frictions, moduli(table))))
    return parts


def stated_lines(table: tables.RoughLineTable, H: float, h_rms: float, lines: int) -> physics.RoughLines:
    """Rough lines as a scenario states them, so many, with this exponent and rms height (m)."""
    return physics.RoughLines(
        H, h_rms, table.line_length, n_springs=table.springs, lines=lines, seed=table.seed,
        roll_off=table.roll_off, cut_off=table.cut_off,
    )  # fmt: skip


def rough_indentation(
    table: tables.RoughLineTable, H: float, heights: Any, lines: int, rows: np.ndarray | None = None
) -> physics.Indentation:
    """The table of a scenario's rough lines: ``lines`` of them, of which ``rows`` are kept."""
    rough = stated_lines(table, H, 1.0, lines)
    if not table.curvature:
        made = rough.indentation
        if rows is not None and rows.size < lines:
            made = physics.Indentation(made.gaps[rows], made.sums[rows], made.dx, made.height)
        return made.scaled(heights)
    # curvature does not scale with the rms height, so these lines are sorted at their real height
    unit = rough.heights[slice(None) if rows is None else rows]
    curved = physics.add_curvature(unit * jnp.reshape(heights, (-1, 1)), rough.dx, table.curvature)
    return physics.indentation(physics.from_heights(curved, rough.dx))


def _mean_line(table: tables.RoughLineTable, i: int, number: int) -> MeanLine:
    friction, load = table.of(i, "friction_coefficient"), table.of(i, "normal_force")
    lines = rough_indentation(table, table.of(i, "H"), table.of(i, "h_rms"), table.lines)
    contact = physics.static_contact(lines, load, friction, moduli(table))
    physics.check_saturation(contact.contact_share, key="contact")
    tau, u = jax.jit(physics.line_average)(contact, physics.default_loads(2000))
    return MeanLine(u, tau * friction * load * number)


def _power_law_parts(table: tables.PowerLawTable) -> list[Part]:
    parts: list[Part] = []
    for i, number in _distinct(table, "u_max", "p"):
        strength = number * table.of(i, "friction_coefficient") * table.of(i, "normal_force")
        u_max, p = jnp.asarray(table.of(i, "u_max")), jnp.asarray(table.of(i, "p"))
        parts.append(PowerLaw(jnp.asarray(strength), u_max, p, jnp.asarray(table.spread), number))
    return parts


def _distinct(table: tables.ContactTable, *keys: str) -> list[tuple[int, int]]:
    """Index of the first contact of every sort, and how many there are of it."""
    names = ("normal_force", "friction_coefficient", *keys)
    found: dict[tuple, list[int]] = {}
    for i in range(table.contacts if getattr(table, "each", None) else 1):
        found.setdefault(tuple(table.of(i, name) for name in names), []).append(i)
    if not getattr(table, "each", None):
        return [(0, table.contacts)]
    return [(rows[0], len(rows)) for rows in found.values()]


def _elastic(profile: Profile, table: tables.ElasticTable, i: int, number: int) -> Elastic:
    load, friction = table.of(i, "normal_force"), table.of(i, "friction_coefficient")
    contact = physics.static_contact(physics.indentation(profile), load, friction, moduli(table))
    return Elastic(contact, float(number))


def _profiles(table: tables.ElasticTable, folder: Path) -> list[tuple[int, int, Profile]]:
    """Every sort of contact: index of its first, how many, and its profile."""
    keys = {tables.SphereTable: ("radius",), tables.ConeTable: ("slope",)}.get(type(table), ())
    return [(i, number, profile_of(table, i, folder)) for i, number in _distinct(table, *keys)]


def profile_of(table: tables.ElasticTable, i: int, folder: Path) -> Profile:
    """The profile of the i-th contact of a kind that is not a rough line."""
    normal = float(np.asarray(moduli(table).normal))
    load = table.of(i, "normal_force")
    match table:
        case tables.SphereTable():
            radius = table.of(i, "radius")
            touching = (0.75 * load * radius / normal) ** (1 / 3)
            return physics.sphere(table.reach * touching, table.springs, radius)
        case tables.ConeTable():
            slope = table.of(i, "slope")
            touching = (2.0 * load / (np.pi * normal * slope)) ** 0.5
            return physics.cone(table.reach * touching, table.springs, slope)
        case tables.FlatPunchTable():
            return physics.flat_punch(table.half_width, 16)
        case tables.HeightsTable():
            return _measured(table, folder)
    raise InputError("unknown kind of contact", key="contact.kind", value=table.kind)


def _measured(table: tables.HeightsTable, folder: Path) -> Profile:
    path = folder / table.file
    columns = read_columns(path)

    def column(part: Any, key: str) -> np.ndarray:
        name = columns.find(part.column, file=path, key=f"contact.{key}")
        return columns.data[name] * factor_to_si(part.unit, "m", key=f"contact.{key}.unit")

    position = None if table.position is None else column(table.position, "position")
    try:
        scan = position, column(table.height, "height")
        heights, dx = physics.heights_from_scan(*scan, spacing=table.spacing, n_springs=table.springs)
    except InputError as error:
        raise error.at(file=path) from None
    return physics.from_heights(table.scale * heights, dx)
