"""Compliance of the fixture: between the contact and the sensor's spot, or between the contact and the block's mass."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter, variant
from .base import Geometry, Motion, Sensor
from .catalogue import register


@register
class MachineCompliance(Geometry, Sensor):
    """A spring in series with the whole contact.

    ``read-out``: it lies outside the motion and is only seen by the sensor. ``series``: the contact's slip is
    ``u = x - F/k_m``. A bank of Jenkins elements is a Prandtl-Ishlinskii stop operator; its inverse is a play operator,
    to which ``F/k_m`` adds a linear term, and the inverse of that is a stop operator again. So the contact with the
    fixture is a bank of as many elements, with the same forces at displacements larger by ``F/k_m``: exact for any
    history at constant friction, and while one factor changes the friction of all elements and the motion goes one way.
    Where friction falls during a short reversal the force is off by less than a tenth of the fall times ``k_t/k_m``
    (0.1 % of the strength for a fall of 10 % and ``k_t/k_m = 0.2``). Weakening counts the way ``x`` instead of ``u``.
    """

    tag = "machine-compliance"
    summary = "the fixture gives way under the friction force"
    equation = r"y \to y + \sum_i f_i/k_m \quad\mathrm{or}\quad \dot f_i = k_i\,\dot x_c,\quad x_c = x - \sum_i f_i/k_m"
    symbols = {
        "x_c": "displacement of the contact, on which the fixture stands (m)",
        "K_i": "stiffness of the elements that stick up to the displacement at which this one slides (N/m)",
    }
    signature = "creep in proportion to the force, on top of the contact's; read-out: too large for the ring frequency"
    confused_with = {
        "curvature": "load series: the fixture's part of the creep does not depend on the normal load",
        "sensor-drift": "change the drive velocity: compliance follows force, drift the clock",
        "viscoelastic-contact": "a hold: compliance has settled at once",
        "inertia": "add a known mass; compliance lowers the ring frequency and adds creep",
        "tilt": "a second laser on the base",
    }
    source = "Masing (1926); inverse of a Prandtl-Ishlinskii operator: Krejci & Kuhnen, IEE Proc. 148 (2001) 185"
    family = "geometry"

    compliance: Array = parameter(
        null=0.0, unit="m/N", lower=0.0, upper=1e-6, symbol="1/k_m", doc="compliance of the fixture"
    )
    where: str = variant("read-out", ("read-out", "series"), "seen by the sensor only, or between contact and mass")

    def formula(self) -> str:
        if self.where == "read-out":
            return r"y \to y + \sum_i f_i/k_m"
        return (
            r"x_c = x - \sum_i f_i/k_m: \quad u_i \to u_i + F(u_i)/k_m,"
            r"\quad k_i \to k_i/\left[(1 + K_i/k_m)\,(1 + (K_i - k_i)/k_m)\right],\quad K_i = \sum_{u_j \ge u_i} k_j"
        )

    def reshape(self, bank: Bank) -> Bank:
        if self.where == "read-out":
            return bank
        reach = bank.threshold
        later, same = reach[None, :] > reach[:, None], reach[None, :] >= reach[:, None]
        after = 1.0 + self.compliance * jnp.sum(jnp.where(later, bank.stiffness[None, :], 0.0), axis=1)
        until = 1.0 + self.compliance * jnp.sum(jnp.where(same, bank.stiffness[None, :], 0.0), axis=1)
        softer = until * after
        secant = jnp.sum(jnp.minimum(bank.stiffness[None, :], _ratio(bank.strength[None, :], reach[:, None])), axis=1)
        further = 1.0 + self.compliance * secant
        return Bank(bank.stiffness / softer, bank.strength * further / softer)

    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        if self.where == "series":
            return reading
        return reading + contact_force * self.compliance


def _ratio(force: Array, displacement: Array) -> Array:
    """force/displacement, without limit at zero displacement (an empty element: its own stiffness decides)."""
    empty = displacement <= 0.0
    return jnp.where(empty, jnp.inf, force / jnp.where(empty, 1.0, displacement))
