"""Static creep curves of rough contacts for any (H, h_rms), interpolated in a table that is sorted and searched once.

Heights scale: lines of rms height h under a force F are h times as deep as lines of rms height 1 m under F/h. So the
mean curve of 100 lines depends on H and on one number only, q = F_n / (E* L h_rms), and a table over both serves every
rig with the same number of springs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from ...errors import InputError
from ...physics.contact import Moduli, RoughLines, creep_displacements, default_loads, equal_bodies, static_contact

Array = NDArray[np.float64]
HURST = (0.02, 0.98)
LOADS = 200
_HURST_NODES, _LOAD_NODES = 15, 14
LOAD_RANGE = (2e-4, 5e-1)  # of q: from a few springs in contact to lines pressed nearly flat
_REFERENCE = (1.0, 1e-6)  # length and rms height (m) of the lines the table is made with; it does not depend on them


@dataclass(frozen=True)
class StaticRig:
    """What the static model takes as known.

    Args:
        normal_force: of one contact, N.
        friction: Coulomb friction coefficient.
        contacts: number of equal contacts.
        spring_stiffness: of the drive, N/m.
        length: of the rough line, m.
        n_springs, lines, seed: of the lines whose mean is taken.
        moduli: E* and G* (Pa); default steel on steel.
        guessed: names of those quantities that nobody measured.
    """

    normal_force: float
    friction: float
    contacts: int
    spring_stiffness: float
    length: float = 20e-6
    n_springs: int = 4096
    lines: int = 100
    seed: int = 0
    moduli: Moduli | None = None
    guessed: tuple[str, ...] = ()

    @classmethod
    def of(cls, rig: Any, *, spring_stiffness: float | None = None) -> StaticRig:
        """From what a campaign says of a rig (attributes as in its ``[rig]``; where nobody measured, the guess).

        Args:
            spring_stiffness: of the run, N/m, instead of the rig's.

        Raises:
            InputError: a quantity the static model needs is neither measured nor guessed.
        """
        guessed: list[str] = []

        def known(name: str, unit: str, default: float | None = None) -> float:
            value = getattr(rig, name, None)
            guess: Any = getattr(value, "guess", None)
            if guess is not None:
                guessed.append(name)
                return float(guess)
            value = default if value is None else value
            if value is None:
                raise InputError(
                    f"the static model needs '{name}'",
                    key=f"rig.{name}",
                    hint=f'write  {name} = "... {unit}"  or a guess: {{ guess = "...", lower = "...", upper = "..." }}',
                )
            return float(value)

        stiffness = spring_stiffness or known("spring_stiffness", "N/m")
        steel = (known("youngs_modulus", "Pa", 210e9), known("poisson_ratio", "1", 0.3))
        return cls(
            known("normal_force", "N"),
            known("friction_coefficient", ""),
            int(rig.contacts or 1),
            stiffness,
            known("line_length", "m", 20e-6),
            int(rig.springs or 4096),
            moduli=equal_bodies(*steel),
            guessed=tuple(guessed),
        )

    @property
    def elastic(self) -> Moduli:
        """E* and G*, Pa."""
        return self.moduli or equal_bodies()

    @cached_property
    def _stiff(self) -> tuple[float, float]:
        return float(np.asarray(self.elastic.normal)), float(np.asarray(self.elastic.tangential))

    @property
    def reach(self) -> float:
        """mu E*/G*: displacement at which a spring slides for each unit of its depth."""
        return self.friction * self._stiff[0] / self._stiff[1]

    @property
    def friction_force(self) -> float:
        """Full friction of all contacts, N."""
        return self.contacts * self.friction * self.normal_force

    def crowding(self, h_rms: float) -> float:
        """q = F_n / (E* L h_rms), the number that decides how far the lines are pressed together."""
        return self.normal_force / (self._stiff[0] * self.length * h_rms)

    def rms_range(self) -> tuple[float, float]:
        """Rms heights (m) the table covers for this rig."""
        low, high = LOAD_RANGE
        return self.crowding(1.0) / high, self.crowding(1.0) / low


class StaticTable:
    """Mean displacement of many rough lines over (H, q, tau), cubic in H and ln q.

    Args:
        n_springs, lines, seed: of the lines.

    Attributes:
        tau: loads, shape (T,), 0 to 1.
    """

    def __init__(self, n_springs: int, lines: int, seed: int) -> None:
        self.tau = default_loads(LOADS)
        self._hurst = np.linspace(*HURST, _HURST_NODES)
        self._load = np.linspace(np.log(LOAD_RANGE[0]), np.log(LOAD_RANGE[1]), _LOAD_NODES)
        normal, tangential = (float(np.asarray(m)) for m in equal_bodies())
        length, height = _REFERENCE
        force = np.exp(self._load) * normal * length * height
        made = [RoughLines(float(H), height, length, n_springs=n_springs, lines=lines, seed=seed) for H in self._hurst]
        u = np.stack([creep_displacements(static_contact(m.indentation, force[:, None], 1.0), self.tau) for m in made])
        shape = u * (tangential / normal) / height
        # logarithms, the zero at no load left out: power laws become smooth
        columns = np.log(shape[..., 1:])
        self._logarithm = Bicubic(self._hurst, self._load, columns)

    def shape(self, hurst: float, crowding: float) -> Array:
        """u G* / (mu E* h_rms) at the loads ``tau``, shape (T,)."""
        return np.concatenate([[0.0], np.exp(self._logarithm(hurst, float(np.log(crowding))))])

    def displacement(self, rig: StaticRig, hurst: float, h_rms: float) -> Array:
        """Displacement (m) at the loads ``tau``, shape (T,)."""
        return rig.reach * h_rms * self.shape(hurst, rig.crowding(h_rms))


class Bicubic:
    """Curves interpolated by a cubic spline in two variables, held at the ends of the table.

    Args:
        x, y: nodes, shape (I,) and (J,).
        values: shape (I, J, T).
    """

    def __init__(self, x: Array, y: Array, values: Array) -> None:
        spline = make_interp_spline(x, values, k=3, axis=0)
        self._knots = (spline.t, make_interp_spline(y, values[0], k=3, axis=0).t)
        self._table = make_interp_spline(y, spline.c, k=3, axis=1).c.transpose(1, 0, 2)

    def __call__(self, x: float, y: float) -> Array:
        """The curve there, shape (T,)."""
        (i, wi), (j, wj) = (_weights(k, at) for k, at in zip(self._knots, (x, y), strict=True))
        return np.asarray(np.einsum("i,j,ijt->t", wi, wj, self._table[i : i + 4, j : j + 4]))


def _weights(knots: Array, x: float) -> tuple[int, Array]:
    """First coefficient and the four cubic B-spline weights at ``x``, held at the ends of the table."""
    x = float(np.clip(x, knots[3], knots[-4]))
    i = int(np.clip(np.searchsorted(knots, x, side="right") - 1, 3, knots.size - 5))
    w = np.zeros(4)
    w[0] = 1.0
    for d in range(1, 4):  # Cox-de Boor
        saved = 0.0
        for r in range(d):
            right, left = knots[i + r + 1] - x, x - knots[i + 1 - d + r]
            share = w[r] / (right + left)
            w[r], saved = saved + right * share, left * share
        w[d] = saved
    return i - 3, w


@lru_cache(maxsize=8)
def static_table(n_springs: int = 4096, lines: int = 100, seed: int = 0) -> StaticTable:
    """The table for these lines, made once."""
    return StaticTable(n_springs, lines, seed)


class VirtualCurve(NamedTuple):
    """Displacement (m) against virtual time (s) and velocity (m/s), shape (T,)."""

    t: Array
    u: Array
    v: Array


def virtual_curve(rig: StaticRig, velocity: float, tau: Array, u: Array, form: str = "exact") -> VirtualCurve:
    """The creep curve in time: "exact" F/c_s + u = v0 t; "paper" F = c_s v0 t (Grzemba 2014, eq. 6)."""
    if form not in ("exact", "paper"):
        raise InputError("unknown form of virtual time", value=form, allowed="exact, paper")
    pulled = tau * rig.friction_force / rig.spring_stiffness
    t = (pulled + u if form == "exact" else pulled) / velocity
    return VirtualCurve(t, u, np.gradient(u, t))
