"""Which effects a recording can separate: how small ones it shows beside the base model, and which are then the same.

``python -m tests.force.separation`` simulates a rig without effects, reads it through a sensor that counts, fits the
base model to its force, and takes the derivative of that force, over its floor, in the amplitude of every effect of the
catalogue (in its first form, with its default parameters). What the parameters of the base model do not take of it is
its rest: the amplitude that can be seen goes as one over its size, and effects whose rests have a cosine above 0.9 are
a group. Waves, which their period tells, and what needs a measured load are left out. Writes a table of
docs/results/figures.json.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from stickslip.data.segment import segment
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.force.candidates import every_form
from stickslip.inference.force.fit import Fit, deviations, fit_base
from stickslip.inference.force.knots import PHASES
from stickslip.inference.force.linearised import prior_rows, reach
from stickslip.inference.force.periodogram import waves
from stickslip.inference.force.signatures import signatures
from stickslip.physics.effects import catalogue
from stickslip.system import process
from tests.force.counted_motions import Moved, moved, read
from tests.kept_results import keep_table

COMMAND = "python -m tests.force.separation"
COSINE = 0.9  # of effects that count as the same
COLUMNS = (
    "recorded", "smallest amplitude that is seen, over that of the last recording (median)", "the same (largest)",
    "groups that cannot be separated",
)  # fmt: skip
CREEP = (PHASES.index("creep"), PHASES.index("nucleation"))


def fitted(runs: Iterable[Moved]) -> Fit:
    """The base model on the records of some motions."""
    campaign = read(list(runs), seed=1)
    ready = prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])
    return fit_base(ready.problem, ready.start)


def rests(fit: Fit, phases: Iterable[int] = range(len(PHASES))) -> dict[str, np.ndarray]:
    """What is left of each effect, over the floor (p,), in some phases."""
    classes = [catalogue.get(tag) for tag in dict.fromkeys(tag for tag, _ in every_form(catalogue.tags()))]
    effects = [cls() for cls in classes if not cls.measured and not waves(cls())]
    use = np.isin(fit.problem.phase, list(phases)) & ~fit.dropped
    weight = 1.0 / deviations(fit)[use]
    low, high = reach(fit.problem, fit.point)
    free = (low < 0.0) & (high > 0.0)
    prior = prior_rows(fit.problem, fit.point)[0][:, free]
    base, _ = np.linalg.qr(np.vstack([fit.slopes.shared[use][:, free] * weight[:, None], prior]))
    columns = np.stack([signatures(fit, effect, [{}])[0][use] * weight for effect in effects], axis=1)
    rest = np.vstack([columns, np.zeros((len(prior), len(effects)))])
    rest = rest - base @ (base.T @ rest)
    return dict(zip((e.tag for e in effects), rest.T, strict=True))


def groups(left: dict[str, np.ndarray]) -> list[list[str]]:
    """Effects of which any two have a cosine above :data:`COSINE`, the largest groups first."""
    unit = np.stack([rest / np.linalg.norm(rest) for rest in left.values()])
    apart = 1.0 - np.abs(unit @ unit.T)
    of = fcluster(linkage(apart[np.triu_indices(len(left), 1)], "complete"), 1.0 - COSINE, "distance")
    found = [[tag for tag, g in zip(left, of, strict=True) if g == number] for number in np.unique(of)]
    return sorted((g for g in found if len(g) > 1), key=len, reverse=True)


def main() -> None:
    """Make the table and keep it."""
    process.begin()
    one = moved(1e-4, 7.5, tolerance=1e-5)
    others = [moved(speed, end, tolerance=1e-5) for speed, end in ((5e-5, 14.0), (4e-4, 2.2))]
    held = moved(1e-4, 20.0, tolerance=1e-5, holds=((2.0, 1.0), (5.0, 10.0)))
    alone = fitted([one])
    found = {
        "creep, one velocity": rests(alone, CREEP),
        "creep, slip and ring-down, one velocity": rests(alone),
        "the same at three velocities": rests(fitted([one, *others])),
        "and holds of 1 s and 10 s": rests(fitted([one, *others, held])),
    }
    sizes = {name: np.array([np.linalg.norm(rest) for rest in left.values()]) for name, left in found.items()}
    last, rows = list(sizes.values())[-1], []
    for name, left in found.items():
        times = last / sizes[name]
        median, largest = (f"{float(f'{x:.2g}'):g}" for x in (np.median(times), times.max()))
        if times.max() > 1.0:
            largest += f" (`{list(left)[int(np.argmax(times))]}`)"
        rows.append([name, median, largest, "; ".join(", ".join(f"`{tag}`" for tag in g) for g in groups(left))])
    keep_table("figures", COMMAND, "separation", COLUMNS, rows)


if __name__ == "__main__":
    main()
