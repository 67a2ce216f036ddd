"""Rough lines as a user states them: from roughness to heights, to a table of indentation, to a contact."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError
from ...system.object_repr import quantity
from ._ranges import check_within
from .elastic import Moduli, equal_bodies
from .indentation import Indentation, indentation
from .profiles import Profile, from_heights
from .roughness import check_line, line_phasors, lines_from_phasors
from .tangential import StaticContact, checked_load, static_contact
from .touching import touching

LENGTHS = ("h_rms", "length", "roll_off", "cut_off")


def _checked(what: str, key: str, default: float | None, unit: str = "m", below: float | None = None) -> Any:
    """A field above zero, from a number or text with a unit; None where it may be left out."""

    def read(value: Any) -> Any:
        if value is None and default is None:
            return None
        return check_within(what, value, above=0.0, below=below, key=key, unit=unit)

    return eqx.field(default=default, converter=read, kw_only=default is None)


class RoughLines(eqx.Module):
    """Periodic self-affine lines with zero mean and random phases. Defaults: the paper's surface (Grzemba 2014).

    Line i of a seed keeps its phases whatever H, the rms height, ``lines`` and ``n_springs`` are (a finer line adds
    short waves to the same long ones), so differences between parameters are not hidden by chance. Differentiable in
    H, ``h_rms``, ``length``, ``roll_off`` and ``cut_off``. Lengths may be text with a unit, such as ``"2.5 um"``.

    Fields:
        H: Hurst exponent in (0, 1).
        h_rms: rms height of a line, m; or (lines,) for unequal ones.
        length: of a line, m.
        n_springs: points of a line, an even number. At small H the contact depends on it: quote it with every result.
        lines: how many.
        seed: of the phases.
        roll_off: wavelength in m above which the spectrum is flat. Default: none.
        cut_off: wavelength in m below which there is no roughness. Default: down to two spacings.

    Raises:
        InputError: a value out of its range.
    """

    H: ArrayLike = _checked("the Hurst exponent", "H", 0.3, unit="", below=1.0)
    h_rms: ArrayLike = _checked("the rms height", "h_rms", 2.46e-6)
    length: ArrayLike = _checked("the length of the line", "length", 20e-6)
    n_springs: int = eqx.field(default=4096, static=True, kw_only=True)
    lines: int = eqx.field(default=100, static=True, kw_only=True)
    seed: int = eqx.field(default=0, static=True, kw_only=True)
    roll_off: ArrayLike | None = _checked("the roll-off wavelength", "roll_off", None)
    cut_off: ArrayLike | None = _checked("the cut-off wavelength", "cut_off", None)

    def __check_init__(self) -> None:
        check_line(self.lines, self.n_springs)
        if jnp.ndim(self.h_rms) > 0 and jnp.shape(self.h_rms) != (self.lines,):
            counts = f"{jnp.size(self.h_rms)} for {self.lines} lines"
            raise InputError("rough lines have one rms height, or each its own", key="h_rms", value=counts)

    def __repr__(self) -> str:
        said = [f"{key}={quantity(value, 'm')}" for key, value in self._lengths.items()]
        counts = f"n_springs={self.n_springs}, lines={self.lines}, seed={self.seed}"
        return f"RoughLines(H={quantity(self.H)}, {', '.join(said)}, {counts})"

    @property
    def dx(self) -> ArrayLike:
        """Spacing of the springs, m."""
        return self.length / self.n_springs

    @property
    def heights(self) -> Array:
        """(lines, n_springs) heights, m."""
        return lines_from_phasors(self.H, self._phasors, **self._waves) * jnp.reshape(jnp.asarray(self.h_rms), (-1, 1))

    @property
    def indentation(self) -> Indentation:
        """Sorted table of the lines, for any load."""
        return _table(self.H, self._phasors, self.dx, self._waves).scaled(self.h_rms)

    def contact(
        self, normal_force: ArrayLike | str = 0.31, friction: ArrayLike = 0.21, moduli: Moduli | None = None
    ) -> StaticContact:
        """Contacts of these lines, pressed and pulled, each with a line of its own.

        Springs that this load leaves out of contact are not in its table (see `touching`).

        Args:
            normal_force: of one contact, N or text with a unit; or (lines,) for unequal ones.
            friction: Coulomb friction coefficient.
            moduli: E* and G*; default steel on steel.

        Raises:
            InputError: a value out of its range.
        """
        force, friction = checked_load(normal_force, friction)
        force, elastic = jnp.asarray(force), moduli or equal_bodies()
        load = force / (elastic.normal * jnp.asarray(self.dx) * jnp.asarray(self.h_rms))
        table = touching(Profile(_gaps(self.H, self._phasors, self._waves), self.dx), load)
        return static_contact(table.scaled(self.h_rms), force, friction, elastic)

    @property
    def _lengths(self) -> dict[str, ArrayLike]:
        """What is given in metres."""
        return {name: value for name in LENGTHS if (value := getattr(self, name)) is not None}

    @property
    def _phasors(self) -> np.ndarray:
        return line_phasors(self.lines, self.n_springs, self.seed)

    @property
    def _waves(self) -> dict[str, ArrayLike | None]:
        waves = {"roll_off": self.roll_off, "cut_off": self.cut_off}
        return {key: None if wave is None else wave / self.length for key, wave in waves.items()}


@jax.jit
def _table(H: ArrayLike, phasors: ArrayLike, dx: ArrayLike, waves: dict[str, ArrayLike | None]) -> Indentation:
    return indentation(from_heights(lines_from_phasors(H, phasors, **waves), dx))


@jax.jit
def _gaps(H: ArrayLike, phasors: ArrayLike, waves: dict[str, ArrayLike | None]) -> Array:
    return from_heights(lines_from_phasors(H, phasors, **waves), 1.0).gaps
