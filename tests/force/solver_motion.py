"""Stick-slip of a small rig as the solver makes it, and its accepted steps as knots of a motion that is given."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicHermiteSpline

import stickslip as ss
from stickslip.data.segment import Event
from stickslip.inference.force.force_along_motion import Held, Way, along
from stickslip.inference.force.problem import Problem
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Effect
from stickslip.physics.model import Model
from stickslip.physics.params import specs
from stickslip.simulation.conformance.rig import base_model
from stickslip.simulation.solve import Steps, Tolerance, integrate

STRENGTH = 0.2604  # N, of the rig's contact
TIMES, POSITIONS = np.array([0.0, 0.13, 0.2, 2.2]), np.array([0.0, 0.13e-3, 0.13e-3, 0.53e-3])  # s, m; a short hold
END = 1.7  # s; three slips
KNOTS = 4096  # one size for all, so that one program serves all
DAMPING, HEALING = 15.0, 0.02  # N s/m, s; so that it sticks again after every slip
SPEED = 4e-4  # m/s
SAMPLED = {
    "mass": "0.0894 kg", "spring_stiffness": "1056.62 N/m", "contacts": 4, "normal_force": "0.31 N",
    "friction_coefficient": {"guess": 0.21, "lower": 0.15, "upper": 0.3},
}  # fmt: skip
COARSE = Tolerance(5e-3, 5e-11, 5e-8)

LAWS = [(tag, form) for tag in catalogue.tags() for form in catalogue.forms(catalogue.get(tag))]
GROUPS = [LAWS[i : i + 22] for i in range(0, len(LAWS), 22)]  # compiled together

march = jax.jit(along)


class Slips(NamedTuple):
    """A simulation whose steps are knots.

    Attributes:
        model: that was simulated.
        steps: of the solver.
        way: the motion at the knots, padded.
        turned: first step within which the block turns.
    """

    model: Model
    steps: Steps
    way: Way
    turned: int


def named(law: tuple[str, dict[str, str]]) -> str:
    """The law in words."""
    return " ".join([law[0], *law[1].values()])


def tenth(effect: Effect, share: float = 0.1) -> float:
    """An amplitude a share of the plausible range away from the null."""
    spec = specs(effect)[effect.amplitude]
    null = spec.null or 0.0
    upper = spec.usual[1] if spec.usual else spec.upper
    return null + share * ((upper if upper > null else spec.lower) - null)


@lru_cache(maxsize=8)
def absent(group: int) -> tuple[Effect, ...]:
    """All effects of a group at their null, of which one after the other is given its amplitude: one compilation."""
    return tuple(jax.tree.map(jnp.asarray, catalogue.get(tag)(**form)) for tag, form in GROUPS[group])


def effects_with(law: tuple[str, dict[str, str]], share: float = 0.1) -> tuple[Effect, ...]:
    """The group of a law, in which only this law does anything."""
    group = next(i for i, laws in enumerate(GROUPS) if law in laws)
    effects, at = list(absent(group)), GROUPS[group].index(law)
    effects[at] = valued(effects[at], tenth(effects[at], share))
    return tuple(effects)


def valued(effect: Effect, amplitude: float) -> Effect:
    """The effect with an amplitude."""
    return eqx.tree_at(lambda e: getattr(e, e.amplitude), effect, jnp.asarray(amplitude, float))


def with_effects(model: Model, effects: tuple[Effect, ...]) -> Model:
    """The model with other effects."""
    return Model(model.block, model.bank, model.weakening, model.load_point, effects)


def simulated(effects: tuple[Effect, ...], tolerance: Tolerance = COARSE, knots: int = KNOTS) -> Slips:
    """The rig with effects, from rest to its third slip and on."""
    model = base_model(effects)
    model = eqx.tree_at(
        lambda m: (m.load_point.times, m.load_point.positions, m.block.damping, m.weakening.healing_time),
        model,
        tuple(jnp.asarray(a) for a in (TIMES, POSITIONS, DAMPING, HEALING)),
    )
    trajectory, _ = integrate(model, END, tolerance=tolerance, largest_step=4e-3)
    s = trajectory.steps
    i = np.flatnonzero(s.v[1:] * s.v[:-1] < 0.0)
    return Slips(model, s, way_of(s.t, s.x, s.v, knots), int(i[0]) + 1 if i.size else s.t.size)


def slipping(effect: Effect, end: float, tolerance: Tolerance) -> tuple[Model, Steps]:
    """The rig of :data:`SAMPLED` with an effect, pulled at :data:`SPEED` until ``end`` (s), and the solver's steps."""
    model = eqx.tree_at(
        lambda m: (
            m.load_point.times, m.load_point.positions, m.block.damping, m.weakening.healing_time, m.block.mass,
            m.block.spring_stiffness,
        ),
        base_model((effect,)),
        tuple(jnp.asarray(a) for a in (np.array([0.0, 2.0]), np.array([0.0, 2.0 * SPEED]), 5.0, 0.01, 0.0894, 1056.62)),
    )  # fmt: skip
    return model, integrate(model, end, tolerance=tolerance, largest_step=4e-3)[0].steps


def sampled(steps: Steps, rate: float) -> tuple[Problem, Sequence[Event]]:
    """The motion of the steps as it is read without noise at a rate (Hz), as a fit begins with it, and its slips."""
    t = np.arange(0.0, steps.t[-1], 1.0 / rate)
    x = CubicHermiteSpline(steps.t, steps.x, steps.v)(t)
    trace = ss.Trace.from_arrays("run", time=t, displacement=x, drive_velocity=SPEED, resolution=1e-12, noise=1e-12)
    campaign = ss.Campaign.from_traces([trace], SAMPLED)
    return campaign.prepare().problem, campaign.events[0].events


def way_of(t: np.ndarray, x: np.ndarray, v: np.ndarray, knots: int = KNOTS) -> Way:
    """A motion under the rig's drive, drawn out at rest to the one size."""
    more = knots - t.size
    assert more >= 0
    t = np.concatenate([t, t[-1] + 1e-3 * np.arange(1, more + 1)])
    x, v = np.concatenate([x, np.full(more, x[-1])]), np.concatenate([v, np.zeros(more)])
    ones = np.ones(knots)
    return Way(
        *map(jnp.asarray, (t, x, v, np.interp(t, TIMES, POSITIONS), ones, ones)),
        shape=jnp.zeros(1),
        of=jnp.zeros(knots, int),
        load=ones,
        force=0.0 * ones,
        bend=jnp.concatenate([jnp.zeros(1), -0.5 * jnp.diff(t) * jnp.diff(v)]),
    )


def held(slips: Slips, bends: bool = True) -> Held:
    """What the model holds along it, at the solver's steps; ``bends`` lets it know how fast they slow down."""
    way = slips.way if bends else slips.way._replace(bend=None)
    return at_steps(march(slips.model, way), slips)


def at_steps(values: Any, slips: Slips) -> Any:
    """Arrays over knots, at the solver's steps."""
    return jax.tree.map(lambda a: np.asarray(a)[: slips.steps.t.size], values)
