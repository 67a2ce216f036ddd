"""How the power law of a contact follows from the rough lines (H, h_rms) behind it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ...data.campaign import Rig, Unmeasured
from ...physics.contact import RoughLines, check_saturation
from .static_table import StaticRig

LINES = 60
OUTPUTS = ("contact.u_max", "contact.p", "contact.spread", "contact.strength")
STEP = 0.05  # of a logarithm, for derivatives
SMOOTHEST = 0.98  # Hurst exponent
LOADS = np.linspace(0.02, 0.98, 49)


class Sensitivity(NamedTuple):
    """How the contact's parameters follow from the quantities of a rough line that nobody measured.

    Attributes:
        names: of k quantities, as in ``[rig]``. outputs: of n parameters of the contact.
        jacobian: derivatives of the logarithms of the parameters in those of the quantities, shape (n, k).
        scatter: covariance of the logarithms of the parameters from one rig's few lines to another's, shape (n, n).
    """

    names: tuple[str, ...]
    outputs: tuple[str, ...]
    jacobian: np.ndarray
    scatter: np.ndarray


class _Lines(NamedTuple):
    """Of many lines: ln(u_max), ln(p), and how far they are from a power law (share of u_max)."""

    u: np.ndarray
    p: np.ndarray
    mismatch: float


def sensitivity(rig: Rig) -> Sensitivity:
    """Derivatives of u_max, p, spread and strength in the unmeasured ones of H, h_rms, L, load, friction and E.

    H, h_rms and L are never measured: they are parameters of the distribution of gaps. Derivatives are central
    differences between the same random lines, towards smaller H alone where it is next to 1.

    Args:
        rig: with H and h_rms (m), be it those that a fit implies.

    Raises:
        InputError: load or friction are neither measured nor guessed; lines in contact over their whole length.
    """
    values = {"H": rig.H, "h_rms": rig.h_rms, "line_length": rig.line_length or StaticRig.length}
    for name, default in (("normal_force", None), ("friction_coefficient", None), ("youngs_modulus", 210e9)):
        if not isinstance(getattr(rig, name), float):
            values[name] = getattr(rig, name) or default
    centre = {name: _known(value) for name, value in values.items() if value is not None}
    contacts = int(rig.contacts or 1)
    columns = []
    for name, value in centre.items():
        low, high = value * np.exp(-STEP), value * np.exp(STEP)
        if name == "H":
            high = min(high, SMOOTHEST)
        ends = [_lines(rig.model_copy(update=centre | {name: v})) for v in (low, high)]
        change = [np.array([e.u.mean(), e.p.mean(), np.log(e.u.std(ddof=1))]) for e in ends]
        strength = 1.0 if name in ("normal_force", "friction_coefficient") else 0.0  # friction times all loads
        columns.append(np.append((change[1] - change[0]) / np.log(high / low), strength))
    middle = _lines(rig.model_copy(update=centre))
    scatter = np.zeros((4, 4))
    scatter[:2, :2] = np.cov(middle.u, middle.p) / contacts + middle.mismatch**2 * np.eye(2)
    scatter[2, 2] = 0.5 / max(contacts - 1, 1)
    keep = [0, 1, 2, 3] if contacts > 1 else [0, 1, 3]
    outputs = tuple(OUTPUTS[k] for k in keep)
    return Sensitivity(tuple(centre), outputs, np.column_stack(columns)[keep], scatter[np.ix_(keep, keep)])


def _known(value: float | Unmeasured) -> float:
    return float(value.guess if isinstance(value, Unmeasured) else value)


def _lines(rig: Rig) -> _Lines:
    """The power law nearest to the creep curve of each of many lines."""
    static = StaticRig.of(rig, spring_stiffness=1.0)
    assert rig.H is not None
    assert rig.h_rms is not None
    H, h_rms = _known(rig.H), _known(rig.h_rms)
    lines = RoughLines(H, h_rms, static.length, n_springs=static.n_springs, lines=LINES, seed=static.seed)
    contact = lines.contact(static.normal_force, static.friction, static.elastic)
    check_saturation(contact.contact_share, key="rig.h_rms")
    curves = np.asarray(contact.displacement(np.append(LOADS, 1.0)[:, None])).T
    reach = curves[:, -1]
    found = np.array([nearest_exponent(LOADS, u[:-1] / u[-1]) for u in curves])
    return _Lines(np.log(reach), found[:, 0], float(np.sqrt(np.mean(found[:, 1] ** 2))))


def nearest_exponent(tau: np.ndarray, share: np.ndarray) -> tuple[float, float]:
    """ln(p) of the backbone tau = 1 - (1 - u/u_max)^p nearest to a creep curve, and their rms distance in u/u_max.

    Args:
        tau: loads, shape (T,), inside (0, 1). share: displacements at them over u_max, shape (T,).
    """

    def residual(x: np.ndarray) -> np.ndarray:
        return -np.expm1(np.log1p(-tau) / np.exp(x[0])) - share

    best = least_squares(residual, [1.0])
    return float(best.x[0]), float(np.sqrt(np.mean(best.fun**2)))
