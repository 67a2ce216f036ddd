"""Rate-and-state friction: a jump with the logarithm of velocity, then a slow answer of the contacts' state."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import first_age, parameter, variant
from .base import Contact, Memory, Motion, Threshold
from .catalogue import register

_GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 4 / 9), (0.5 + 0.15**0.5, 5 / 18))  # Gauss-Legendre on (0, 1)


@register
class RateAndState(Memory, Threshold):
    """Dieterich's ageing law or Ruina's slip law, regularised to be static far below v*.

    With V = |v| + v* the state theta obeys theta' = 1 - V theta/L (ageing) or -(V theta/L) ln(V theta/L) (slip).
    It cannot exceed L/v*, where friction has its full strength; sliding steadily at v it is weaker by the factor
    1 - (b - a) ln(1 + v/v*).
    """

    tag = "rate-and-state"
    summary = "rate-and-state friction (direct effect and evolving state), ageing or slip law"
    equation = (
        r"\mu \to \mu\,[1 + a \ln(V/v^*) + b \ln(v^*\,\theta/L)],\quad V = |\dot x| + v^*,"
        r"\quad \dot\theta = 1 - V\,\theta/L \;\mathrm{or}\; -(V\,\theta/L)\,\ln(V\,\theta/L),"
        r"\quad \theta(0) = (L/v^*)\,(1 - e^{-v^*\,\theta_1/L})"
    )
    symbols = {r"\theta": "state of the contact (s)", "V": "velocity, not below the cut-off (m/s)"}
    signature = "overshoot after arrest; recurrence and slip size follow ln(hold); creep velocity as 1/(time to slip)"
    confused_with = {
        "contact-ageing": "velocity steps in steady sliding: a jump that decays over the slip distance",
        "direct-effect": "velocity steps in steady sliding: a jump that decays over the slip distance",
        "slip-weakening": "slide-hold-slide",
        "velocity-weakening": "holds of 1 s and 25 s",
    }
    source = "Ruina, J. Geophys. Res. 88 (1983) 10359; Rice & Ruina, J. Appl. Mech. 50 (1983) 343"
    generalises = ("contact-ageing", "direct-effect")
    family = "friction"

    evolution: Array = parameter(
        null=0.0, unit="1", lower=-0.02, upper=0.1, symbol="b",
        doc="relative growth of strength per e-fold of the state"
    )  # fmt: skip
    ratio: Array = parameter(
        0.6, unit="1", lower=0.0, upper=2.0, grid=(0.3, 0.7), symbol="a/b",
        doc="direct effect over evolution effect; below 1 friction weakens with velocity", ends=(0.0,)
    )  # fmt: skip
    slip_distance: Array = parameter(
        2e-6, unit="m", lower=1e-8, upper=1e-4, usual=(1e-7, 1e-5), log=True, grid=(5e-7, 5e-6), symbol="L",
        doc="slip over which the state is renewed"
    )  # fmt: skip
    cutoff_velocity: Array = parameter(
        1e-7, unit="m/s", lower=1e-10, upper=1e-4, usual=(1e-9, 1e-6), log=True, grid=(1e-8, 1e-6), symbol="v^*",
        doc="velocity below which friction is static"
    )  # fmt: skip
    first_age: Array = first_age(100.0)
    law: str = variant("ageing", ("ageing", "slip"), "the state grows in stationary contact too, or by slip only")

    def formula(self) -> str:
        rate = r"1 - V\,\theta/L" if self.law == "ageing" else r"-(V\,\theta/L)\,\ln(V\,\theta/L)"
        return (
            r"\mu \to \mu\,[1 + a \ln(V/v^*) + b \ln(v^*\,\theta/L)],\quad V = |\dot x| + v^*,"
            rf"\quad \dot\theta = {rate},\quad \theta(0) = (L/v^*)\,(1 - e^{{-v^*\,\theta_1/L}})"
        )

    def start(self, bank: Bank) -> Array:
        # ln(theta v*/L) of a contact that was renewed first_age ago and has rested since
        return jnp.log(-jnp.expm1(-self.first_age * self._rest_rate))

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        if self.law == "slip":
            return self._slip_law(state, motion)
        share = motion.relax(jnp.exp(state), self._rest_rate, self._rest_rate, 1.0 / self.slip_distance)
        return jnp.log(share)

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        direct = self.ratio * jnp.log1p(abs(motion.v) / self.cutoff_velocity)
        return 1.0 + self.evolution * (direct + state)

    @property
    def _rest_rate(self) -> Array:
        return self.cutoff_velocity / self.slip_distance

    def _slip_law(self, state: Array, motion: Motion) -> Array:
        """The logarithm relaxes with slip towards -ln(V/v*); V goes linearly in time, so V^2 linearly in slip."""
        slip = (self.cutoff_velocity * motion.dt + motion.path) / self.slip_distance
        first = jnp.maximum(2.0 * motion.path / motion.dt - abs(motion.v), 0.0)
        begin, end = ((1.0 + v / self.cutoff_velocity) ** 2 for v in (first, abs(motion.v)))
        done = -jnp.expm1(-slip)
        target = jnp.zeros(())
        for node, weight in _GAUSS:
            back = -jnp.log1p(-node * done) / slip  # share of the slip that lies between the node and the end
            target = target - 0.5 * weight * jnp.log(end + (begin - end) * back)
        return state * jnp.exp(-slip) + target * done
