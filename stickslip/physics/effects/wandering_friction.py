"""Friction whose level wanders."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..contact import Bank
from ..params import parameter, variant
from .base import Contact, Memory, Motion, Threshold
from .catalogue import register

WAVES = 128
HIGHEST = 200.0  # wave number in correlation lengths, beyond which 3e-7 of the variance is left out
# bands evenly spaced up to half a wave number, and in its logarithm beyond: the few parts of the variance at high wave
# numbers make the process as rough over short ways as it is
_EDGES = 0.5 * np.sinh(np.linspace(0.0, np.arcsinh(2.0 * HIGHEST), WAVES + 1))
# one wave in each, at places without a period
_PLACES = np.mod(np.arange(1, WAVES + 1) * 0.5 * (np.sqrt(5.0) - 1.0), 1.0)
FREQUENCY = _EDGES[:-1] + _PLACES * np.diff(_EDGES)
# share of the variance below each wave number: the spectral density is Student's t with three degrees of freedom
_BELOW = 2.0 / np.pi * (_EDGES / np.sqrt(3.0) / (1.0 + _EDGES**2 / 3.0) + np.arctan(_EDGES / np.sqrt(3.0)))
AMPLITUDE = np.sqrt(2.0 * np.diff(_BELOW))
# turned on by numbers without a common period, whatever the draw
TURN = 2.0 * np.pi * np.mod(np.arange(1, WAVES + 1) ** 2 * np.sqrt(2.0), 1.0), np.sqrt(np.arange(2, WAVES + 2))


@register
class WanderingFriction(Memory, Threshold):
    """The logarithm of the caps is one draw of a Gaussian process, along place, slip path or time.

    Its covariance is Matern's, eps^2 (1 + sqrt(3) r) exp(-sqrt(3) r) at a distance of r correlation lengths. The draw
    is a sum of waves, each as large as the spectral density of the process is in its band (Shinozuka & Deodatis 1991),
    whose phases the number of the draw turns. Static and sliding friction wander together or one of them alone: with
    mu = mu_k (1 - psi) + mu_s psi it is mu, mu_s or mu_k that is multiplied.
    """

    tag = "wandering-friction"
    summary = "the level of friction wanders along the track, with the slip path or in time"
    equation = (
        r"\mu \to \mu\,e^{w} \;\mathrm{or}\; \mu + \mu_s\,\psi\,(e^{w} - 1) \;\mathrm{or}\; "
        r"\mu + \mu_k\,(1 - \psi)\,(e^{w} - 1),"
        r"\quad w = \varepsilon\,\sum_j a_j \cos(q_j s/\ell + \varphi_j + n \gamma_j),"
        r"\quad s = x \;\mathrm{or}\; \dot s = |\dot x| \;\mathrm{or}\; s = t,\ \ell = \tau"
    )
    symbols = {
        "w": "logarithm of the level of friction (1)",
        "s": "coordinate along which the level varies: place (m), slip path (m) or time (s)",
        "a_j": "amplitudes of 128 waves: half of the square is the variance of a band of the spectral density (1)",
        "q_j": "wave numbers in correlation lengths, one in each band, up to 200 (1)",
        r"\varphi_j": "phases of the first draw (rad)",
        r"\gamma_j": "turn of a phase from draw to draw (rad)",
    }
    signature = (
        "slips of irregular size: forces at onset and arrest vary together, and are similar in neighbouring slips"
    )
    confused_with = {
        "position-dependent-friction": "a longer track: a wave comes back after its length",
        "wear": "a longer path: a run-in ends, a wander does not",
    }
    source = "Shinozuka & Deodatis, Appl. Mech. Rev. 44 (1991) 191; Hartikainen & Sarkka, MLSP (2010) 379"
    family = "friction"
    drawn = True

    size: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.5, symbol=r"\varepsilon",
        doc="standard deviation of the logarithm of friction"
    )  # fmt: skip
    length: Array = parameter(
        1e-4, unit="m", lower=1e-6, upper=1.0, log=True, grid=(1e-4,), symbol=r"\ell",
        doc="correlation length along place or slip path"
    )  # fmt: skip
    time: Array = parameter(
        10.0, unit="s", lower=1e-3, upper=1e6, log=True, grid=(10.0,), symbol=r"\tau", doc="correlation time"
    )
    draw: Array = parameter(
        0.0, unit="1", lower=0.0, upper=30.0, grid=(0.0,), symbol="n",
        doc="number of the draw: numbers that differ by a half or more give different courses"
    )  # fmt: skip
    along: str = variant("place", ("place", "slip", "time"), "coordinate along which the level varies")
    of: str = variant("both", ("both", "static", "sliding"), "which friction wanders")

    def formula(self) -> str:
        level = {
            "both": r"\mu\,e^{w}",
            "static": r"\mu + \mu_s\,\psi\,(e^{w} - 1)",
            "sliding": r"\mu + \mu_k\,(1 - \psi)\,(e^{w} - 1)",
        }[self.of]
        goes = {"place": "s = x", "slip": r"\dot s = |\dot x|,\quad s(0) = 0", "time": "s = t"}[self.along]
        length = r"\tau" if self.along == "time" else r"\ell"
        return (
            rf"\mu \to {level},\quad w = \varepsilon\,\sum_j "
            rf"a_j \cos(q_j s/{length} + \varphi_j + n \gamma_j),\quad {goes}"
        )

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return state + motion.path

    def course(self, s: Array) -> Array:
        """Logarithm of the level at coordinates in correlation lengths, over its standard deviation; shape as ``s``."""
        first, turns = TURN
        waves = jnp.cos(FREQUENCY * jnp.asarray(s)[..., None] + (first + turns * self.draw))
        return jnp.sum(AMPLITUDE * waves, axis=-1)

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        at = {"place": motion.x / self.length, "slip": state / self.length, "time": motion.t / self.time}[self.along]
        more = jnp.expm1(self.size * self.course(at))
        if self.of == "both":
            return 1.0 + more
        return 1.0 + more * (contact.rested if self.of == "static" else 1.0 - contact.rested)
