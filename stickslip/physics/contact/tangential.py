"""Tangential loading of a contact under constant normal force, in closed form.

The Ciavarella-Jaeger theorem, exact for a spring foundation: F_t(u) = mu [F_n(d) - F_n(d - G* u/(mu E*))]. The second
term is the normal force at which only the part that still sticks would touch.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import ArgumentError
from ...system.object_repr import quantity
from ._ranges import check_within
from .elastic import Moduli, equal_bodies
from .indentation import Indentation


class StaticContact(eqx.Module):
    """A contact pressed by a constant normal force and pulled from the force-free state.

    Fields broadcast against the leading axes of ``indentation`` (lines last), as do the arguments of the methods.

    Fields:
        indentation: table of the lines.
        normal_force: F_n in N, of one contact.
        friction: Coulomb friction coefficient mu of every spring.
        moduli: E* and G* in Pa.
    """

    indentation: Indentation
    normal_force: ArrayLike
    friction: ArrayLike
    moduli: Moduli

    def __repr__(self) -> str:
        gaps = np.shape(self.indentation.gaps)
        lines, springs = math.prod(gaps[:-1]), self.indentation.springs or math.prod(gaps[-1:])
        return (
            f"StaticContact(normal_force={quantity(self.normal_force, 'N')}, friction={quantity(self.friction)}, "
            f"moduli={self.moduli!r}, lines={lines}, n_springs={springs})"
        )

    @property
    def depth(self) -> Array:
        """Indentation depth d of the highest point, m."""
        return self.indentation.depth(self.normal_force, self.moduli.normal)

    @property
    def strength(self) -> Array:
        """Largest tangential force mu F_n, N."""
        return jnp.asarray(self.friction * self.normal_force)

    @property
    def u_max(self) -> Array:
        """Displacement mu (E*/G*) d at which the last spring slides, m (Grzemba 2014, eq. 4).

        Where the highest spring of an analytic profile lies beside its apex (gap above zero), sliding is complete a
        little earlier, at ``displacement(1.0)``.
        """
        return self.depth * self._reach

    @property
    def stiffness(self) -> Array:
        """Tangential stiffness (G*/E*) dF_n/dd of the unloaded contact, N/m."""
        return self.indentation.contact_length(self.depth) * self.moduli.tangential

    @property
    def contact_share(self) -> Array:
        """Share of the springs in contact (see `check_saturation`)."""
        return self.indentation.contact_share(self.depth)

    def force(self, u: ArrayLike) -> Array:
        """Tangential force F_t in N at displacement ``u >= 0`` in m."""
        sticking = self.indentation.force(self.depth - u / self._reach, self.moduli.normal)
        return jnp.asarray((self.normal_force - sticking) * self.friction)

    def displacement(self, tau: ArrayLike) -> Array:
        """Displacement u in m at the share ``tau`` (0 to 1) of the full friction force; the inverse of `force`."""
        left = self.indentation.depth((1.0 - jnp.asarray(tau)) * self.normal_force, self.moduli.normal)
        return (self.depth - left) * self._reach

    @property
    def _reach(self) -> Array:
        """Tangential displacement at which a spring slides for each unit of its depth, mu E*/G*."""
        return jnp.asarray(self.friction) * self.moduli.normal / self.moduli.tangential


def static_contact(
    table: Indentation, normal_force: ArrayLike | str, friction: ArrayLike, moduli: Moduli | None = None
) -> StaticContact:
    """`StaticContact` after a check of the ranges; a force may be text with a unit; default moduli: steel on steel."""
    return StaticContact(table, *checked_load(normal_force, friction), moduli or equal_bodies())


def checked_contact(contact: StaticContact) -> StaticContact:
    """The contact; an error says how to make one of what is none."""
    if not isinstance(contact, StaticContact):
        hint = "ss.RoughLines(H=0.3).contact(), or stickslip.physics.contact.static_contact(...) of any profile"
        raise ArgumentError("not a contact", key="contact", value=contact, hint=hint)
    return contact


def checked_load(normal_force: ArrayLike | str, friction: ArrayLike) -> tuple[ArrayLike, ArrayLike]:
    """Normal force (N) and friction coefficient; InputError unless both are above zero."""
    load = check_within("the normal force", normal_force, above=0.0, key="normal_force", unit="N")
    return load, check_within("the friction coefficient", friction, above=0.0, key="friction")
