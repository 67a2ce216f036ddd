"""What an effect would add to the force along the motion, one small amplitude at a time, and how much that explains."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from ...physics.effects.base import Effect, Sensor
from ...physics.params import specs
from ...system.trace_cache import Program, of_this_package
from .compiled_force import PROGRAMS, CommonInput, RunInput, model_of, of_events
from .composition import PULL, SCALE
from .fit import Fit
from .force_along_motion import along, of_block
from .linearised import Array, prior_rows, reach
from .problem import Problem

CHUNK = 64  # members evaluated at once


def signatures(fit: Fit, effect: Effect, members: Sequence[dict[str, float]]) -> Array:
    """Derivative of the residual force in the amplitude of an effect that is absent, shape (members, p).

    Args:
        fit: the model without it.
        effect: in its form.
        members: values of its other parameters (SI).
    """
    problem = fit.problem
    program = _program(jax.tree.structure(problem.composition.effects), jax.tree.structure(effect), type(effect))
    names = tuple(specs(effect))
    out = []
    known, runs = _arguments(fit)
    for at in range(0, len(members), CHUNK):
        part = list(members[at : at + CHUNK])
        size = len(part)
        if len(members) > CHUNK:
            part += [part[-1]] * (CHUNK - size)
        values = {n: np.array([float(m.get(n, float(getattr(effect, n)))) for m in part]) for n in names}
        values[effect.amplitude] = np.full(len(part), specs(effect)[effect.amplitude].null or 0.0)
        found = [[np.asarray(a)[:size] for a in program(values, *known, *run)] for run in runs]
        out.append(_at_points(problem, fit, found, isinstance(effect, Sensor)))
    return np.concatenate(out)


def _arguments(fit: Fit) -> tuple[tuple[Any, ...], list[tuple[Any, ...]]]:
    """What all runs share, and what each has of its own."""
    problem, point = fit.problem, fit.point
    c = problem.composition
    values = {n: np.float64(v) for n, v in problem.values(point).items()}
    turned = [
        {f.name: np.float64(float(f.scale) * point.phases[j, r]) for j, f in enumerate(c.phases)}
        for r in range(len(problem.runs))
    ]
    return (values, problem.common_input(point)), list(zip(turned, problem.run_inputs(point), strict=True))


def _at_points(problem: Problem, fit: Fit, found: Sequence[Sequence[Array]], sensed: bool) -> Array:
    out = np.zeros((len(found[0][0]), problem.at.size))
    values = problem.values(fit.point)
    p = 0
    for run, (q, shift, mass) in zip(problem.runs, found, strict=True):
        n, s = run.t.size, slice(p, p + run.at.size)
        moved = (run.mean @ q[:, :n].T).T - mass[:, None] * run.acceleration
        if sensed or run.force_scale is not None:
            first, second = run.smooth
            moved = moved - values["rig.mass"] * (second @ shift[:, :n].T).T
            moved = moved - values["rig.damping"] * (first @ shift[:, :n].T).T
        out[:, s] = moved
        p += run.at.size
    return out


@lru_cache(maxsize=PROGRAMS)
def _program(base: Any, structure: Any, cls: type[Effect]) -> Program:
    names = tuple(specs(cls))
    place = names.index(cls.amplitude)

    def one(values: Any, known: Any, common: CommonInput, turned: Any, run: RunInput) -> Any:
        effects, way, knots = jax.tree.unflatten(base, common.effects), run.way, run.knots
        everything = {**known, **turned}

        def forces(amplitude: Any) -> Any:
            numbers = [values[n] for n in names]
            numbers[place] = amplitude
            effect = jax.tree.unflatten(structure, numbers)
            model = model_of(everything, effects, common.bank, run.spring)
            model = type(model)(model.block, model.bank, model.weakening, model.load_point, (*model.effects, effect))
            moving = way
            if PULL in everything:
                moving = moving._replace(drive=moving.drive + everything[PULL] / model.block.spring_stiffness)
            seen = of_block(model, moving, everything.get(SCALE, 1.0), knots)
            held = along(model, of_events(seen, run.own), knots)
            return held.pull + held.body - held.contact, seen.x - way.x, model.mass()

        return jax.jvp(forces, (values[names[place]],), (jnp.ones(()),))[1]

    every = jax.vmap(one, in_axes=(0, *[None] * 4))
    own = of_this_package(base) and cls.__module__.split(".")[0] == __name__.split(".")[0]
    return Program(every, f"signature {base} {structure}" if own else None)


class Explained:
    """How much of the residuals columns explain that the model's own parameters and the events do not."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        rows = self._white(fit.slopes.shared)
        low, high = reach(fit.problem, fit.point)
        free = (low < 0.0) & (high > 0.0)
        prior, target = prior_rows(fit.problem, fit.point)
        self.extra = len(prior)
        self.basis, self._corner = np.linalg.qr(np.vstack([rows[:, free], prior[:, free]]))
        self._shared = fit.slopes.shared[:, free]
        rest = np.concatenate([self._white(fit.marginal[:, None])[:, 0], target])
        self.rest = rest - self.basis @ (self.basis.T @ rest)

    def _white(self, columns: Array) -> Array:
        return self._by_event(columns).reshape(-1, columns.shape[1])

    def _by_event(self, columns: Array) -> Array:
        return self.fit.white(self.fit.blocks(columns))

    def events(self, rows: Array) -> Array:
        """Rows of :meth:`orthogonal` without those of the priors, by event, shape (E, n, ...)."""
        events = self.fit.problem.events
        return rows[: rows.shape[0] - self.extra].reshape(events, -1, *rows.shape[1:])

    def orthogonal(self, columns: Array) -> Array:
        """Columns (p, m) whitened and freed of what the model can do itself."""
        white = np.vstack([self._white(columns), np.zeros((self.extra, columns.shape[1]))])
        return white - self.basis @ (self.basis.T @ white)

    def by_event(self, columns: Array) -> tuple[Array, Array, Array]:
        """Columns (p, m) whitened by event, what lies along the model's own k directions, the rest of the residuals.

        Shapes (E, n, m), (E, k, m) and (E, n).
        """
        white, own = self._by_event(columns), self.events(self.basis)
        return white, np.einsum("enk,enm->ekm", own, white, optimize=True), self.events(self.rest)

    def left(self, columns: Array) -> Array:
        """Forces (p, m) less what the model's own parameters would take of them (N)."""
        white = np.vstack([self._white(columns), np.zeros((self.extra, columns.shape[1]))])
        own, *_ = np.linalg.lstsq(self._corner, self.basis.T @ white, rcond=1e-10)
        return columns - self._shared @ own

    def gain(self, columns: Array) -> tuple[float, Array]:
        """Fall of the cost (chi-square) with the columns, and their coefficients."""
        orthogonal = self.orthogonal(columns)
        scale = np.sqrt((orthogonal**2).sum(axis=0)) + 1e-300
        found, *_ = np.linalg.lstsq(orthogonal / scale, -self.rest, rcond=1e-8)
        left = self.rest + (orthogonal / scale) @ found
        return float((self.rest**2).sum() - (left**2).sum()), found / scale

    def unseen(self, columns: Array, left_out: Sequence[NDArray[np.intp]]) -> Array:
        """Fall of each event's cost with the columns (p, m), their coefficients from the other folds, shape (E,)."""
        rows, rest = self.events(self.orthogonal(columns)), self.events(self.rest)
        each, upon = np.einsum("enp,enq->epq", rows, rows), np.einsum("enp,en->ep", rows, rest)
        out = np.zeros(len(rows))
        for part in left_out:
            matrix, right = each.sum(axis=0) - each[part].sum(axis=0), upon.sum(axis=0) - upon[part].sum(axis=0)
            found, *_ = np.linalg.lstsq(matrix, -right, rcond=1e-10)
            out[part] = -(2.0 * upon[part] @ found + np.einsum("epq,p,q->e", each[part], found, found))
        return out

    def singly(self, orthogonal: Array) -> tuple[Array, Array, Array]:
        """The same for each column of :meth:`orthogonal` by itself: falls, coefficients, deviations, each (m,)."""
        norm = (orthogonal**2).sum(axis=0) + 1e-300
        projected = orthogonal.T @ self.rest
        return projected**2 / norm, -projected / norm, norm**-0.5
