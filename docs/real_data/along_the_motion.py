"""Records whose motion is prescribed and whose force is measured: diagnosed, and where the models fail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stickslip.inference.force.heldout import halves
from stickslip.objects.diagnosis import Diagnosis
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, plain, scaled, styled

from .campaigns import DOCS, keep, rms, shipped

# picture of each, and how its displacement and its force are called: name, unit, and what SI is multiplied with (None:
# whatever prefix suits)
LENGTH, FORCE = ("displacement", "m", None), ("force", "N", None)
PICTURES: dict[str, tuple[str, Any, Any]] = {
    "reciprocating-loops": ("real-reciprocating-loops", LENGTH, FORCE),
    "friction-damper": ("real-friction-damper", LENGTH, ("force", "kN", 1e-3)),
    "drill-string": ("real-drill-string", ("angle", "rad", 1e3), ("torque", "N m", 1e-3)),
    "robot-joint": ("real-robot-joint", ("angle", "deg", 1e3), ("torque", "N m", 1.0)),
    "robot-joint-2": ("real-robot-joint-2", ("angle", "deg", 1e3), ("torque", "N m", 1.0)),
    "robot-loops": ("real-robot-loops", ("angle", "deg", 1e3), ("torque", "N m", 1.0)),
}
STILL = 0.05  # of the usual speed
STRONG = 0.8  # of the strength: the contact slides


def diagnosed(name: str, data: Path, work: Path) -> dict[str, Any]:
    """A campaign of scenarios/real: the ladder, what the program says, where the models fail, and a picture."""
    return told(name, shipped(name, data, work / name).diagnose())


def told(name: str, made: Diagnosis) -> dict[str, Any]:
    """What is kept of a diagnosis."""
    made.save(DOCS.parent / "out" / "real-data" / name, force=True)
    assert made.found is not None
    rungs = [rung for rung in made.found.ladder if rung.fit is not None]
    fits = [rung.fit for rung in rungs]
    level = strength(fits[0])
    if name in PICTURES:
        picture, along, force = PICTURES[name]
        keep(hysteresis(fits[0], fits[-1], made.campaign.title, along, force), picture)
    verdict = made.result["verdict"]
    return {
        "title": made.campaign.title, "runs": len(fits[0].problem.runs), "events": int(fits[0].problem.events),
        "says": f"{verdict['kind']}: {verdict['text']}",
        "scatter": made.result["scatter"],
        "parameters": {name: [v["value"], v["std"], v["unit"]] for name, v in made.result["parameters"].items()},
        "ladder": ladder(made),
        "where": [{k: v / level for k, v in where(rung.fit, rung.unseen).items()} for rung in (rungs[0], rungs[-1])],
    }  # fmt: skip


def ladder(made: Diagnosis) -> list[dict[str, Any]]:
    """Errors of every model on the way to the last one."""
    assert made.found is not None
    rungs = [rung for rung in made.found.ladder if rung.fit is not None]
    base, level = rungs[0].fit, strength(rungs[0].fit)
    return [
        {
            "model": rung.added, "fitted": rms(rung.residual) / level, "unseen": rms(rung.unseen) / level,
            "gain": None if rung.fit is base else last.fit.cost - rung.fit.cost,
            "floors": [told["train_error"], told["heldout_error"]],
        }
        for last, rung, told in zip([rungs[0], *rungs], rungs, made.result["ladder"][1:], strict=False)
    ]  # fmt: skip


def strength(fit: Any) -> float:
    """The 95th percentile of the force (N): as it was measured, or as the spring tells it."""
    force, _, _ = along_runs(fit.problem)
    return float(np.quantile(np.abs(force if force.any() else fit.forces.measured), 0.95))


def where(fit: Any, unseen: np.ndarray) -> dict[str, float]:
    """Rms of what the model leaves on unseen parts (N): at rest, while the contact is loaded, and while it slides."""
    force, _, v = along_runs(fit.problem)
    still = np.abs(v) < STILL * np.median(np.abs(v[v != 0.0]))
    strong = np.abs(force if force.any() else fit.forces.measured) > STRONG * strength(fit)
    parts = {"at rest": still, "being loaded": ~still & ~strong, "sliding": ~still & strong}
    return {name: rms(unseen[own]) for name, own in parts.items() if own.any()}


def along_runs(problem: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force (N), displacement from the start (m) and velocity (m/s) at the points."""
    runs = problem.runs
    force, x = (np.concatenate([k.mean @ y for k, y in zip(runs, ys, strict=True)])
                for ys in ([k.force for k in runs], [k.x - k.x[0] for k in runs]))  # fmt: skip
    return force, x, np.concatenate([k.rate for k in runs])


def least(fit: Any, columns: np.ndarray) -> list[float]:
    """Rms of the force (N) that a linear model leaves, fitted and on halves of runs left out."""
    force, _, _ = along_runs(fit.problem)

    def left(seen: np.ndarray, own: np.ndarray) -> np.ndarray:
        return force[own] - columns[own] @ np.linalg.lstsq(columns[seen], force[seen], rcond=None)[0]

    everything = np.ones(force.size, bool)
    apart = [np.isin(fit.problem.of, part) for part in halves(fit)]
    return [rms(left(everything, everything)), rms(np.concatenate([left(~own, own) for own in apart]))]


def drill_string(data: Path, work: Path) -> dict[str, Any]:
    """The drill string, and what any law of speed and load leaves of its torque."""
    made = shipped("drill-string", data, work / "drill-string").diagnose()
    assert made.found is not None
    base = next(rung.fit for rung in made.found.ladder if rung.fit is not None)
    level = strength(base)
    return {**told("drill-string", made), "free": [v / level for v in freely(base)]}


def freely(fit: Any) -> list[float]:
    """Rms of the torque that any function of the speed leaves, other where it falls and linear in the measured load."""
    runs = fit.problem.runs
    _, _, v = along_runs(fit.problem)
    load = np.concatenate([k.mean @ k.load for k in runs])
    falls = np.concatenate([k.acceleration for k in runs]) < 0.0
    nodes = np.unique(np.quantile(v, np.linspace(0.0, 1.0, 13)))
    hats = np.stack([np.interp(v, nodes, row) for row in np.eye(nodes.size)], axis=1)
    loaded = np.hstack([hats, hats * (load / np.median(load) - 1.0)[:, None]])
    return least(fit, np.hstack([loaded, loaded * falls[:, None]]))


@styled
def hysteresis(base: Any, last: Any, title: str, along: Any, force: Any) -> Any:
    """Force against displacement of a run, measured and by the first and the last model, and what either leaves."""
    problem = base.problem
    chosen = len(problem.runs) // 2
    own = np.flatnonzero(problem.run == chosen)
    run = problem.runs[chosen]
    x, measured = run.mean @ (run.x - run.x[0]), along_runs(problem)[0][own]
    (a, length), (b, newton) = scale(x, along), scale(measured, force)
    made, axes = figure(1, 2, width=10.0, height=4.0)
    left, right = axes[0]
    left.plot(a * x, b * measured, ".", ms=3, color=DARK, label="measured")
    for fit, color, line in ((base, LIGHT, "-"), (last, MIDDLE, "--"))[: 1 + (last is not base)]:
        names = ["base", *(e.tag for e in fit.problem.composition.effects)]
        model = b * (measured - fit.marginal[own])
        left.plot(a * x, model, line, color=color, lw=1.0, label=plain("\n+ ".join(names)))
        right.plot(run.at - run.at[0], 100.0 * fit.marginal[own] / base.strength, line, color=color, lw=1.0)
    left.set(xlabel=length, ylabel=newton, title=plain(title))
    left.locator_params(axis="x", nbins=6)
    right.set(xlabel="time / s", ylabel="measured - model / % of the strength", title=plain(run.name))
    made.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="x-small")
    return made


def scale(values: np.ndarray, axis: Any) -> tuple[float, str]:
    """What values in SI are multiplied with on an axis, and its label."""
    name, unit, factor = axis
    k, unit = scaled(values, unit) if factor is None else (factor, unit)
    return k, f"{name} / {unit}"
