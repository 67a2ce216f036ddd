"""Static creep curves: displacement and virtual time at rising load, averaged over rough lines."""

from __future__ import annotations

from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError, nearest
from ...system.units import ends, shown, shown_with
from ._ranges import check_within, concrete
from .elastic import Moduli, equal_bodies
from .indentation import Indentation, check_saturation, indentation
from .profiles import Profile, from_heights
from .roughness import check_line, line_phasors, lines_from_phasors
from .tangential import StaticContact
from .touching import touching

Average = Literal["displacement", "force"]
TimeForm = Literal["exact", "paper"]


class CreepCurve(NamedTuple):
    """A static creep curve, T points from the force-free contact to full sliding.

    Fields:
        tau: (T,) force as a share of the full friction force, 0 to 1.
        u: (T,) displacement, m.
        t: (T,) virtual time, s.
        force: (T,) tangential force of all contacts together, N.
        u_max: mean displacement at which the last spring slides, m.
        u_max_spread: its standard deviation over the lines, m.
        stiffness: mean tangential stiffness of one unloaded contact, N/m.
        contact_share: mean share of a line that touches.
        n_springs: springs of a line; at small H the curve depends on it.
    """

    tau: Array
    u: Array
    t: Array
    force: Array
    u_max: Array
    u_max_spread: Array
    stiffness: Array
    contact_share: Array
    n_springs: int

    def __repr__(self) -> str:
        if not all(map(concrete, self)):
            return f"CreepCurve({jnp.shape(self.tau)[-1]} points, traced)"
        reach = shown_with(float(self.u_max), float(self.u_max_spread), "m")
        return (
            f"CreepCurve({self.tau.size} points; u: {ends(self.u, 'm')}; t: {ends(self.t, 's')}; "
            f"force: {ends(self.force, 'N')}; u_max: {reach}; stiffness: {shown(float(self.stiffness), 'N/m')}; "
            f"contact_share: {float(self.contact_share):.3g}; n_springs: {self.n_springs})"
        )


def virtual_time(
    force: ArrayLike, u: ArrayLike, spring_stiffness: ArrayLike, velocity: ArrayLike, form: TimeForm = "exact"
) -> Array:
    """Time in s at which a spring pulled at constant velocity has reached ``force`` (N) on the block, inertia left out.

    Args:
        force: tangential force on the block (of all its contacts), N.
        u: displacement of the block, m.
        spring_stiffness: c_s of the driving spring, N/m.
        velocity: v0 of the drive, m/s.
        form: "exact" F/c_s + u = v0 t; "paper" F = c_s v0 t (Grzemba 2014, eq. 6), which leaves the block's own
            motion out.
    """
    if form not in ("exact", "paper"):
        raise InputError("unknown form of virtual time", value=form, hint=nearest(str(form), ("exact", "paper")))
    check_within("the stiffness of the driving spring", spring_stiffness, above=0.0, key="spring_stiffness", unit="N/m")
    check_within("the drive velocity", velocity, above=0.0, key="velocity", unit="m/s")
    pulled = jnp.asarray(force) / spring_stiffness
    return (pulled + jnp.asarray(u) if form == "exact" else pulled) / velocity


def default_loads(n: int = 400) -> np.ndarray:
    """(n,) loads tau from 0 to 1, closer towards 1 so that they lie about evenly in displacement."""
    return 1.0 - (1.0 - np.linspace(0.0, 1.0, n)) ** 3


def line_average(contact: StaticContact, tau: ArrayLike, average: Average = "displacement") -> tuple[Array, Array]:
    """Load and displacement (T,) averaged over the lines (the last axis) of a contact without other axes.

    Args:
        contact: lines (n_lines, N) under one normal force.
        tau: (T,) loads.
        average: "displacement" at the same load (all lines end at tau = 1); "force" at the same displacement, which
            smears the end; its displacements reach to the u_max of the stiffest-held line, and the loads that come
            back are not those given but follow from them.
    """
    tau = jnp.asarray(tau)
    if average == "displacement":
        return tau, jnp.mean(contact.displacement(tau[:, None]), axis=-1)
    if average != "force":
        raise InputError("unknown average", value=average, hint=nearest(str(average), ("displacement", "force")))
    u = (1.0 - jnp.cbrt(1.0 - tau)) * jnp.max(contact.u_max)
    return jnp.mean(contact.force(u[:, None]) / contact.strength, axis=-1), u


def creep_curve(
    H: ArrayLike = 0.3,
    h_rms: ArrayLike = 2.46e-6,
    normal_force: ArrayLike = 0.31,
    friction: ArrayLike = 0.21,
    *,
    spring_stiffness: ArrayLike = 1000.0,
    velocity: ArrayLike = 5e-5,
    contacts: int = 4,
    moduli: Moduli | None = None,
    length: float = 20e-6,
    n_springs: int = 4096,
    lines: int = 100,
    seed: int = 0,
    roll_off: ArrayLike | None = None,
    cut_off: ArrayLike | None = None,
    profile: Profile | None = None,
    tau: ArrayLike | None = None,
    average: Average = "displacement",
    time: TimeForm = "exact",
) -> CreepCurve:
    """The static creep curve of equal contacts under a slowly pulled spring (Grzemba 2014). Defaults: the paper's rig.

    Differentiable in H, h_rms, normal_force, friction and the other continuous arguments.

    Args:
        H: Hurst exponent in (0, 1).
        h_rms: rms height of the line of the given length, m.
        normal_force: of one contact, N.
        friction: Coulomb friction coefficient.
        spring_stiffness, velocity: of the drive, N/m and m/s.
        contacts: how many equal contacts carry the block.
        moduli: E* and G*; default steel on steel.
        length: of the line, m.
        n_springs: springs of a line.
        lines: how many lines are averaged.
        seed: of the lines.
        roll_off, cut_off: wavelengths in m (see `rough_lines`); default none.
        profile: any profile, instead of rough lines; then H, h_rms, length, n_springs, lines and seed have no effect.
        tau: (T,) loads from 0 to 1; default 400, see `default_loads`.
        average: "displacement" at the same load or "force" at the same displacement, see `line_average`.
        time: "exact" or "paper", see `virtual_time`.

    Raises:
        InputError: a value out of its range, or lines in contact over their whole length.

    Warns:
        SaturationWarning: lines in contact over more than half of their length.
    """
    loads = default_loads() if tau is None else tau
    check_within("the load", loads, least=0.0, to=1.0, key="tau")
    check_within("the number of contacts", contacts, least=1.0, key="contacts")
    elastic = moduli or equal_bodies()
    if profile is None:
        waves = {k: None if w is None else w / length for k, w in (("roll_off", roll_off), ("cut_off", cut_off))}
        _check_load(normal_force, friction)
        load = n_springs * jnp.asarray(normal_force) / (elastic.normal * length * jnp.asarray(_height(h_rms)))
        table = rough_table(H, length, n_springs, lines, seed, load=load, **waves).scaled(h_rms)
    else:
        table = indentation(profile)
    contact = static_contact(table, normal_force, friction, elastic)
    tau_out, u, u_max, stiffness, share = _evaluate(contact, jnp.asarray(loads), average)
    if concrete(share) and (profile is None or jnp.any(profile.gaps > 0.0)):  # a flat punch is meant to touch all over
        check_saturation(share, key="contact")
    force = tau_out * contact.strength * contacts
    t = virtual_time(force, u, spring_stiffness, velocity, time)
    reach, spread = jnp.mean(u_max), jnp.std(u_max)
    return CreepCurve(tau_out, u, t, force, reach, spread, jnp.mean(stiffness), jnp.mean(share), table.n_springs)


def creep_displacements(
    H: ArrayLike,
    h_rms: ArrayLike,
    normal_force: ArrayLike,
    friction: ArrayLike,
    tau: ArrayLike,
    *,
    moduli: Moduli | None = None,
    length: float = 20e-6,
    n_springs: int = 4096,
    lines: int = 100,
    seed: int = 0,
    memory: float = 2.0e7,
) -> np.ndarray:
    """Displacements at given loads for many parameter sets, mean over the lines. For derivatives: `creep_curve`.

    The first four arguments broadcast to one axis of P sets. Lines are made and sorted once for each distinct H;
    sets are worked off in chunks.

    Args:
        tau: (T,) loads.
        memory: bytes that one chunk may take, about; more than the caches hold costs twice the time.

    Returns:
        (P, T) in m. No check of saturation.

    Raises:
        InputError: a value out of its range.
    """
    sets = np.broadcast_arrays(*(np.asarray(a, dtype=float).ravel() for a in (H, h_rms, normal_force, friction)))
    _height(sets[1])
    elastic = moduli or equal_bodies()
    _check_load(sets[2], sets[3])
    loads = jnp.asarray(tau)
    chunk = int(max(1, memory // (80 * lines * loads.size)))
    out = np.empty((sets[0].size, loads.size))
    for hurst in np.unique(sets[0]):
        table = rough_table(float(hurst), length, n_springs, lines, seed)
        rows = np.flatnonzero(sets[0] == hurst)
        for start in range(0, rows.size, chunk):
            part = rows[start : start + chunk]
            padded = np.resize(part, min(chunk, rows.size))  # one shape, one compilation
            out[part] = _mean_displacement(table, *(a[padded] for a in sets[1:]), loads, elastic)[: part.size]
    return out


def rough_table(
    H: ArrayLike,
    length: float = 20e-6,
    n_springs: int = 4096,
    lines: int = 100,
    seed: int = 0,
    *,
    load: ArrayLike | None = None,
    **waves: ArrayLike | None,
) -> Indentation:
    """Sorted table of rough lines with an rms height of 1 m; give it the real one with `Indentation.scaled`.

    Args: as of `creep_curve`, but ``roll_off`` and ``cut_off`` as shares of the length. ``load``: largest
    F_n/(E* dx h_rms) that will be asked for, if it is known (see `touching`).
    """
    check_within("the length of the line", length, above=0.0, key="line_length", unit="m")
    check_line(H, lines, n_springs)
    phasors, dx = line_phasors(lines, n_springs, seed), length / n_springs
    if load is None:
        return _table(H, phasors, dx, waves)
    return touching(Profile(_gaps(H, phasors, waves), dx), load)


def static_contact(
    table: Indentation, normal_force: ArrayLike, friction: ArrayLike, moduli: Moduli | None = None
) -> StaticContact:
    """`StaticContact` after a check of the ranges; default moduli: steel on steel."""
    _check_load(normal_force, friction)
    return StaticContact(table, normal_force, friction, moduli or equal_bodies())


@jax.jit
def _table(H: ArrayLike, phasors: ArrayLike, dx: ArrayLike, waves: dict[str, ArrayLike | None]) -> Indentation:
    return indentation(from_heights(lines_from_phasors(H, phasors, **waves), dx))


@jax.jit
def _gaps(H: ArrayLike, phasors: ArrayLike, waves: dict[str, ArrayLike | None]) -> Array:
    return from_heights(lines_from_phasors(H, phasors, **waves), 1.0).gaps


@partial(jax.jit, static_argnames="average")
def _evaluate(contact: StaticContact, tau: Array, average: Average) -> tuple[Array, Array, Array, Array, Array]:
    return *line_average(contact, tau, average), contact.u_max, contact.stiffness, contact.contact_share


@jax.jit
def _mean_displacement(
    table: Indentation, h_rms: Array, normal_force: Array, friction: Array, tau: Array, moduli: Moduli
) -> Array:
    contact = StaticContact(table.scaled(h_rms[:, None]), normal_force[:, None], friction[:, None], moduli)
    return jnp.mean(contact.displacement(tau[:, None, None]), axis=-1).T


def _height(h_rms: ArrayLike) -> ArrayLike:
    check_within("the rms height", h_rms, above=0.0, key="h_rms", unit="m")
    return h_rms


def _check_load(normal_force: ArrayLike, friction: ArrayLike) -> None:
    check_within("the normal force", normal_force, above=0.0, key="normal_force", unit="N")
    check_within("the friction coefficient", friction, above=0.0, key="friction_coefficient")
