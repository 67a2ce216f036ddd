"""A force learned from what a model leaves over: for prediction and display, never an explanation.

It is not in the catalogue: no diagnosis tries it and no verdict names it.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import BodyForce, Contact, Memory, Motion, Threshold
from .catalogue import unlisted

REACH = 30.0  # largest weight, in units of the force
PLACES = tuple(f"x{j}" for j in range(1, 11))  # weights of the displacement's splines, from the first to the last
SPEEDS = tuple(f"v{j}" for j in range(1, 7))  # of the velocity's
AGES = tuple(f"a{j}" for j in range(1, 6))  # of those of the time in contact


def spline(place: Array, centres: np.ndarray) -> Array:
    """Cardinal cubic B-splines at their ``centres``, shape of ``place`` (in units of their distance) + (n,)."""
    r = jnp.abs(jnp.asarray(place)[..., None] - centres)
    return jnp.where(r < 1.0, (4.0 - 6.0 * r**2 + 3.0 * r**3) / 6.0, jnp.maximum(2.0 - r, 0.0) ** 3 / 6.0)


def odd_spline(place: Array, n: int) -> Array:
    """The same for functions that are zero at the origin and odd there, ``place`` from 0 to n - 1."""
    centres = np.arange(1, n + 1)
    return spline(place, centres) - spline(place, -centres)


def _place(j: int) -> Any:
    doc = f"force along the track in the direction of the drive, spline {j}"
    return parameter(0.0, unit="1", lower=-REACH, upper=REACH, symbol=f"X_{{{j}}}", doc=doc)


def _speed(j: int) -> Any:
    # never negative: a force that follows the velocity takes energy out
    doc = f"force against the motion, spline {j} of the velocity"
    return parameter(0.0, unit="1", lower=0.0, upper=REACH, symbol=f"V_{{{j}}}", doc=doc)


def _age(j: int) -> Any:
    doc = f"growth of the full friction force, spline {j} of the time in contact"
    return parameter(0.0, unit="1", lower=-REACH, upper=REACH, symbol=f"A_{{{j}}}", doc=doc)


@unlisted
class LearnedForce(Memory, Threshold, BodyForce):
    """Smooth functions of displacement, velocity and time in contact that are added to the forces on the block.

    The first depends on the place alone and so keeps energy; the second is odd in the velocity and opposes it; the
    third changes the caps of the contact by a factor that is always positive, so it opposes the motion as friction
    does. Beyond the data the first fades out and the others go on as they end.
    """

    tag = "learned-force"
    summary = "smooth force of displacement, velocity and time in contact, learned from residuals; no explanation"
    equation = (
        r"F = F_1\,\left[W \sum_{j=1}^{10} (X_j - X_0)\,B(s_x + 2 - j)"
        r" - \mathrm{sign}(\dot x) \sum_{j=1}^{6} V_j\,B_j(s_v)\right],"
        r"\quad \mu \to \mu\,e^{F_1 A/F_s},\quad A = (1 - o) \sum_{j=1}^{5} A_j\,B_j(s_\theta) + o A_0,"
        r"\quad s_x = 7\,(x - x_a)/(x_b - x_a)\ \mathrm{within}\ 0 \ldots 7,"
        r"\quad s_v = 5\,\ln(1 + |\dot x|/v_a)/\ln(1 + v_b/v_a) \le 5,"
        r"\quad s_\theta = 4\,\ln(\theta/\theta_a)/\ln(\theta_b/\theta_a)\ \mathrm{within}\ 0 \ldots 4,"
        r"\quad B(s) = \frac{4 - 6 s^2 + 3 |s|^3}{6}\ (|s| < 1),\; \frac{(2 - |s|)^3}{6}\ (1 \le |s| < 2),"
        r"\quad B_j(s) = B(s - j) - B(s + j),\quad X_0 = \frac{1}{8} \sum_{j=2}^{9} X_j,"
        r"\quad \dot\theta = 1 - |\dot x|\,\theta/D,\quad \theta(0) = 0,\quad \dot o = -|\dot x|\,o/D,\quad o(0) = 1"
    )
    symbols = {
        "F": "force on the block (N)",
        "W": "1 where the data are, fading to 0 over two distances of the splines beyond them",
        "X_j": "weights of the splines of the displacement",
        "X_0": "mean of the inner ones",
        "V_j": "weights of the splines of the velocity",
        "A_j": "weights of the splines of the time in contact",
        "A": "growth of the full friction force, in units of F_1",
        "B": "cubic B-spline",
        "B_j": "cubic B-spline, odd at the origin",
        "s": "place on the scale of the splines",
        "s_x": "displacement in units of the distance of the splines",
        "s_v": "logarithm of the speed in these units",
        r"s_\theta": "logarithm of the time in contact in these units",
        r"\theta": "time in contact (s)",
        "o": "share of the contact that is still the one a record begins with",
    }
    signature = "whatever the model leaves over"
    source = "cubic B-splines; Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425 on learned discrepancies"
    amplitude = "size"
    family = "block"

    size: Array = parameter(0.0, unit="N", lower=0.0, upper=1e4, null=0.0, symbol="F_1", doc="unit of the forces")
    x_low: Array = parameter(0.0, unit="m", lower=-1e3, upper=1e3, symbol="x_a", doc="where the data begin")
    x_high: Array = parameter(1e-3, unit="m", lower=-1e3, upper=1e3, symbol="x_b", doc="where the data end")
    v_low: Array = parameter(1e-4, unit="m/s", lower=1e-12, upper=1e3, symbol="v_a", doc="speed resolved near rest")
    v_high: Array = parameter(1e-2, unit="m/s", lower=1e-12, upper=1e3, symbol="v_b", doc="largest speed in the data")
    age_low: Array = parameter(
        0.1, unit="s", lower=1e-9, upper=1e9, symbol=r"\theta_a", doc="time in contact from which friction changes"
    )
    age_high: Array = parameter(
        10.0, unit="s", lower=1e-9, upper=1e9, symbol=r"\theta_b", doc="longest time in contact in the data"
    )
    slip_distance: Array = parameter(
        1e-6, unit="m", lower=1e-9, upper=1e-2, symbol="D", doc="slip over which the time in contact is lost"
    )
    first: Array = parameter(
        0.0, unit="1", lower=-REACH, upper=REACH, symbol="A_0", doc="friction of the contact that a record begins with"
    )
    x1: Array = _place(1)
    x2: Array = _place(2)
    x3: Array = _place(3)
    x4: Array = _place(4)
    x5: Array = _place(5)
    x6: Array = _place(6)
    x7: Array = _place(7)
    x8: Array = _place(8)
    x9: Array = _place(9)
    x10: Array = _place(10)
    v1: Array = _speed(1)
    v2: Array = _speed(2)
    v3: Array = _speed(3)
    v4: Array = _speed(4)
    v5: Array = _speed(5)
    v6: Array = _speed(6)
    a1: Array = _age(1)
    a2: Array = _age(2)
    a3: Array = _age(3)
    a4: Array = _age(4)
    a5: Array = _age(5)

    def along(self, x: Array) -> Array:
        """Splines of the displacement ``x`` (m), shape of x + (10,)."""
        n = len(PLACES) - 3
        s = (x - self.x_low) / (self.x_high - self.x_low) * n
        inside = jnp.clip(s, 0.0, n)
        fade = jnp.maximum(1.0 - (0.5 * (s - inside)) ** 2, 0.0) ** 2  # over two distances of the splines
        return spline(inside, np.arange(-1, n + 2)) * jnp.asarray(fade)[..., None]

    def against(self, speed: Array) -> Array:
        """Splines of the ``speed`` (m/s, not negative), even on its logarithm, shape of speed + (6,)."""
        n = len(SPEEDS)
        s = jnp.log1p(speed / self.v_low) / jnp.log1p(self.v_high / self.v_low)
        return odd_spline(jnp.clip(s, 0.0, 1.0) * (n - 1), n)

    def aged(self, age: Array) -> Array:
        """Splines of the time in contact (s), even on its logarithm, shape of age + (5,)."""
        n = len(AGES)
        s = jnp.log(jnp.maximum(age, self.age_low) / self.age_low) / jnp.log(self.age_high / self.age_low)
        return odd_spline(jnp.clip(s, 0.0, 1.0) * (n - 1), n)

    def weights(self, names: tuple[str, ...]) -> Array:
        """Values of the parameters of these names, shape (n,)."""
        return jnp.stack([jnp.asarray(getattr(self, name)) for name in names])

    def start(self, bank: Bank) -> tuple[Array, Array]:
        return jnp.zeros(()), jnp.ones(())

    def advance(self, state: tuple[Array, Array], motion: Motion, contact: Contact) -> tuple[Array, Array]:
        age, old = state
        return motion.relax(age, 1.0, 0.0, 1.0 / self.slip_distance), motion.relax(
            old, 0.0, 0.0, 1.0 / self.slip_distance
        )

    def strength(self, state: tuple[Array, Array], motion: Motion, contact: Contact) -> Array:
        age, old = state
        grown = (1.0 - old) * (self.aged(age) @ self.weights(AGES)) + old * self.first
        return jnp.exp(self.size * grown / jnp.sum(contact.strength))

    def force(self, state: tuple[Array, Array], motion: Motion, contact: Contact) -> Array:
        drag = jnp.sign(motion.v) * (self.against(abs(motion.v)) @ self.weights(SPEEDS))
        places = self.weights(PLACES)
        # a constant is strength, and would be a step where the data end; the first and the last spline lie beyond them
        return self.size * (self.along(motion.x) @ (places - jnp.mean(places[1:-1])) - drag)
