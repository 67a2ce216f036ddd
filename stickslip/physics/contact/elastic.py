"""Effective moduli of two elastic half-spaces in contact."""

from __future__ import annotations

from typing import NamedTuple

from jax.typing import ArrayLike

from ...system.object_repr import quantity
from ._ranges import check_within


class Moduli(NamedTuple):
    """Effective moduli in Pa: ``normal`` E* and ``tangential`` G*."""

    normal: ArrayLike
    tangential: ArrayLike

    def __repr__(self) -> str:
        return f"Moduli(normal={quantity(self.normal, 'Pa')}, tangential={quantity(self.tangential, 'Pa')})"


def equal_bodies(youngs_modulus: ArrayLike | str = 210e9, poisson_ratio: ArrayLike = 0.3) -> Moduli:
    """E* = E/(2(1 - nu^2)) and G* = 2G/(2 - nu) of two bodies of one material (Grzemba 2014, eq. 1); default steel.

    Args:
        youngs_modulus: E in Pa or text with a unit, above zero.
        poisson_ratio: nu in (-1, 0.5].

    Raises:
        InputError: a value out of its range.
    """
    return two_bodies(youngs_modulus, poisson_ratio, youngs_modulus, poisson_ratio)


def two_bodies(
    youngs_1: ArrayLike | str, poisson_1: ArrayLike, youngs_2: ArrayLike | str, poisson_2: ArrayLike
) -> Moduli:
    """Effective moduli of two different bodies: 1/E* and 1/G* are the sums of (1 - nu^2)/E and (2 - nu)/(4G).

    Source: Mindlin 1949; Johnson, Contact Mechanics, sections 4.2 and 7.2. Elastic similarity is assumed, that is
    normal and tangential displacement do not couple.

    Raises:
        InputError: a value out of its range.
    """
    normal: ArrayLike = 0.0
    tangential: ArrayLike = 0.0
    for young, poisson in ((youngs_1, poisson_1), (youngs_2, poisson_2)):
        E = check_within("Young's modulus", young, above=0.0, key="youngs_modulus", unit="Pa")
        nu = check_within("Poisson's ratio", poisson, above=-1.0, to=0.5, key="poisson_ratio")
        normal = normal + (1.0 - nu**2) / E
        tangential = tangential + (2.0 - nu) * (1.0 + nu) / (2.0 * E)
    return Moduli(1.0 / normal, 1.0 / tangential)
