"""A small campaign made by the model itself: two velocities, exact readings, known parameters."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.inference.features.measurement import Measurement, measure
from stickslip.inference.fit.composition import Composition
from stickslip.inference.fit.parameters import Free
from stickslip.physics.effects.base import Effect
from stickslip.simulation.solve import Tolerance, integrate

TRUTH = {
    "contact.strength": ("N", 0.26),
    "weakening.drop": ("1", 0.18),
    "weakening.slip_distance": ("m", 1.2e-6),
    "weakening.healing_time": ("s", 0.01),
    "rig.damping": ("N s/m", 10.0),
    "contact.u_max": ("m", 0.95e-6),
    "contact.p": ("1", 3.3),
    "contact.spread": ("1", 0.15),
}
PERIOD = 1 / 540.0


def composition(start: dict[str, float] | None = None) -> Composition:
    """The base family of models; starts at the truth unless told otherwise."""
    free = []
    for name, (unit, value) in TRUTH.items():
        at = (start or {}).get(name, value)
        most = 0.9 if name in ("weakening.drop", "contact.spread") else 20 * value
        least = 1.1 if name == "contact.p" else value / 20
        free.append(Free(name, unit, "log", at, value, 1.0, least, most))
    return Composition(0.0894, 4, 48, tuple(free), {"rig.spring_stiffness": 1000.0})


def truth() -> np.ndarray:
    """The true parameters on the search scale."""
    return np.log([value for _, value in TRUTH.values()])


def traces(
    velocities: tuple[float, ...] = (1e-4, 2e-4), slips: float = 3.6, rate: float = 1e4, effect: Effect | None = None
) -> list[Trace]:
    """Runs from a virgin start, sampled without noise, with ``effect``."""
    family = composition() if effect is None else composition().with_effect(effect, ())
    out = []
    for v in velocities:
        stop = 0.26 / (1000.0 * v) + slips * 52e-6 / v
        nodes = (jnp.array([0.0, 1.0]), jnp.array([0.0, v]))
        model = family.model(jnp.asarray(truth()), jnp.zeros(2), nodes, jnp.asarray(np.nan))
        run, _ = integrate(model, stop, tolerance=Tolerance(1e-5, 1e-14, 1e-10), largest_step=0.005)
        t = np.arange(0.0, stop, 1.0 / rate)
        drive = Drive.constant(v, 0.0, stop)
        out.append(Trace(name=f"v{v * 1e6:.0f}", time=t, displacement=run.at(t).reading, drive=drive, virgin=True))
    return out


def measured(found: list[Trace]) -> Measurement:
    """Features of the runs."""
    return measure(found, [segment(t) for t in found], ring_period=PERIOD)
