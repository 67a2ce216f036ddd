"""The static curve of a scenario's contacts: displacement against force, and the time a slow drive takes to it."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np

from ...errors import InputError
from ...physics import contact as physics
from ...physics.contact.creep import Average, TimeForm
from ...system.units import ends
from .build import Setup
from .contact_tables import ElasticTable, RoughLineTable
from .contacts import build_contact, moduli, profile_of, stated_lines
from .drive import load_point
from .load import Scenario

_loading = jax.jit(physics.loading_displacement)


class StaticCreep(NamedTuple):
    """A static curve, shape (n,).

    Fields:
        tau: share of the full friction force.
        u: displacement (m).
        t: virtual time (s).
    """

    tau: np.ndarray
    u: np.ndarray
    t: np.ndarray

    def __repr__(self) -> str:
        return f"StaticCreep({self.tau.size} points; u: {ends(self.u, 'm')}; t: {ends(self.t, 's')})"


def static_creep(
    scenario: Scenario, points: int = 400, average: Average = "displacement", time: TimeForm = "exact"
) -> StaticCreep:
    """The static creep curve of virgin contacts under the scenario's drive, inertia and weakening left out.

    Rough lines of one kind are averaged over ``contact.lines`` lines, whatever their realisation is.

    Args:
        scenario: its contact, spring and first drive velocity count.
        points: loads from zero to full friction.
        average, time: as of `stickslip.physics.contact.creep_curve`.

    Raises:
        InputError: the drive stands still at first, or a line is in contact over its whole length.
    """
    file, table = scenario.file, scenario.file.contact
    velocity = _drive_velocity(scenario)
    tau = physics.default_loads(points)
    drive: dict[str, Any] = {"spring_stiffness": file.block.spring_stiffness, "velocity": velocity}
    equal = getattr(table, "each", None) is None and not getattr(table, "curvature", 0.0)
    if isinstance(table, ElasticTable) and equal:
        pressed = table.normal_force, table.friction_coefficient, moduli(table)
        if isinstance(table, RoughLineTable):
            contact = stated_lines(table, table.H, table.h_rms, table.lines).contact(*pressed)
        else:
            contact = physics.static_contact(physics.indentation(profile_of(table, 0, scenario.folder)), *pressed)
        curve = physics.creep_curve(contact, **drive, contacts=table.contacts, tau=tau, average=average, time=time)
        return StaticCreep(*(np.asarray(a) for a in (curve.tau, curve.u, curve.t)))
    built = build_contact(table.model_copy(update={"bins": max(table.bins, 4096)}), scenario.folder)
    u = np.asarray(_loading(built.bank.stiffness, built.bank.strength, tau * built.strength))
    t = physics.virtual_time(tau * built.strength, u, form=time, **drive)
    return StaticCreep(tau, u, np.asarray(t))


def first_stick(setup: Setup, points: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Static displacement (m) and time (s) of the first stick, from the bank and the forces it starts with.

    The time is that of the first piece of the drive; empty where that stands still.
    """
    velocity = setup.motion.first_velocity
    if velocity == 0.0:
        return np.zeros(0), np.zeros(0)
    bank, sign = setup.model.bank, np.sign(velocity)
    held = np.asarray(setup.start.force) * sign
    room = np.asarray(bank.strength) - held
    left = float(room.sum())
    loads = physics.default_loads(points) * left
    u = np.asarray(_loading(bank.stiffness, room, loads))
    t = (loads / float(setup.model.block.spring_stiffness) + u) / abs(velocity)
    return u * sign, t


def _drive_velocity(scenario: Scenario) -> float:
    velocity = abs(load_point(scenario.file.drive, scenario.folder).first_velocity)
    if velocity == 0.0:
        what = "the drive stands still at first, so no time belongs to a load"
        hint = "--set drive.piece.1.velocity=50um/s, or another scenario"
        raise InputError(what, file=scenario.path, key="drive", hint=hint)
    return velocity
