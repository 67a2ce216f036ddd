"""Static creep curves: displacement and virtual time at rising load, averaged over rough lines."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import ArgumentError, InputError, nearest
from ...system.units import ends, shown, shown_with
from ._ranges import check_within, concrete
from .indentation import check_saturation
from .rough_lines import RoughLines
from .tangential import StaticContact, checked_contact

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
            f"force: {ends(self.force, 'N')} (of all contacts); u_max: {reach}; "
            f"stiffness: {shown(float(self.stiffness), 'N/m')} (of one contact); "
            f"contact_share: {float(self.contact_share):.3g}; n_springs: {self.n_springs})"
        )


def virtual_time(
    force: ArrayLike, u: ArrayLike, spring_stiffness: ArrayLike | str, velocity: ArrayLike | str,
    form: TimeForm = "exact",
) -> Array:  # fmt: skip
    """Time in s at which a spring pulled at constant velocity has reached ``force`` (N) on the block, inertia left out.

    Args:
        force: tangential force on the block (of all its contacts), N.
        u: displacement of the block, m.
        spring_stiffness, velocity: c_s of the driving spring and v0 of the drive, N/m and m/s or text with a unit.
        form: "exact" F/c_s + u = v0 t; "paper" F = c_s v0 t (Grzemba 2014, eq. 6), which leaves the block's own
            motion out.
    """
    if form not in ("exact", "paper"):
        raise InputError("unknown form of virtual time", value=form, hint=nearest(str(form), ("exact", "paper")))
    spring = "the stiffness of the driving spring"
    c_s = check_within(spring, spring_stiffness, above=0.0, key="spring_stiffness", unit="N/m")
    v0 = check_within("the drive velocity", velocity, above=0.0, key="velocity", unit="m/s")
    pulled = jnp.asarray(force) / c_s
    return (pulled + jnp.asarray(u) if form == "exact" else pulled) / v0


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
    contact: StaticContact | None = None,
    *,
    spring_stiffness: ArrayLike | str = 1000.0,
    velocity: ArrayLike | str = 5e-5,
    contacts: int = 4,
    tau: ArrayLike | None = None,
    average: Average = "displacement",
    time: TimeForm = "exact",
) -> CreepCurve:
    """The static creep curve of equal contacts under a slowly pulled spring (Grzemba 2014). Defaults: the paper's rig.

    ``ss.creep_curve(ss.RoughLines(H=0.3).contact(normal_force=0.31, friction=0.21))``. Differentiable in everything
    continuous.

    Args:
        contact: lines (n_lines, N) under one normal force, over which is averaged, or a single one (N,) of any profile.
        spring_stiffness, velocity: of the drive, N/m and m/s or text with a unit.
        contacts: how many equal contacts carry the block.
        tau: (T,) loads from 0 to 1; default 400, see `default_loads`.
        average: "displacement" at the same load or "force" at the same displacement, see `line_average`.
        time: "exact" or "paper", see `virtual_time`.

    Raises:
        InputError: a value out of its range, or lines in contact over their whole length.

    Warns:
        SaturationWarning: lines in contact over more than half of their length.
    """
    loads = check_within("the load", default_loads() if tau is None else tau, least=0.0, to=1.0, key="tau")
    check_within("the number of contacts", contacts, least=1.0, key="contacts")
    contact = RoughLines().contact() if contact is None else checked_contact(contact)
    if jnp.ndim(contact.strength) > 0:
        raise ArgumentError(
            "lines that are averaged carry the same load", key="contact",
            value=f"{jnp.size(contact.strength)} loads", hint="ss.bank_from_contact takes unequal contacts",
        )  # fmt: skip
    tau_out, u, u_max, stiffness, share = _evaluate(contact, jnp.asarray(loads), average)
    if concrete(share) and jnp.any(contact.indentation.gaps > 0.0):  # a flat punch is meant to touch all over
        check_saturation(share, key="contact")
    force = tau_out * contact.strength * contacts
    t = virtual_time(force, u, spring_stiffness, velocity, time)
    reach, spread = jnp.mean(u_max), jnp.std(u_max)
    springs = contact.indentation.n_springs
    return CreepCurve(tau_out, u, t, force, reach, spread, jnp.mean(stiffness), jnp.mean(share), springs)


def creep_displacements(contact: StaticContact, tau: ArrayLike, *, memory: float = 2.0e7) -> np.ndarray:
    """Displacements at given loads for many parameter sets, mean over the lines. For derivatives: `creep_curve`.

    Args:
        contact: P sets on the same lines: the height of its table, normal force and friction have shape (P, 1), or one
            that broadcasts to it: ``static_contact(RoughLines(H, 1.0).indentation.scaled(h_rms), force, friction)``.
        tau: (T,) loads.
        memory: bytes that one chunk may take, about; more than the caches hold costs twice the time.

    Returns:
        (P, T) in m. No check of saturation.

    Raises:
        InputError: no contact, or sets of another shape.
    """
    table, loads = checked_contact(contact).indentation, jnp.asarray(tau)
    given = [np.asarray(a) for a in (table.height, contact.normal_force, contact.friction)]
    sets = np.broadcast_arrays(*(a.reshape(1, 1) if a.ndim == 0 else a for a in given))
    if sets[0].ndim != 2 or sets[0].shape[1] != 1:
        raise ArgumentError(
            "parameter sets are rows", key="contact", value=", ".join(str(a.shape) for a in given),
            allowed="height of the table, normal force and friction of shape (P, 1)",
        )  # fmt: skip
    number = len(sets[0])
    chunk = int(max(1, memory // (80 * table.gaps[..., 0].size * loads.size)))
    out = np.empty((number, loads.size))
    for start in range(0, number, chunk):
        part = np.arange(start, min(start + chunk, number))
        padded = np.resize(part, min(chunk, number))  # one shape, one compilation
        height, force, friction = (a[padded] for a in sets)
        made = StaticContact(replace(table, height=height), force, friction, contact.moduli)
        out[part] = _mean_displacement(made, loads)[: part.size]
    return out


@partial(jax.jit, static_argnames="average")
def _evaluate(contact: StaticContact, tau: Array, average: Average) -> tuple[Array, Array, Array, Array, Array]:
    return *line_average(contact, tau, average), contact.u_max, contact.stiffness, contact.contact_share


@jax.jit
def _mean_displacement(contact: StaticContact, tau: Array) -> Array:
    return jnp.mean(contact.displacement(tau[:, None, None]), axis=-1).T
