"""The block: inertia, driving spring, a bank of Jenkins elements with lagged weakening, and any set of effects.

``m x'' = c_s (load point - x) - c x' - sum(f_i)`` with ``|f_i| <= mu(psi) f_n,i`` and
``mu(psi)/mu_s = r + (1 - r) psi``, ``psi' = (1 - psi)/t_h - |x'| psi/D_c``. The model knows how to take the contact and
the effects through one increment of motion; when increments begin and end is the solver's business.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..errors import InputError
from .contact import Bank
from .contact._ranges import in_si
from .effects.base import (
    BodyForce,
    Contact,
    Drive,
    Effect,
    Flow,
    Geometry,
    Inertia,
    Memory,
    Motion,
    Sensor,
    Spring,
    Stiffness,
    Threshold,
)
from .params import Parametrised, Ranged, parameter


class Block(Ranged):
    """The moving body and the spring that pulls it."""

    mass: Array = parameter(0.0894, unit="kg", lower=1e-9, upper=1e6, doc="mass of the block", symbol="m")
    spring_stiffness: Array = parameter(
        1000.0, unit="N/m", lower=1e-6, upper=1e9, log=True, doc="stiffness of the driving spring", symbol="c_s"
    )
    damping: Array = parameter(
        10.0, unit="N s/m", lower=0.0, upper=1e6, log=True, doc="viscous damping of the block", symbol="c"
    )


class Weakening(Ranged):
    """Lagged weakening of all caps by slip, healing by rest; Coulomb's constant friction in the limit v -> 0."""

    ratio: Array = parameter(
        0.85, unit="1", lower=0.0, upper=1.0, null=1.0, doc="kinetic over static friction", symbol=r"\mu_k/\mu_s"
    )
    slip_distance: Array = parameter(
        1e-6, unit="m", lower=1e-10, upper=1e-2, log=True, doc="slip over which strength is lost", symbol="D_c"
    )
    healing_time: Array = parameter(
        0.02, unit="s", lower=1e-6, upper=1e4, log=True, doc="time over which strength returns", symbol="t_h"
    )

    def advance(self, psi: Array, motion: Motion) -> Array:
        """psi at the end of an increment."""
        rate = 1.0 / self.healing_time
        return motion.relax(psi, rate, rate, 1.0 / self.slip_distance)

    def strength(self, psi: Array) -> Array:
        """Factor mu(psi)/mu_s on the caps."""
        return self.ratio + (1.0 - self.ratio) * psi

    def mean_strength(self, psi0: Array, psi: Array, motion: Motion) -> Array:
        """Mean of the factor over the path of an increment, from psi at its two ends.

        By the law itself: the mean of psi is ``D_c`` times what it loses on the path, healing included. It lies between
        the ends: healing over a long rest is known too coarsely to say more of a short path.
        """
        mean = 0.5 * (psi0 + psi)
        lost = psi0 - psi + (1.0 - mean) * motion.dt / self.healing_time
        moves = motion.path > 1e-6 * self.slip_distance
        along = jnp.where(moves, self.slip_distance * lost / jnp.where(moves, motion.path, 1.0), mean)
        return self.strength(jnp.clip(along, jnp.minimum(psi0, psi), jnp.maximum(psi0, psi)))

    def steady(self, speed: Array) -> Array:
        """psi of steady sliding at ``speed`` (m/s): 1/(1 + v/v_c), v_c = D_c/t_h."""
        return 1.0 / (1.0 + speed * self.healing_time / self.slip_distance)


class LoadPoint(eqx.Module):
    """Piecewise linear displacement of the load point; beyond the last node it goes on at the last velocity.

    Attributes:
        times: nodes (s, or texts with a unit), shape (n,), increasing, n >= 2.
        positions: displacement at the nodes (m, or texts with a unit), shape (n,).
        stretch: elongation of the spring that a record begins with (m); effects on the drive do not see it.

    Raises:
        InputError: fewer than two nodes, other than as many positions, times that do not increase. Traced values are
            not checked.
    """

    times: Array = eqx.field(converter=lambda times: jnp.asarray(in_si(times, "s", key="load_point.times")))
    positions: Array = eqx.field(converter=lambda places: jnp.asarray(in_si(places, "m", key="load_point.positions")))
    stretch: Any = 0.0

    def __check_init__(self) -> None:
        given = self.times.shape, self.positions.shape
        if self.times.ndim != 1 or self.times.size < 2 or given[0] != given[1]:
            what = "a load point needs two times or more, and as many positions"
            raise InputError(what, key="load_point", value=given)
        if not isinstance(self.times, jax.core.Tracer) and np.any(np.diff(np.asarray(self.times)) <= 0.0):
            raise InputError("the times of the load point must increase", key="load_point.times")

    def __call__(self, t: Array) -> Array:
        """Displacement (m) at time ``t`` (s)."""
        i = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        t0, t1 = self.times[i], self.times[i + 1]
        p0, p1 = self.positions[i], self.positions[i + 1]
        return p0 + (p1 - p0) * (t - t0) / (t1 - t0)


class State(eqx.Module):
    """Everything that evolves.

    Attributes:
        x, v: displacement (m) and velocity (m/s) of the block.
        force: force of every Jenkins element (N), shape (n,).
        cap: cap of every element as it was last (N), shape (n,).
        stiffness: stiffness of every element as it was last (N/m), shape (n,); for the books of energy only.
        psi: weakening state, 1 rested ... 0 fully weakened.
        memory: one state for each effect, in their order (``()`` where it has none).
        work: energies since the start (J).
    """

    x: Array
    v: Array
    force: Array
    cap: Array
    stiffness: Array
    psi: Array
    memory: tuple[Any, ...]
    work: Work


class Work(NamedTuple):
    """Energies since the start (J): done by the spring, lost in friction and viscous damping, done by effects.

    ``body`` is the work of effects' forces on the block, and what they give to loaded elements by changing the
    stiffness.
    """

    spring: Array
    friction: Array
    viscous: Array
    body: Array


class Forces(NamedTuple):
    """Forces at the end of an increment (N): pull of the spring, contact (holding back), viscous, of effects.

    Within the increment (J): ``dissipated`` is lost by sliding and flow, ``given`` is what elements store more because
    effects changed their stiffness under load.
    """

    spring: Array
    contact: Array
    viscous: Array
    body: Array
    dissipated: Array
    given: Array

    @property
    def net(self) -> Array:
        return self.spring - self.contact - self.viscous + self.body


class Model(Parametrised):
    """A spring-driven block on a rough contact.

    Attributes:
        block: mass, spring, damping.
        bank: Jenkins elements of all contacts together, at full strength.
        weakening: the base law of friction.
        load_point: where the spring is pulled to.
        effects: what else acts, in the order of application (those of the sensor by their place in its chain).

    Examples:
        Nothing in a model changes; a part is given anew to a copy:

        >>> from dataclasses import replace
        >>> import stickslip as ss
        >>> drive = ss.LoadPoint([0.0, 1.0], [0.0, 50e-6])
        >>> model = ss.Model(ss.Block(mass="50 g"), ss.power_law_bank(0.26, 1e-6, 2.0), ss.Weakening(), drive)
        >>> aged = replace(model, effects=(ss.make_effect("contact-ageing", rate=0.02),))
        >>> stiff = replace(aged, block=replace(aged.block, spring_stiffness="5 N/mm"))
        >>> stiff.block
        Block(mass=50 g, spring_stiffness=5 kN/m, damping=10 N s/m)
        >>> [effect.tag for effect in stiff.effects]
        ['contact-ageing']
    """

    block: Block
    bank: Bank
    weakening: Weakening
    load_point: LoadPoint
    effects: tuple[Effect, ...] = ()

    def shaped(self) -> Bank:
        """The bank with all geometric effects in it."""
        bank = self.bank
        for effect in self.effects:
            if isinstance(effect, Geometry):
                bank = effect.reshape(bank)
        return bank

    def lead(self, t: Array) -> Array:
        """Displacement of the load point (m) at time ``t`` (s), drive effects included."""
        at = self.load_point(t)
        return at + self.load_point.stretch + sum(e.lead(t, at) for e in self.effects if isinstance(e, Drive))

    def mass(self) -> Array:
        """Moving mass (kg), effects included."""
        mass = self.block.mass
        for effect in self.effects:
            if isinstance(effect, Inertia):
                mass = effect.mass(mass)
        return mass

    def pull(self, stretch: Array) -> Array:
        """Force of the spring (N) at the elongation ``stretch`` (m)."""
        force = self.block.spring_stiffness * stretch
        for effect in self.effects:
            if isinstance(effect, Spring):
                force = effect.pull(stretch, force)
        return force

    def rest(self, t: float | Array = 0.0, x: float | Array = 0.0, v: float | Array = 0.0) -> State:
        """A virgin contact: no force in any element, full strength."""
        zero = jnp.zeros(())
        bank = self.shaped()
        return State(
            x=jnp.asarray(x, float),
            v=jnp.asarray(v, float),
            force=jnp.zeros_like(self.bank.stiffness),
            cap=bank.strength,
            stiffness=bank.stiffness,
            psi=jnp.ones(()),
            memory=tuple(e.start(self.bank) if isinstance(e, Memory) else () for e in self.effects),
            work=Work(zero, zero, zero, zero),
        )

    def contact(self, state: State, bank: Bank, t: Array) -> Contact:
        """What effects may know of the contact at the start of an increment."""
        pull = self.pull(self.lead(t) - state.x)
        return Contact(state.force, bank.stiffness, bank.strength, pull, state.cap, self.mass())

    def advance(self, state: State, bank: Bank, contact: Contact, motion: Motion) -> tuple[State, Forces]:
        """Take contact and effects through one increment.

        Args:
            state: at the start.
            bank: :meth:`shaped`, made once.
            contact: :meth:`contact` of the start.
            motion: the increment.

        Returns:
            The state at the end (its ``work`` is not touched) and the forces there.
        """
        motion = motion._replace(pull=self.pull(motion.load_point - motion.x))
        psi = self.weakening.advance(state.psi, motion)
        contact = contact._replace(rested=psi / jnp.maximum(self.weakening.strength(psi), 1e-300))
        memory = tuple(
            e.advance(m, motion, contact) if isinstance(e, Memory) else m
            for e, m in zip(self.effects, state.memory, strict=True)
        )
        cap = bank.strength * self.weakening.strength(psi)
        stiffness = bank.stiffness
        body = jnp.zeros(())
        for e, m in zip(self.effects, memory, strict=True):
            if isinstance(e, Threshold):
                factor = e.strength(m, motion, contact)
                cap = cap * jnp.where(factor < 0.0, 0.0, factor)  # a contact that is pulled open carries nothing
            if isinstance(e, Stiffness):
                stiffness = stiffness * e.stiffness(m, motion, contact)
            if isinstance(e, BodyForce):
                body = body + e.force(m, motion, contact)
        slides = jnp.abs(state.force) >= (1.0 - 1e-9) * state.cap
        law = self.weakening
        bulge = law.mean_strength(state.psi, psi, motion) - 0.5 * (law.strength(state.psi) + law.strength(psi))
        mean_cap = jnp.where(
            slides, 0.5 * (state.cap + cap) + cap * (bulge / jnp.maximum(law.strength(psi), 1e-300)), cap
        )
        compliance = _compliance(stiffness)
        force = _stuck_within(state.force, stiffness, compliance, state.cap, cap, motion)
        slid = jnp.abs(state.force - force)
        trial = force + stiffness * motion.dx
        flow = jnp.zeros(())
        for e, m in zip(self.effects, memory, strict=True):
            if isinstance(e, Flow):
                flowed = e.flow(m, motion, trial, contact)
                flow = flow + jnp.sum((_held(trial, cap) - _held(flowed, cap)) * compliance)
                trial = flowed
        force = _held_back(trial, cap)
        slid = slid + jnp.abs(trial - force)
        given = jnp.zeros(())
        if any(isinstance(e, Stiffness) for e in self.effects):
            given = 0.5 * jnp.sum(state.force**2 * (compliance - _compliance(state.stiffness)))
        forces = Forces(
            spring=jnp.asarray(motion.pull),
            contact=jnp.sum(force),
            viscous=self.block.damping * motion.v,
            body=body,
            dissipated=flow + jnp.sum(slid * compliance * mean_cap),
            given=given,
        )
        return State(motion.x, motion.v, force, cap, stiffness, psi, memory, state.work), forces

    def velocity_slope(self, state: State, bank: Bank, contact: Contact, motion: Motion) -> Array:
        """By how much caps and effects' forces together change with velocity at most, memories apart (N s/m).

        What slides feels the first, not what sticks; it is taken as if all elements did. Zero for most models.
        """

        def forces(v: Array) -> list[Array]:
            now = motion._replace(v=v)
            each = []
            for e, m in zip(self.effects, state.memory, strict=True):
                if isinstance(e, Threshold):
                    each.append(bank.strength * e.strength(m, now, contact))
                if isinstance(e, BodyForce):
                    each.append(e.force(m, now, contact))
            return each

        _, slopes = jax.jvp(forces, (motion.v,), (jnp.ones(()),))
        return jnp.zeros(()) + sum(jnp.sum(jnp.abs(slope)) for slope in slopes)

    def read(self, state: State, motion: Motion, contact_force: Array) -> Array:
        """Displacement (m) that the sensor shows: its effects in the order of their places in the chain."""
        reading = motion.x
        for e, m in self._sensors(state):
            reading = e.read(m, reading, motion, contact_force)
        return reading

    def rising(self, state: State) -> Array:
        """A number of the sign of the reading's rate: the velocity (m/s), unless a sensor is late."""
        rate = state.v
        for e, m in self._sensors(state):
            rate = e.rising(m, rate)
        return rate

    @property
    def late(self) -> bool:
        """Whether the reading may still rise when the block stands."""
        return any(isinstance(e, Sensor) and type(e).rising is not Sensor.rising for e in self.effects)

    def _sensors(self, state: State) -> list[tuple[Sensor, Any]]:
        """The sensors and their memories, in the order of their places in the chain."""
        chain = [(e, m) for e, m in zip(self.effects, state.memory, strict=True) if isinstance(e, Sensor)]
        return sorted(chain, key=lambda link: link[0].place)

    def stored(self, state: State) -> Array:
        """Kinetic energy plus what is stored in the Jenkins elements (J)."""
        return 0.5 * self.mass() * state.v**2 + jnp.sum(0.5 * state.force**2 * _compliance(state.stiffness))


def _held_back(trial: Array, cap: Array) -> Array:
    """Elastic trial forces (N), cut back to the cap."""
    # not jnp.clip, whose derivative weighs ties: a loop of derivatives takes a tenth longer with it;
    # asked so that a cap that is no number gives a force that is none
    return jnp.where(jnp.abs(trial) <= cap, trial, jnp.where(trial < 0.0, -cap, cap))


def _stuck_within(force: Array, stiffness: Array, compliance: Array, cap: Array, after: Array, motion: Motion) -> Array:
    """Forces (N) from which elements go elastically to the end of the increment, its end apart.

    A block that slows down lets go of what slides: an element sticks where its cap, on a line from ``cap`` to
    ``after``, outgrows it.
    """
    if motion.bend is None:
        return force
    sign = jnp.where(motion.bend < 0.0, -1.0, 1.0)
    whole = 2.0 * jnp.abs(motion.bend)
    outgrown = sign * (motion.dx + motion.bend) * stiffness - (after - cap)
    sticks = (outgrown > 0.0) & (outgrown < whole * stiffness)
    # one division for all elements: one for each makes a step with 250 of them a quarter longer
    least = cap - (0.5 / jnp.where(whole > 1e-150, whole, 1.0)) * outgrown**2 * compliance
    return jnp.where(sticks & (sign * force > least), sign * least, force)


def _compliance(stiffness: Array) -> Array:
    """1/k (m/N), zero for an element that holds no spring."""
    empty = stiffness <= 0.0
    return jnp.where(empty, 0.0, 1.0 / jnp.where(empty, 1.0, stiffness))


def _held(trial: Array, cap: Array) -> Array:
    """Energy of a trial force times stiffness (N^2): stored up to the cap, slid off against it beyond."""
    clipped = jnp.clip(trial, -cap, cap)
    return 0.5 * clipped**2 + cap * jnp.abs(trial - clipped)
