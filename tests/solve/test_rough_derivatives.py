"""Derivatives of slips in what describes the rough contact itself: H, h_rms, load, friction."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.physics.contact import RoughLines, bank_from_contact
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.simulation.solve.derivatives import slip_derivatives

from . import brute_force
from .rig import MASS, tighter
from .slip_differences import END, SHOWN, errors, path_slips, table

CONTACT = np.array([0.3, 2.46e-6, 0.31, 0.21])  # H, h_rms (m), load of a contact (N), friction coefficient
SPEED = 5e-5


def contact(theta):
    H, h_rms, load, friction = jnp.asarray(CONTACT) * jnp.exp(theta)
    lines = RoughLines(H, h_rms, n_springs=1024, lines=4, seed=3)
    return bank_from_contact(lines.contact(load, friction), 128)


def build(theta):
    return Model(
        Block(MASS, 1000.0, 10.0),
        contact(theta),
        Weakening(0.85, 1e-6, 0.02),
        LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, SPEED])),
    )


def tangents() -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the elements' stiffness and strength, shape (4, n) each."""
    columns = [jax.jvp(contact, (jnp.zeros(4),), (e,))[1] for e in jnp.eye(4)]
    return np.stack([c.stiffness for c in columns]), np.stack([c.strength for c in columns])


def test_derivatives_of_the_bank_are_differences_between_two_touches():
    """Every spring that touches is a kink; differences that step over none are the derivative."""
    for e, stiffness, strength in zip(np.eye(4), *tangents(), strict=True):
        there, back = contact(1e-6 * e), contact(-1e-6 * e)
        for name, column in (("stiffness", stiffness), ("strength", strength)):
            difference = np.asarray(getattr(there, name) - getattr(back, name)) / 2e-6
            # friction does not change the stiffness
            scale = max(np.linalg.norm(column), np.linalg.norm(np.asarray(getattr(there, name))))
            assert np.linalg.norm(difference - column) < 1e-6 * scale


def marched(theta: np.ndarray) -> dict[str, np.ndarray]:
    """Slips by brute force, with the bank moved along its tangents: no spring touches on the way."""
    bank, (stiffness, strength) = contact(np.zeros(4)), tangents()
    path = brute_force.simulate(
        np.asarray(bank.stiffness) + theta @ stiffness, np.asarray(bank.strength) + theta @ strength, duration=END,
        mass=MASS, spring_stiffness=1000.0, damping=10.0, ratio=0.85, slip_distance=1e-6, healing_time=0.02,
        times=[0.0, 1.0], positions=[0.0, SPEED], dt=1e-5, every=10,
    )  # fmt: skip
    return table(path_slips(path, SPEED))


def solved() -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Slips and their derivatives by the package."""
    values, columns = slip_derivatives(build, np.zeros(4), END, tolerance=tighter(1000.0), refine=2)
    return table(values), table(columns)


def differences(step: float) -> dict[str, np.ndarray]:
    """Central differences by brute force."""
    moves = [(marched(step * e), marched(-step * e)) for e in np.eye(4)]
    return {name: np.stack([(there[name] - back[name]) / (2.0 * step) for there, back in moves]) for name in SHOWN}


def against_brute_force(step: float) -> dict[str, float]:
    """Largest errors of the derivatives over the largest of their kind."""
    return errors(solved()[1], differences(step))


@pytest.mark.long
def test_derivatives_in_the_roughness_agree_with_differences_by_brute_force():
    values, seen = solved()
    expected = marched(np.zeros(4))
    for name in SHOWN:
        assert values[name] == pytest.approx(expected[name], rel=5e-4)
    for step in (6e-3, 2e-3):
        found = errors(seen, differences(step))
        print(step, found)
        assert all(error < 0.01 for error in found.values())
