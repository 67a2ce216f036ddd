"""Laws of geometry fitted to the measured backbone: the rough line, and what changes its shape besides.

Along the motion the backbone is free, so an effect that only shapes it changes nothing there. What it does is asked
here, of the measured curve: how far is it from that of rough lines (H, h_rms), and is it nearer with the effect on top?

Curves are compared as the logarithm of the displacement at given shares of the full friction, for there most of what
differs from one rig's contacts to another's is a constant. The covariance has three parts: that of the measured curve;
that of contacts with other lines of the same surface, by far the largest where they are few; and what the polygon of a
bank cannot follow of a smooth curve. The full strength is as measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares

from ...data.campaign import Unmeasured
from ...physics.contact import Bank
from ...physics.effects import catalogue
from ...physics.effects.base import Geometry
from ..fit.parameters import Free, effect_parameters, to_si, vector
from ..fit.static_table import HURST, StaticRig
from .backbone import Backbone
from .candidates import grid, shapes_backbone
from .linearised import Array
from .rough_contacts import rough_contacts

COMPARED = (0.02, 0.98)  # shares of the strength between which curves are compared
ROUNDS = 2  # times that the covariance is taken at the line that was found
BETWEEN = 0.04  # from one Hurst exponent to the next at which lines are sought
FEWEST = 8  # of them
HELD = 1e-6  # to either side of one that is held
STARTS = (0.03, 0.3)  # of an amplitude, over its range
STEP, WIDE = 1e-3, 0.5  # of derivatives, on the search scale: of the line and of an amplitude
STIFF = 1e-4  # of the strength: what is measured better serves no purpose
EDGE = 1e-6  # of the range of a parameter, within which no search begins
HALVINGS = 12
SEEN = 5.0  # standard deviations of the smallest visible amplitude
ROUGHNESS = ("H", "h_rms")
GUESSED = ("normal_force", "friction_coefficient", "youngs_modulus", "poisson_ratio", "line_length")
SEVERAL = "unequal-contacts"  # means nothing where there is one


@dataclass(frozen=True)
class RoughLine:
    """Contacts of rough lines that have a backbone.

    Attributes:
        hurst, h_rms: Hurst exponent, its mean under the likelihood, and the rms height that goes with it (m); effective
            numbers of the distribution of gaps.
        hurst_std, h_rms_std, correlation: root mean square distances of the two from these under the likelihood, other
            lines of the same surface included; zero where a number of the rig was taken as it is.
        stated: those of the two that the rig states.
        contacts, springs, length: of the contacts: number, springs of a line, its length (m).
        guessed: quantities of the rig that are guesses, whose priors are in the deviations.
        cost: chi-square, priors included.
        misfit: root of chi-square over the number of degrees of freedom.
        edge: whether it is the last line that there is.
        force: of the law at the backbone's displacements (N), shape (n,).
        scatter: how far other contacts of the same surface lie from it there, one deviation (N), shape (2, n).
    """

    hurst: float
    h_rms: float
    hurst_std: float
    h_rms_std: float
    correlation: float
    stated: tuple[str, ...]
    contacts: int
    springs: int
    length: float
    guessed: tuple[str, ...]
    cost: float
    misfit: float
    edge: bool
    force: Array
    scatter: Array


@dataclass(frozen=True)
class Shaped:
    """A rough line with an effect on top that changes its shape.

    Attributes:
        tag, form, inner: of the effect: variants and inner parameters.
        free: its amplitude as it was sought. amplitude, std: (SI); the deviation is infinite where the curve does not
            depend on it.
        members: how many values of the inner parameters were tried.
        gain: fall of chi-square.
        visible: amplitude that would be five standard deviations (SI, distance from the null); None where none is.
        hurst, h_rms: of the line beneath (m).
        force: of the law at the backbone's displacements (N), shape (n,).
    """

    tag: str
    form: dict[str, str]
    inner: dict[str, float]
    free: Free
    amplitude: float
    std: float
    members: int
    gain: float
    visible: float | None
    hurst: float
    h_rms: float
    force: Array


@dataclass(frozen=True)
class Laws:
    """What rough lines say of a backbone.

    Attributes:
        line: with what the rig states of its roughness.
        unstated: the same without, where it states something.
        shaped: each effect on top of ``line``, in the form and member that fits best.
    """

    line: RoughLine
    unstated: RoughLine | None
    shaped: tuple[Shaped, ...]


def geometry_laws(curve: Backbone, rig: Any, tags: Sequence[str] | None = None) -> Laws:
    """Fit the rough line to a backbone, and every effect that shapes it on top, by generalised least squares.

    H and h_rms are free, or as the rig states them: a number is taken as it is, a guess with bounds as a prior. So are
    load, friction, elasticity and length where they are guesses; load times friction is then what was measured.

    Args:
        curve: measured, with its covariance.
        rig: ``[rig]`` of the campaign.
        tags: of effects; default the whole catalogue. Those that do more than shape the backbone are passed over.

    Raises:
        InputError: load or friction are neither measured nor guessed.
    """
    comparison = _Comparison(curve, rig)
    line, nearest = comparison.rough_line()
    unstated = None
    if line.stated:
        unstated, _ = _Comparison(curve, rig.model_copy(update=dict.fromkeys(ROUGHNESS))).rough_line()
    shaped = []
    for tag in catalogue.tags() if tags is None else tags:
        cls = catalogue.get(tag)
        forms = [form for form in catalogue.forms(cls) if shapes_backbone(cls(**form))]
        if forms and not (tag == SEVERAL and comparison.contacts == 1):
            shaped.append(comparison.shaped(tag, forms, nearest))
    return Laws(line, unstated, tuple(shaped))


def rough_line(curve: Backbone, rig: Any) -> RoughLine:
    """The rough line alone; arguments and errors as of :func:`geometry_laws`."""
    return _Comparison(curve, rig).rough_line()[0]


@dataclass(frozen=True)
class _Solution:
    """Parameters on the search scale, their covariance, chi-square and its derivatives' rows."""

    z: Array
    covariance: Array
    cost: float
    rows: Array


@dataclass(frozen=True)
class _Added:
    """An effect whose amplitude is sought, its inner parameters held."""

    tag: str
    form: dict[str, str]
    inner: dict[str, float]

    @cached_property
    def free(self) -> Free:
        """The amplitude."""
        (found,) = (f for f in effect_parameters(catalogue.get(self.tag)(**self.form, **self.inner)) if f.amplitude)
        return found

    @property
    def span(self) -> tuple[float, float]:
        """Null of the amplitude and the bound furthest from it, on the search scale."""
        free, null = self.free, catalogue.amplitude(catalogue.get(self.tag)).null or 0.0
        far = max(free.lower, free.upper, key=lambda v: abs(v - null))
        return free.inward(null), free.inward(far)

    def reshape(self, bank: Bank, amplitude: float) -> Bank:
        """The bank with the effect in it."""
        cls = catalogue.get(self.tag)
        effect = cls(**self.form, **{**self.inner, cls.amplitude: jnp.asarray(amplitude)})
        assert isinstance(effect, Geometry)
        return effect.reshape(bank)


class _Comparison:
    """A backbone beside the laws of one rig."""

    def __init__(self, curve: Backbone, rig: Any) -> None:
        self.curve, self.rig = curve, rig
        start = StaticRig.of(rig, spring_stiffness=1.0)
        self.contacts, self.springs = start.contacts, start.n_springs
        self.table = rough_contacts(self.contacts, self.springs)
        self.strength = float(curve.force[-1])
        # up to its first yield displacement the backbone is straight because a bank is
        least = max(COMPARED[0], float(curve.force[0]) / self.strength)
        sparse = self.table.tau[self.table.sparse]
        self.at = np.flatnonzero((sparse > least) & (sparse < COMPARED[1]))
        self.tau = sparse[self.at]
        self.measured, self.own = in_logarithms(curve, self.tau)
        self.stated = tuple(name for name in ROUGHNESS if getattr(rig, name) is not None)
        self.free = _free(rig, start, self.strength)
        # load and friction that are both stated say nothing of each other: the strength is as measured
        loose = {"normal_force", "friction_coefficient"} & {f.name for f in self.free}
        self.strength_std = max(float(curve.std[-1]) / self.strength, STIFF) if loose else np.inf
        self.white = np.eye(self.at.size)

    def rough_line(self) -> tuple[RoughLine, _Solution]:
        """The line, and the nearest one under the covariance at it, which stays from then on."""
        z, covariance = self._likely()
        self._whiten(z)
        at = _Solution(z, covariance, self._chi_square(z), self._slopes(self.free, z, None))
        (hurst, h_rms), deviations, correlation = self._roughness(at)
        freedom = max(self.at.size - sum(not np.isfinite(f.width) for f in self.free), 1)
        values = self._values(z)
        made = RoughLine(
            hurst, h_rms, *deviations, correlation, self.stated, self.contacts, self.springs,
            self._static(values).length, tuple(f.name for f in self.free if f.name in GUESSED), at.cost,
            float(np.sqrt(at.cost / freedom)), self._edge(z), self._force(values, None, 0.0), self._scatter(values),
        )  # fmt: skip
        return made, min(self._solve(self.free, z), at, key=_cost)

    def _likely(self) -> tuple[Array, Array]:
        """Parameters at the mean H under the likelihood, and mean square distances from them.

        Contacts of another H differ by more or less, so their covariance depends on it, and the likelihood along H may
        be flat on one side, or have several maxima: it is gone through on a grid.
        """
        if not self._is("H").any():
            _, z, covariance = self._beneath(None)
            return z, covariance
        low, high = self.free[int(np.argmax(self._is("H")))].bounds
        hursts = np.linspace(low, high, max(int(np.ceil((high - low) / BETWEEN)), FEWEST) + 1)
        found = [self._beneath(h) for h in hursts]
        weights = np.exp(-0.5 * (np.array([fall for fall, _, _ in found]) - min(fall for fall, _, _ in found)))
        weights /= weights.sum()
        _, z, _ = self._beneath(float(weights @ hursts))
        spread = [covariance + np.outer(at - z, at - z) for _, at, covariance in found]
        return z, np.asarray(np.tensordot(weights, spread, 1))

    def _beneath(self, hurst: float | None) -> tuple[float, Array, Array]:
        """Twice the negative logarithm of the likelihood at a Hurst exponent, all else at its best, and where that is.

        The covariance is that of all else.
        """
        free, z = self.free, vector(self.free)
        held = self._is("H") if hurst is not None else np.zeros(z.size, bool)
        if hurst is not None:
            z = np.where(held, hurst, z)
            free = tuple(
                replace(f, lower=hurst - HELD, upper=hurst + HELD) if there else f
                for f, there in zip(free, held, strict=True)
            )
        for _ in range(ROUNDS):
            self._whiten(z)
            found = self._solve(free, z)
            z = found.z
        self._whiten(z)
        covariance = np.zeros((z.size, z.size))
        covariance[np.ix_(~held, ~held)] = _inverse(found.rows[:, ~held])
        return self._chi_square(z) + 2.0 * float(np.log(np.diag(self.white)).sum()), z, covariance

    def _chi_square(self, z: Array) -> float:
        return float((self._residual(self.free, z, None) ** 2).sum())

    def shaped(self, tag: str, forms: Sequence[dict[str, str]], line: _Solution) -> Shaped:
        """An effect on top, in its best form and member: each has one parameter more than the line."""
        cls = catalogue.get(tag)
        tried = [_Added(tag, form, inner) for form in forms for inner in grid(cls(**form))]
        found = []
        for added in tried:
            null, far = added.span
            begun = (np.append(line.z, null + share * (far - null)) for share in STARTS)
            found.append((min((self._solve((*self.free, added.free), b, added) for b in begun), key=_cost), added))
        best, added = min(found, key=lambda pair: pair[0].cost)
        free, value = added.free, float(best.z[-1])
        seen = [v for v in (self._visible(line.z, a) for a in tried) if v is not None]
        (hurst, h_rms), _, _ = self._roughness(best)
        std = np.sqrt(best.covariance[-1, -1]) * free.slope(value) if (best.rows[:, -1] != 0.0).any() else np.inf
        return Shaped(
            tag, added.form, added.inner, free, free.outward(value), float(std), len(tried),
            max(line.cost - best.cost, 0.0), min(seen, default=None), hurst, h_rms,
            self._force(self._values(best.z), added, value),
        )  # fmt: skip

    def _is(self, name: str) -> NDArray[np.bool_]:
        return np.array([f.name == name for f in self.free], bool)

    def _values(self, z: Array) -> dict[str, float]:
        """H, h_rms and what is guessed of the rig (SI)."""
        given = {name: float(value) for name in ROUGHNESS if isinstance(value := getattr(self.rig, name), float)}
        return given | to_si(self.free, z[: len(self.free)])

    def _static(self, values: dict[str, float]) -> StaticRig:
        rig = self.rig.model_copy(update={k: v for k, v in values.items() if k in GUESSED})
        return StaticRig.of(rig, spring_stiffness=1.0)

    def _whiten(self, z: Array) -> None:
        values = self._values(z)
        line = self.table.covariance(self._static(values), values["H"], values["h_rms"])[np.ix_(self.at, self.at)]
        self.white = cholesky(line + self.own, lower=True)

    def _law(self, values: dict[str, float], added: _Added | None, amplitude: float) -> tuple[Array, Array, float]:
        """Displacements (m) and the shares of the full strength reached there, and that strength (N)."""
        static = self._static(values)
        u = self.table.displacement(static, values["H"], values["h_rms"])
        slope = np.diff(static.friction_force * self.table.tau, prepend=0.0) / np.diff(u, prepend=0.0)
        k = np.maximum(slope - np.append(slope[1:], 0.0), 0.0)
        cap = k * u
        if added is not None:
            bank = added.reshape(Bank(jnp.asarray(k), jnp.asarray(cap)), added.free.outward(amplitude))
            k, cap = np.asarray(bank.stiffness), np.asarray(bank.strength)
        reach = cap[k > 0.0] / k[k > 0.0]
        order = np.argsort(reach)
        reach, k, cap = reach[order], k[k > 0.0][order], cap[k > 0.0][order]
        force = np.cumsum(cap) + reach * (k.sum() - np.cumsum(k))
        return reach, force / force[-1], float(force[-1])

    def _residual(self, free: Sequence[Free], z: Array, added: _Added | None) -> Array:
        """Whitened: of the curve, the strength and the priors."""
        u, tau, strength = self._law(self._values(z), added, 0.0 if added is None else float(z[-1]))
        law = np.log(np.interp(self.tau, np.append(0.0, tau), np.append(0.0, u)))
        curve = solve_triangular(self.white, self.measured - law, lower=True)
        prior = [(x - f.inward(f.prior)) / f.width for f, x in zip(free, z, strict=True) if np.isfinite(f.width)]
        return np.concatenate([curve, [np.log(self.strength / strength) / self.strength_std], prior])

    def _slopes(self, free: Sequence[Free], z: Array, added: _Added | None) -> Array:
        """Derivatives of the residual, by differences that stay within the bounds."""
        here = self._residual(free, z, added)
        columns = []
        for k, f in enumerate(free):
            step = WIDE if f.amplitude else STEP
            step = step if z[k] + step < f.bounds[1] else -step
            columns.append((self._residual(free, z + step * (np.arange(z.size) == k), added) - here) / step)
        return np.column_stack(columns) if columns else np.zeros((here.size, 0))

    def _solve(self, free: Sequence[Free], z: Array, added: _Added | None = None) -> _Solution:
        if free:
            low, high = np.array([f.bounds for f in free]).T
            inside = np.clip(z, low + EDGE * (high - low), high - EDGE * (high - low))
            z = least_squares(
                lambda x: self._residual(free, x, added),
                inside,
                lambda x: self._slopes(free, x, added),
                (low, high),
                x_scale="jac",
            ).x
        rows = self._slopes(free, z, added)
        cost = float((self._residual(free, z, added) ** 2).sum())
        return _Solution(z, _inverse(rows), cost, rows)

    def _visible(self, z: Array, added: _Added) -> float | None:
        """Amplitude (SI, from the null) whose curve no change of the line brings nearer than five deviations."""
        null, far = added.span
        free = (*self.free, added.free)
        without = self._residual(free, np.append(z, null), added)
        basis = np.linalg.qr(self._slopes(free, np.append(z, null), added)[:, :-1])[0]

        def chi(share: float) -> float:
            change = self._residual(free, np.append(z, null + share * (far - null)), added) - without
            return float(np.linalg.norm(change - basis @ (basis.T @ change)))

        if chi(1.0) < SEEN:
            return None
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if chi(middle) < SEEN else (low, middle)
        return abs(added.free.outward(null + high * (far - null)) - added.free.outward(null))

    def _roughness(self, found: _Solution) -> tuple[tuple[float, float], tuple[float, float], float]:
        """H and h_rms (m), their standard deviations, and their correlation."""
        values = self._values(found.z)
        deviations, at = [0.0, 0.0], []
        for i, name in enumerate(ROUGHNESS):
            (k,) = np.flatnonzero(self._is(name)) if self._is(name).any() else (None,)
            if k is not None:
                deviations[i] = float(np.sqrt(found.covariance[k, k]) * self.free[k].slope(float(found.z[k])))
                at.append(k)
        correlation = 0.0
        if len(at) == 2:
            part = found.covariance[np.ix_(at, at)]
            correlation = float(part[0, 1] / np.sqrt(part[0, 0] * part[1, 1]))
        return (values["H"], values["h_rms"]), (deviations[0], deviations[1]), correlation

    def _edge(self, z: Array) -> bool:
        """Whether H or h_rms ends where lines do."""
        ends = [(x, *f.bounds) for f, x in zip(self.free, z, strict=True) if f.name in ROUGHNESS]
        return any(min(x - low, high - x) < 1e-3 * (high - low) for x, low, high in ends)

    def _force(self, values: dict[str, float], added: _Added | None, amplitude: float) -> Array:
        """Of the law at the curve's displacements, at the strength that was measured (N)."""
        u, tau, _ = self._law(values, added, amplitude)
        return self.strength * np.interp(self.curve.displacement, np.append(0.0, u), np.append(0.0, tau))

    def _scatter(self, values: dict[str, float]) -> Array:
        """Force of contacts that slide one deviation later and earlier (N), shape (2, n)."""
        u, tau, _ = self._law(values, None, 0.0)
        variance = np.diag(self.table.covariance(self._static(values), values["H"], values["h_rms"]))
        std = np.sqrt(np.interp(tau, self.table.tau[self.table.sparse], variance))
        return np.array(
            [
                self.strength
                * np.interp(self.curve.displacement, np.append(0.0, np.maximum.accumulate(v)), np.append(0.0, tau))
                for v in (u * np.exp(std), u * np.exp(-std))
            ]
        )


def in_logarithms(curve: Backbone, tau: Array) -> tuple[Array, Array]:
    """ln(u) of a backbone at shares of its full strength, and the covariance by what it was measured to.

    In it is, for each share, how far a smooth curve may lie from the polygon of the backbone: the height over a chord
    of which the slope turns as the polygon does at its ends.

    Args:
        curve: straight between its displacements.
        tau: shares, shape (T,).
    """
    u, force = np.append(0.0, curve.displacement), np.append(0.0, curve.force)
    strength = force[-1]
    rising = np.append(True, np.diff(force) > 0.0)
    at = np.interp(tau * strength, force[rising], u[rising])
    k = np.clip(np.searchsorted(u, at, side="left"), 1, u.size - 1)  # the piece that ends at node k
    width, slopes = np.diff(u), np.diff(force) / np.diff(u)
    # at the ends of each piece, and those beside: of neighbours one often holds what another does not
    turn = np.convolve(np.maximum(-np.diff(slopes, append=0.0), 0.0), np.full(4, 0.25))[1:-2]
    slope = slopes[k - 1]
    share = (at - u[k - 1]) / width[k - 1]
    mix = np.zeros((tau.size, force.size))
    rows = np.arange(tau.size)
    mix[rows, k], mix[rows, k - 1] = share, 1.0 - share
    mix[:, -1] -= tau
    carried = mix[:, 1:] / (slope * at)[:, None]
    sag = width[k - 1] * turn[k - 1] / 8.0 / (slope * at)
    return np.log(at), carried @ curve.covariance @ carried.T + np.diag(sag**2)


def _inverse(rows: Array) -> Array:
    return np.asarray(np.linalg.pinv(rows.T @ rows, hermitian=True), float)


def _cost(found: _Solution) -> float:
    return found.cost


def _free(rig: Any, start: StaticRig, strength: float) -> tuple[Free, ...]:
    """H and h_rms unless they are stated, and what is guessed of the rig; a friction that is starts as measured."""
    out = []
    low, high = (float(v) for v in start.rms_range())
    for name, unit, least, most, begun in (("H", "1", *HURST, 0.4), ("h_rms", "m", low, high, np.sqrt(low * high))):
        value = getattr(rig, name)
        if value is None:
            out.append(_unknown(name, unit, float(begun), least, most))
        elif isinstance(value, Unmeasured):
            out.append(_guess(name, unit, value, value.guess))
    for name in GUESSED:
        value = getattr(rig, name)
        if isinstance(value, Unmeasured):
            measured = strength / (start.contacts * start.normal_force)
            out.append(_guess(name, "", value, measured if name == "friction_coefficient" else value.guess))
    return tuple(out)


def _unknown(name: str, unit: str, begun: float, least: float, most: float) -> Free:
    return Free(name, unit, 1.0 if name == "H" else "log", begun, begun, np.inf, least, most)


def _guess(name: str, unit: str, value: Unmeasured, begun: float) -> Free:
    """The bounds of a guess are four standard deviations apart, as everywhere in a campaign."""
    if name in ("H", "poisson_ratio"):
        return Free(name, unit, 1.0, begun, value.guess, (value.upper - value.lower) / 4.0, value.lower, value.upper)
    width = float(np.log(value.upper / value.lower)) / 4.0
    begun = float(np.clip(begun, value.lower, value.upper))
    return Free(name, unit, "log", begun, value.guess, width, value.lower, value.upper)
