"""A fit as plain arrays, from which it is there again, to the last digit, without being fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .fit import Fit, again
from .linearised import Array
from .point import Point
from .problem import Problem
from .scatter import Follows, Scatter

POINT = ("z", "phases", "weights", "events", "common")
AROUND = "around_"


def point_arrays(point: Point, prefix: str = "") -> dict[str, Array]:
    """A point by name."""
    return {prefix + name: np.asarray(getattr(point, name)) for name in POINT}


def point_of(kept: Mapping[str, np.ndarray], prefix: str = "") -> Point:
    """The point again."""
    return Point(*(np.asarray(kept[prefix + name], float) for name in POINT))


def scatter_arrays(scatter: Scatter) -> dict[str, np.ndarray]:
    """Sizes of what is random by name, what they may not pass, and what the level of the strength follows."""
    own = {"sizes": scatter.sizes, "most": np.asarray(scatter.most, float)}
    if (f := scatter.follows) is None:
        return own
    return {
        **own,
        "follows": np.array([f.coordinate, *f.equally_likely]),
        "unit": np.array(f.unit),
        "of": np.array(f.of),
    }


def scatter_of(kept: Mapping[str, np.ndarray]) -> Scatter:
    """The sizes again."""
    scatter = Scatter(np.asarray(kept["sizes"], float))
    if "most" in kept:  # not in files of before
        most = scatter.most.copy()
        most[: kept["most"].size] = kept["most"]
        scatter = replace(scatter, most=most)
    if "follows" in kept:
        coordinate, *others = (str(name) for name in kept["follows"])
        of = str(kept["of"]) if "of" in kept else "both"  # not in files of before
        scatter = replace(scatter, follows=Follows(coordinate, float(kept["unit"]), tuple(others), of))
    return scatter


def fit_arrays(found: Fit) -> dict[str, np.ndarray]:
    """A fit by name."""
    problem = found.problem
    return {
        **point_arrays(found.point),
        **point_arrays(found.around, AROUND),
        **scatter_arrays(found.scatter),
        "dropped": found.dropped,
        "reach": np.asarray(problem.composition.reach),
        "carrier": np.asarray([] if problem.carrier is None else problem.carrier),
        "errors": np.concatenate(problem.errors),
        "offset": problem.offset,
        "beyond": problem.beyond,
        "jumps": np.array(problem.jumps, int),
        "bands": problem.bands,
        "valleys": np.array(found.valleys),
        "evaluations": np.array(found.evaluations),
    }


def fit_of(problem: Problem, kept: Mapping[str, np.ndarray]) -> Fit:
    """The fit again.

    Args:
        problem: of the same data and with the same composition.
        kept: what :func:`fit_arrays` returned.

    Raises:
        KeyError, ValueError: the arrays are damaged.
    """
    problem = problem.with_composition(replace(problem.composition, reach=np.asarray(kept["reach"], float)))
    if "errors" in kept:  # files of before have none
        ends = np.cumsum([e.size for e in problem.errors])[:-1]
        problem = problem.moved(np.split(np.asarray(kept["errors"], float), ends), np.asarray(kept["offset"], float))
    if "beyond" in kept:
        problem = problem.with_beyond(np.asarray(kept["beyond"], float))
    if "bands" in kept:
        problem = problem.in_bands(np.asarray(kept["bands"], float))
    if "jumps" in kept:
        problem = problem.with_jumps([int(event) for event in kept["jumps"]])
    if kept["carrier"].size:
        problem = problem.carried_by(np.asarray(kept["carrier"], float))
    found = again(
        problem, point_of(kept), scatter_of(kept), np.asarray(kept["dropped"], bool),
        point_of(kept, AROUND), int(kept["evaluations"]),
    )  # fmt: skip
    valleys = kept["valleys"]
    return replace(found, valleys=tuple(np.asarray(valleys, float)) if valleys.size else ())
