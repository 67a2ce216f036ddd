"""How far free simulations of fitted models are off on campaigns of another simulator: a table of docs/diagnosis.

``python -m tests.diagnose.free_runs`` makes the campaigns (two runs of four slips), fits, runs the models freely
through events that their fits have not seen, and writes the table to ``docs/results/figures.json``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from stickslip.inference.diagnose.final_comparison import settled
from stickslip.inference.diagnose.free_errors import errors
from stickslip.inference.diagnose.free_simulation import confirm
from stickslip.inference.diagnose.prepare import Prepared
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit
from stickslip.inference.force.signatures import Explained
from stickslip.physics.effects import catalogue
from stickslip.system import cache
from tests.force.conftest import Case, made, seen
from tests.kept_results import keep_table

AGEING = "contact-ageing"
COLUMNS = [
    "campaign of the independent simulator, two runs of four slips", "model",
    "error of recurrence", "the same in scatters",
]  # fmt: skip
BASE, AGED = ("static", "inertia"), ("static", "inertia", AGEING)


def prepared(case: Case) -> Prepared:
    """A campaign as a diagnosis takes it."""
    return Prepared(case.problem, case.point, tuple(case.traces), tuple(case.found), case.times, ())


def rows(name: str, folder: Path, seed: int, hidden: tuple[Any, ...] = ()) -> list[list[str]]:
    """One campaign's rows of the table."""
    case = made(folder, seed, hidden, spring_known=True)
    data = prepared(case)
    base = fit(case.problem, case.point)
    models, last, named = {BASE: base}, BASE, {BASE: "base"}
    if hidden:
        form = next(iter(catalogue.forms(catalogue.get(AGEING))))
        models[AGED] = settled(base, try_effect(base, Explained(base), AGEING, [form])[0])
        last, named = AGED, {**named, AGED: "base and contact ageing"}
    c = confirm(models, last, data)
    out = []
    for parts, words in named.items():
        found = errors(c, c.models[parts])["recurrence"]
        out.append([name, words, f"{100.0 * found['relative']:.2g} %", f"{found['scatters']:.2g}"])
    return out


def main() -> None:
    """Make the table and keep it."""
    cache.keep_compiled()
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        found = [
            *rows("nothing hidden, first", at / "first", 11),
            *rows("nothing hidden, second", at / "second", 12),
            *rows(
                "contact ageing at ten times its detection limit", at / "aged", 11, (seen(AGEING, "logarithm", 10.0),)
            ),
        ]
    keep_table("figures", "python -m tests.diagnose.free_runs", "free runs", COLUMNS, found)


if __name__ == "__main__":
    main()
