"""Mass and spring as the file states them against what the slips say: c_s/m, which the measured motion tells by itself.

A wrong entry is a hypothesis like any effect: the base with the spring's stiffness free. All forces have one scale in
common, so with the mass held at its stated value the stiffness stands for the ratio of the two.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...data.checks.finding import Finding
from ...system.units import shown
from ..fit.parameters import Free
from .fit import Fit, adapted, refit
from .point import Point
from .problem import Problem

SPRING = "rig.spring_stiffness"
EXACT = 5e-3  # share of its value by which no spring is known better
WIDEST = 10.0  # factor on the stated stiffness within which it is sought


def spring_freed(base: Fit) -> Fit | None:
    """The same model with the stiffness of the spring free; None where it is free already, or runs have their own."""
    problem = with_free_spring(base.problem)
    if problem is None:
        return None
    ((first, spring),) = [(i, f) for i, f in enumerate(problem.composition.shared) if f.name == SPRING]
    point: Point = replace(base.point, z=np.insert(base.point.z, first, spring.inward(spring.start)))
    return adapted(refit(problem, point, base))


def with_free_spring(problem: Problem) -> Problem | None:
    """The same with a free stiffness, after the other parameters of the base; None as above."""
    composition = problem.composition
    stated = composition.fixed.get(SPRING)
    if stated is None or any(k.stiffness is not None for k in problem.runs):
        return None
    spring = Free(
        SPRING, "N/m", "log", stated, stated, np.inf, stated / WIDEST, stated * WIDEST,
        "stiffness of the driving spring",
    )  # fmt: skip
    fixed = {name: value for name, value in composition.fixed.items() if name != SPRING}
    tags = {e.tag for e in composition.effects}
    own = [f for f in composition.shared if f.name.partition(".")[0] not in tags]
    rest = composition.shared[len(own) :]
    return problem.with_composition(replace(composition, free=(*own, spring, *rest, *composition.phases), fixed=fixed))


def within_knowledge(base: Fit, freed: Fit) -> bool:
    """Whether the stiffness that the slips require is as near to the stated one as that is known."""
    return abs(freed.values[SPRING] / base.values[SPRING] - 1.0) < EXACT


def slips_finding(base: Fit, freed: Fit) -> Finding:
    """What the slips say of spring over mass, and what the file states."""
    stated, mass = base.values[SPRING], base.values["rig.mass"]
    value, std = freed.values[SPRING], freed.std()[SPRING]
    sentence = (
        f"mass and spring: the slips require {shown(value, 'N/m', 4)} +- {shown(std, 'N/m', 2)} on a block of "
        f"{shown(mass, 'kg', 3)}, or a block of {shown(mass * stated / value, 'kg', 3)} on the spring of "
        f"{shown(stated, 'N/m', 4)} of the file. Weigh the block with what moves along, and measure the spring."
    )
    return Finding("mass and spring", None, stated, value, std, "N/m", sentence)
