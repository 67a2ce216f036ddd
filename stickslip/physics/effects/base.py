"""What an effect is: a small equinox module that plays one or more roles in an increment of the motion.

An increment is handled as in finite elements: every role maps ``(state at its start, motion)`` to its end, is pure,
continuous, and has no switch that resets a state. Concrete effects are final; roles are abstract (equinox's
"abstract or final"). ``Memory`` gives an effect a state of its own; the other roles say where it acts.
"""

from __future__ import annotations

import abc
import dataclasses
from typing import Any, ClassVar, Literal, NamedTuple

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import Parametrised

_GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 4 / 9), (0.5 + 0.15**0.5, 5 / 18))  # Gauss-Legendre on (0, 1)


class Motion(NamedTuple):
    """One increment of the block's motion, which has at most one turning point.

    Attributes:
        t, dt: time at the end (s) and duration (s).
        x, v: displacement (m) and velocity (m/s) of the block at the end.
        bend: at the share s of the duration the displacement is ``s dx + s (1 - s) bend`` (m): half the duration times
            what the velocity loses; None of a straight path.
        dx: displacement from the start to the end (m).
        load_point: displacement of the load point at the end (m).
        pull: force of the driving spring at the end (N); filled in by the model.
        load: normal load over its median where it was measured, else 1.
    """

    t: Array
    dt: Array
    x: Array
    v: Array
    bend: Array | None
    dx: Array
    load_point: Array
    pull: Array | float = 0.0
    load: Array | float = 1.0

    @property
    def turn(self) -> Array:
        """Displacement from the start to the turning point (m); zero where there is none."""
        if self.bend is None:
            return jnp.zeros(())
        turns = abs(self.dx) < abs(self.bend)
        return jnp.where(turns, 0.25 * (self.dx + self.bend) ** 2 / jnp.where(turns, self.bend, 1.0), 0.0)

    @property
    def path(self) -> Array:
        """Length of the way (m), never negative."""
        return abs(self.turn) + abs(self.dx - self.turn)

    def relax(self, value: Array, gain: Array | float, rest_rate: Array | float, slip_rate: Array | float) -> Array:
        """Solve ``y' = gain - (rest_rate + slip_rate |v|) y`` over the increment from ``y = value``.

        The speed goes linearly to its end value with the path's mean, which is second order whether the relaxation is
        slow or fast against the increment (a constant mean speed is first order where it is fast). Logarithms and
        exponentials of that correction are approximated: exact ones are an eighth of what a step costs.

        Args:
            value: ``y`` at the start; scalar or one per element.
            gain: in units of ``y`` per second.
            rest_rate, slip_rate: 1/s and 1/m, not negative.
        """
        total = rest_rate * self.dt + slip_rate * self.path
        end = rest_rate + slip_rate * abs(self.v) + 1e-12
        whole = end * self.dt
        done = -jnp.expm1(-whole)
        bend = (whole - total) / whole**2
        mean = sum(w * _near_exp(bend * _near_log(s * done) ** 2) for s, w in _GAUSS)
        return value * jnp.exp(-total) + gain * mean * done / end


def _near_log(z: Array) -> Array:
    """``-log(1 - z)`` for z in (0, 0.89): its Padé approximant in z/(2 - z), off by 0.5 % at the upper end."""
    d = 2.0 - z
    n2, d2 = z * z, d * d
    return 2.0 * z * d * (105.0 * d2 - 55.0 * n2) / (105.0 * d2 * d2 - 90.0 * n2 * d2 + 9.0 * n2 * n2)


def _near_exp(x: Array) -> Array:
    """``exp(x)`` for x < 1.2, by a series for the eighth root of its inverse.

    Off by 2e-11 at 0.1, 2e-6 at 1, 5e-5 at -2 and 3 % at -8 of its value.
    """
    y = jnp.maximum(x, -500.0) / 8.0
    root = 1.0 - y * (1.0 - y * (1.0 / 2.0 - y * (1.0 / 6.0 - y / 24.0)))
    return 1.0 / (root * root) ** 4


class Contact(NamedTuple):
    """The bank of Jenkins elements at the start of the increment.

    Attributes:
        force: force of every element (N), shape (n,).
        stiffness: stiffness of every element (N/m), shape (n,).
        strength: cap of every element at full strength, psi = 1 (N), shape (n,).
        spring_force: force of the driving spring at the end of the last increment (N).
        cap: cap of every element as it was last (N), shape (n,).
        mass: inertia of the block (kg).
        rested: share of the caps that is static friction's, mu_s psi over mu_k (1 - psi) + mu_s psi, at the end of the
            increment (1).
    """

    force: Array
    stiffness: Array
    strength: Array
    spring_force: Array
    cap: Array
    mass: Array | float = 0.0
    rested: Array | float = 1.0


class Effect(Parametrised):
    """A physical effect of the catalogue or of a user.

    Class attributes say what a person must know; fields made by :func:`~stickslip.physics.params.parameter` are its
    parameters.

    Attributes:
        tag: name in files and verdicts.
        summary: one line.
        equation: LaTeX of the law, of all its forms at once where it has several (:meth:`formula` has that of one);
            equations side by side have ``,\\quad`` between them.
        symbols: meaning, with the unit, of symbols of the equations that are neither parameters nor of the base model.
        signature: what it does to a measured trace.
        confused_with: tags with a similar signature, each with the experiment that separates the two.
        source: paper or book.
        amplitude: name of the parameter whose null value makes the effect vanish; where it is the only one with such a
            value, those of its bases included, it need not be named.
        generalises: tags of effects that this law contains as special cases; where both describe the data, the special
            case is named.
        exponents: names of inner parameters that make of one formula what the literature has as several forms (linear
            drag, drag by inertia); a verdict says their values beside the name.
        family: under which it is listed: contact, friction, block, geometry, drive or sensor. A drive or a sensor may
            put energy in; all others are held to be passive by the conformance suite.
        periodic: of a wave: the parameter that is its period (or "frequency"), and over what it is periodic: "time",
            "load point" or "displacement". A parameter called ``phase`` gets a value for each run.
        both_ways: whether it is told only where the force on the contact takes both signs; it is not tried elsewhere.
        measured: channel of the record that it needs, such as "normal_load"; it is not tried without.
        drawn: whether its course is one draw at random. Such an effect is simulated; what a measurement says of it is
            a size and a length (:meth:`stickslip.Campaign.levels`), and no course that could be fitted.
    """

    tag: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    equation: ClassVar[str] = ""
    signature: ClassVar[str] = ""
    confused_with: ClassVar[dict[str, str]] = {}
    source: ClassVar[str] = ""
    amplitude: ClassVar[str] = ""
    generalises: ClassVar[tuple[str, ...]] = ()
    exponents: ClassVar[tuple[str, ...]] = ()
    periodic: ClassVar[tuple[str, Literal["time", "load point", "displacement"]] | None] = None
    family: ClassVar[str] = "contact"
    both_ways: ClassVar[bool] = False
    measured: ClassVar[str] = ""
    drawn: ClassVar[bool] = False
    symbols: ClassVar[dict[str, str]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "amplitude" not in vars(cls):
            names = _vanishing(cls)
            cls.amplitude = names[0] if len(names) == 1 else ""

    def formula(self) -> str:
        """LaTeX of the law in the form chosen, equations of its state included; to be overridden where forms differ."""
        return self.equation


def _vanishing(cls: type[Effect]) -> list[str]:
    """Names of the parameters with a null value of a class of which equinox has not made a data class yet."""
    inherited = {
        f.name: f for base in cls.__mro__[1:] if dataclasses.is_dataclass(base) for f in dataclasses.fields(base)
    }
    own = {name: field for name, field in vars(cls).items() if isinstance(field, dataclasses.Field)}
    told = {name: field.metadata.get("spec") for name, field in {**inherited, **own}.items()}
    return [name for name, spec in told.items() if spec is not None and spec.null is not None]


class Memory(Effect):
    """An effect with a state of its own."""

    @abc.abstractmethod
    def start(self, bank: Bank) -> Any:
        """State of a rested contact (a pytree of 64-bit arrays)."""

    @abc.abstractmethod
    def advance(self, state: Any, motion: Motion, contact: Contact) -> Any:
        """State at the end of the increment."""


class Drive(Effect):
    """Moves the load point."""

    @abc.abstractmethod
    def lead(self, t: Array, load_point: Array) -> Array:
        """Displacement (m) added to the load point at time ``t`` (s)."""


class Threshold(Effect):
    """Changes the caps."""

    @abc.abstractmethod
    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        """Factor on the caps, a scalar or one per element (1); below zero counts as zero: an open contact."""


class Stiffness(Effect):
    """Changes the stiffness of the elements."""

    @abc.abstractmethod
    def stiffness(self, state: Any, motion: Motion, contact: Contact) -> Array:
        """Factor on the stiffness, a scalar or one per element (1)."""


class Flow(Effect):
    """Lets the force of stuck elements relax or grow besides the elastic increment."""

    @abc.abstractmethod
    def flow(self, state: Any, motion: Motion, force: Array, contact: Contact) -> Array:
        """Trial forces (N) after the flow; the cap is applied to what is returned."""


class Inertia(Effect):
    """Adds to the mass that moves."""

    @abc.abstractmethod
    def mass(self, mass: Array) -> Array:
        """Moving mass (kg) made of the ``mass`` without the effect."""


class BodyForce(Effect):
    """Pushes the block."""

    @abc.abstractmethod
    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        """Force on the block in the direction of the drive (N)."""


class Spring(Effect):
    """Changes the driving spring."""

    @abc.abstractmethod
    def pull(self, stretch: Array, pull: Array) -> Array:
        """Force of the spring (N) at the elongation ``stretch`` (m), where the linear law gives ``pull`` (N)."""


class Geometry(Effect):
    """Changes the bank before anything moves."""

    @abc.abstractmethod
    def reshape(self, bank: Bank) -> Bank:
        """The bank with the effect in it; total strength kept unless the effect is about strength."""


class Sensor(Effect):
    """Changes what is read, not what happens.

    Class attributes:
        place: where in the chain it stands, whatever the order in which effects are named: ``TARGET`` (what the sensor
            looks at; the default), then ``LOW_PASS``, ``HIGH_PASS``, ``GAIN``, ``OFFSET``.
    """

    TARGET: ClassVar[int] = 0
    LOW_PASS: ClassVar[int] = 1
    HIGH_PASS: ClassVar[int] = 2
    GAIN: ClassVar[int] = 3
    OFFSET: ClassVar[int] = 4

    place: ClassVar[int] = TARGET

    @abc.abstractmethod
    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        """Reading (m) made of the ``reading`` of the sensors before it (m) and the contact's force (N)."""

    def undo(self, t: Array, shown: Array, rate: Array) -> Array | None:
        """What is read (m) before this sensor, shape (n,), or None for what a few passes of :meth:`read` tell of it.

        To be overridden by a filter that loses or delays much of what it is to show.

        Args:
            t: time at the knots (s), shape (n,), which may lie close together.
            shown: what is read after it (m).
            rate: of that (m/s), smoothed.
        """
        return None

    def rising(self, state: Any, rate: Array) -> Array:
        """A number of the sign of the reading's rate, made of that of the sensors before it (at first the velocity).

        What is measured of an arrest is the top of the reading. To be overridden by a sensor that is late: its reading
        still rises when the block stands.
        """
        return rate
