"""From a scenario to what the solver takes: a model, its state at the start, and the load point's motion."""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp

from ...errors import InputError
from ...physics.contact import arrest
from ...physics.model import Block, LoadPoint, Model, State, Weakening
from ..solve import Tolerance
from .contacts import Built, build_contact
from .drive import Motion, load_point
from .effects import make_effects
from .load import Scenario


@dataclass(frozen=True)
class Setup:
    """Everything `simulate` needs.

    Attributes:
        model: block, bank, weakening, load point and effects.
        start: state at time zero.
        motion: of the load point.
        contact: bank and facts of the contact.
        tolerance: of the solver.
        offset: elongation of the spring at time zero (m).
    """

    model: Model
    start: State
    motion: Motion
    contact: Built
    tolerance: Tolerance
    offset: float


_rest = eqx.filter_jit(Model.rest)


def build(scenario: Scenario) -> Setup:
    """Make model and initial state.

    A start after a slip event (``contact.residual`` above zero) leaves the spring as much elongated as the contact
    holds back, so that the block is in balance. ``drive.start = "steady"`` gives the block the velocity
    c_s v0/(k_t + c_s) at which contact and spring are loaded together, so that nothing rings.

    Raises:
        InputError: something the file names cannot be used.
    """
    file = scenario.file
    try:
        built = build_contact(file.contact, scenario.folder)
    except InputError as error:
        raise error.at(file=scenario.path) from None
    motion = load_point(file.drive, scenario.folder)
    block = Block(*map(jnp.asarray, (file.block.mass, file.block.spring_stiffness, file.block.damping)))
    law = file.weakening
    residual, force = file.contact.residual, None
    if residual > 0.0:
        force = arrest(built.bank, max(law.ratio, 1e-6), kept=residual)
    offset = 0.0 if force is None else float(force.force) / file.block.spring_stiffness
    points = LoadPoint(jnp.asarray(motion.times), jnp.asarray(motion.positions + offset))
    weakening = Weakening(*map(jnp.asarray, (law.ratio, law.slip_distance, law.healing_time)))
    model = Model(block, built.bank, weakening, points, make_effects(file))
    start = _rest(model)
    if force is not None:
        start = eqx.tree_at(lambda s: s.force, start, force.element_force)
    if file.drive.start == "steady":
        k = file.block.spring_stiffness
        start = eqx.tree_at(lambda s: s.v, start, jnp.asarray(k * motion.first_velocity / (k + built.stiffness)))
    solver = file.solver
    tolerance = Tolerance(*map(jnp.asarray, (solver.relative, solver.displacement, solver.velocity)))
    return Setup(model, start, motion, built, tolerance, offset)
