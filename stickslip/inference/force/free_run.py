"""The model of a fit along the motion, left to itself: the equation of motion through the measured cycles.

The fit never integrates; here nothing but the integration is asked. Contact, weakening and effects are those of the
fit, the contact is the measured bank itself, and each cycle runs from a measured arrest to the next
(:mod:`stickslip.simulation.shooting`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from ...physics.contact import Bank
from ...physics.effects.base import Motion, Sensor
from ...physics.model import LoadPoint, Model
from ...simulation.shooting import MOST_STEPS, Cycles, Track, run_cycles
from ...simulation.solve.tolerance import Tolerance
from ...system.trace_cache import Program, of_this_package
from .compiled_force import CommonInput, model_of
from .composition import PULL, SCALE
from .force_along_motion import departures
from .point import Point
from .problem import Problem

FINE = Tolerance(3e-4, 6e-12, 6e-9, 6e-3, 1e-7)

# what is kept returns one
export.register_namedtuple_serialization(Track, serialized_name="stickslip.simulation.shooting.Track")


def run_freely(problem: Problem, point: Point, run: int, cycles: Cycles, events: np.ndarray | None = None) -> Track:
    """The model through the cycles of one run.

    Args:
        problem: its composition says which model.
        point: its parameters; what differs from event to event is not used.
        run: number of the run in the problem, whose phases and pull at the start are taken.
        cycles: of that run, arrays (n,).
        events: logarithms of factors on strength and on yield displacements, the power by which these are stretched
            besides, and the logarithm of a factor on kinetic over static friction, in every cycle, shape (n, 4);
            default all events equal.

    Returns:
        The tracks, with a leading axis of cycles.
    """
    c = problem.composition
    turns = {f.name: np.float64(float(f.scale) * point.phases[j, run]) for j, f in enumerate(c.phases)}
    values = {**{n: np.float64(v) for n, v in problem.values(point).items()}, **turns}
    own, force_scale = problem.runs[run].stiffness, problem.runs[run].force_scale
    program = _program(tuple(values), jax.tree.structure(c.effects))
    found: Track = program(
        values, problem.common_input(point), np.float64(np.nan if own is None else own),
        None if force_scale is None else np.float64(force_scale),
        np.zeros((np.size(cycles.start), 4)) if events is None else events,
        cycles, FINE,
    )  # fmt: skip
    return found


class _Elongation(Sensor):
    """What a sensor of the spring's force sees: its elongation, with the sign of the block's displacement."""

    model: Model
    shown: Any  # force over elongation in the displacement that is made of it (N/m)

    def read(self, state: Any, reading: Any, motion: Motion, contact_force: Any) -> Any:
        return -self.model.pull(motion.load_point - reading) / self.shown


class _FromLoadPoint(Sensor):
    """The displacement that is made of that, after all other sensors."""

    model: Model
    place: ClassVar[int] = Sensor.OFFSET + 1

    def read(self, state: Any, reading: Any, motion: Motion, contact_force: Any) -> Any:
        return self.model.load_point(motion.t) + self.model.load_point.stretch + reading


@lru_cache(maxsize=64)
def _program(names: tuple[str, ...], structure: Any) -> Program:
    def one_run(
        values: dict[str, Any], common: CommonInput, own: Any, force_scale: Any, events: Any, cycles: Cycles,
        tolerance: Tolerance,
    ) -> Track:  # fmt: skip
        effects = jax.tree.unflatten(structure, common.effects)

        def build(event: Any, nodes: Any) -> Model:
            strength, stretch = jnp.exp(event[0]), jnp.exp(event[1])
            plain = common.bank
            own_reach = jnp.exp(-event[2] * departures(plain))
            bank = Bank(plain.stiffness * (strength / stretch) * own_reach, plain.strength * strength)
            model = model_of(values, effects, bank, own)
            ratio = model.weakening.ratio * jnp.exp(event[3])
            model = eqx.tree_at(lambda m: m.weakening.ratio, model, ratio)
            begun = jnp.zeros(())
            if PULL in values:
                begun = jnp.where(cycles.virgin, 0.0, values[PULL] / model.block.spring_stiffness)
            model = eqx.tree_at(lambda m: m.load_point, model, LoadPoint(nodes[0], nodes[1], begun))
            if force_scale is None:
                return model
            shown = model.block.spring_stiffness * force_scale / values[SCALE]
            chain = (_Elongation(model, shown), *model.effects, _FromLoadPoint(model))
            return eqx.tree_at(lambda m: m.effects, model, chain)

        return run_cycles(build, events, cycles, tolerance, MOST_STEPS)

    return Program(one_run, f"freely {names} {structure}" if of_this_package(structure) else None)
