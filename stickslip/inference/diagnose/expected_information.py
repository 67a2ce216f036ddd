"""How well an experiment would separate models: what they hold along its motion, over what is known of either.

Along the motion of an experiment two models hold forces that differ by ``d``. With ``S`` the covariance of the
residual force there (noise, scatter of events, and what the campaign leaves unknown of the parameters of both),
``d' S^-1 d / 2`` is the logarithm of the likelihood ratio that the experiment is expected to give for the one that is
true. From that follows the expected information about which model it is (Lindley, Ann. Math. Stat. 27 (1956) 986).

What is left unknown of the parameters is the Gaussian of the fit, or draws of the posterior: the forces of each draw,
and around them the Gaussian of what is not drawn, given what is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from ..force.composition import PULL
from ..force.fit import Fit
from ..force.knots import Knots
from ..force.linearised import Array
from ..force.noise import by_reading, known_of
from ..force.point import LOCAL, Point
from ..force.problem import Problem
from ..force.scatter import Blocks
from ..force.whitening import Whitening, WithEvents
from .decide import DISPERSION

MASS = "rig.mass"
KNOWN = 0.01  # of a mass, a load or a spring that is put in for the experiment, and of what a load does to the contact
STRETCH = LOCAL.index("stretch")
TURNS = 4  # phases of a run's own that are tried: the experiment may meet any


@dataclass(frozen=True)
class Changed:
    """What an experiment changes of the rig: factors on mass, normal load, spring, and on all yield displacements.

    What is changed is known to one per cent, and so is by how much a load stretches the contact. The stiffness of the
    spring is that of the run itself.
    """

    mass: float = 1.0
    load: float = 1.0
    spring: float = 1.0
    stretch: float = 1.0


@dataclass(frozen=True)
class _Held:
    """A model along a run that its fit has not seen.

    Attributes:
        residual: force, all events equal (N), shape (p,).
        unsure: what a standard deviation of each independent combination of its parameters does (N), shape (p, q).
        white: the covariance of the residuals, the parameters known.
        blocks: points by event.
    """

    residual: Array
    unsure: Array
    white: WithEvents
    blocks: Blocks


def margins(
    fits: Sequence[Fit], runs: Sequence[Knots], changed: Changed | None = None,
    drawn: Sequence[Sequence[Point]] | None = None,
) -> Array:  # fmt: skip
    """Expected logarithm of the likelihood ratio of each model, were it true, over each other one, shape (m, m).

    In units in which chance spreads as it should (the cost over its dispersion).

    Args:
        fits: models of one campaign.
        runs: the motion of the experiment by each of them.
        changed: what the experiment changes of the rig.
        drawn: of each model draws of the posterior, with what is linear at its best; default its Gaussian.
    """
    sampled = [()] * len(fits) if drawn is None else drawn
    out = np.zeros((len(fits), len(fits)))
    for i, run in enumerate(runs):
        held = [_held(fit, run, changed or Changed(), own) for fit, own in zip(fits, sampled, strict=True)]
        for j in range(len(fits)):
            if i != j:
                out[i, j] = min(_margin(one, other) for one in held[i] for other in held[j])
    return out


def information(margins: Array) -> float:
    """Expected information about which of some models is true, equally likely beforehand (nat), from :func:`margins`.

    At most the logarithm of their number, where the experiment decides.
    """
    m = len(margins)
    return float(np.log(m) - np.mean(logsumexp(-margins, axis=1)))


def _margin(one: _Held, other: _Held) -> float:
    side = np.column_stack([other.residual - one.residual, one.unsure, other.unsure])
    white = one.white(one.blocks(side)).reshape(-1, side.shape[1])
    difference, unsure = white[:, 0], white[:, 1:]
    root = np.linalg.cholesky(unsure.T @ unsure + np.eye(unsure.shape[1]))
    told = np.linalg.solve(root, unsure.T @ difference)
    return 0.5 * float(difference @ difference - told @ told) / DISPERSION


def _held(fit: Fit, run: Knots, changed: Changed, drawn: Sequence[Point]) -> list[_Held]:
    """The model along the run, at each phase that the run may have of its own."""
    periodic = [f.name for f in fit.problem.composition.phases if f.name != PULL]
    return [_along(fit, run, changed, 2.0 * np.pi * i / TURNS, drawn) for i in range(TURNS if periodic else 1)]


def _along(fit: Fit, run: Knots, changed: Changed, turn: float, drawn: Sequence[Point]) -> _Held:
    known = fit.problem.composition
    (level, width), names = known.nominal, [f.name for f in known.shared]
    heavier = np.log(changed.mass) * (np.array(names) == MASS)
    problem = Problem(
        replace(
            known, mass=changed.mass * known.mass, reach=changed.stretch * known.reach,
            nominal=(changed.load * level, width),
        ),
        [run],
    )  # fmt: skip
    phases = known.phases
    own = np.array([[0.0 if f.name == PULL else turn / float(f.scale)] for f in phases]).reshape(len(phases), 1)
    systematics = problem.systematics
    events = np.zeros((problem.events, fit.point.events.shape[1]))

    def here(there: Point) -> Point:
        common = np.concatenate([there.common[:systematics], np.zeros(problem.usual.size - systematics)])
        return Point(there.z + heavier, own, changed.load * there.weights, events, common)

    point = here(fit.point)
    blocks, slopes = problem.blocks, problem.evaluate(point)
    rows, none = by_reading(problem, point, slopes), np.zeros(problem.of.size, bool)
    noise = known_of(problem, slopes, rows, none, fit.scatter.follows)
    white = Whitening(fit.scatter.sizes, noise)
    unsure, expected = [slopes.shared @ _deviations(fit, problem, changed.load, bool(drawn))], slopes.residual
    if drawn:
        forces = np.stack([problem.forces(here(draw)).residual for draw in drawn], axis=1)
        expected = forces.mean(axis=1)
        unsure.append((forces - expected[:, None]) / np.sqrt(len(drawn) - 1.0))
    first = point.z.size + own.size
    if changed.load != 1.0:
        unsure.append(slopes.shared[:, first : first + point.weights.size] @ point.weights[:, None] * KNOWN)
        unsure.append(slopes.local[:, [STRETCH]] * KNOWN)
    if changed.mass != 1.0:
        unsure.append((slopes.share * problem.composition.mass * run.acceleration)[:, None] * KNOWN)
    if changed.spring != 1.0 and run.stiffness is not None:
        unsure.append((slopes.share * (run.mean @ (run.stiffness * (run.drive - run.x))))[:, None] * KNOWN)
    return _Held(expected, np.hstack(unsure), white.with_events(blocks(slopes.local)), blocks)


def _deviations(fit: Fit, problem: Problem, load: float, drawn: bool) -> Array:
    """Of parameters of a problem of one run, by independent combinations: those of the campaign, and the run's own.

    Where the shared ones are ``drawn``, of all others given these.
    """
    a, k = fit.point.z.size, fit.point.weights.size
    there, here = fit.point.phases.size, len(problem.composition.phases)
    systematics = problem.systematics
    known = np.concatenate([np.arange(a), a + there + np.arange(k + systematics)])
    part = fit.covariance[np.ix_(known, known)]
    if drawn:
        sd = np.sqrt(np.maximum(np.diag(part), 1e-300))
        even = part / sd[:, None] / sd
        left = even - even[:, :a] @ np.linalg.pinv(even[:a, :a], rcond=1e-10, hermitian=True) @ even[:a]
        left[:a], left[:, :a] = 0.0, 0.0
        part = left * sd[:, None] * sd
    scale = np.sqrt(np.maximum(np.diag(part), 1e-300))  # metres beside newtons
    values, vectors = np.linalg.eigh(part / scale[:, None] / scale)
    told = np.concatenate([np.arange(a), a + here + np.arange(k + systematics)])
    total = a + here + k + problem.usual.size
    own = np.setdiff1d(np.arange(total), told)
    out = np.zeros((total, known.size + own.size))
    out[np.ix_(told, np.arange(known.size))] = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    out[a + here : a + here + k] *= load
    usual = [0.0 if f.name == PULL else np.pi / np.sqrt(3.0) / float(f.scale) for f in problem.composition.phases]
    out[own, known.size + np.arange(own.size)] = np.concatenate([usual, problem.usual[systematics:]])
    return out
