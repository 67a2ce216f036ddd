"""``stickslip creep``: the static curve of a scenario's contacts."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any, Literal

from ..errors import InputError
from ..system.runstore import open_run, refuse_existing
from . import show
from .parameters import Changes, Force, MoreChanges


def creep(
    scenario: str,
    *more: MoreChanges,
    out: Path | None = None,
    set: Changes = (),
    points: int = 400,
    average: Literal["displacement", "force"] = "displacement",
    time: Literal["exact", "paper"] = "exact",
    force: Force = False,
) -> int:
    """The static creep curve of a scenario's contacts, without inertia.

    Parameters
    ----------
    scenario:
        TOML file that describes the rig and its drive.
    out:
        Folder for creep.csv, creep.png and result.json instead.
    points:
        Loads from zero to full friction.
    average:
        Mean over rough lines of the displacement at the same load, or of the force at the same displacement.
    time:
        Virtual time with the block's own motion (exact) or without it (paper).
    """
    from ..show.simulated import head
    from .simulate import outside, scenario_arguments

    path, changes = scenario_arguments(scenario, more, set)
    if not 2 <= points <= 1_000_000:
        raise InputError("the number of loads is out of range", key="--points", value=points, allowed="2 to 1000000")
    refuse_existing(out, force)
    from ..simulation.scenario import load_scenario, static_creep

    loaded = load_scenario(path, changes)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            curve = static_creep(loaded, points, average, time)
        except InputError as error:
            raise error.at(file=path) from None
    notes = [*outside(loaded), *(str(w.message) for w in caught if issubclass(w.category, UserWarning))]
    for text in notes:
        show.warn(text)
    rows = zip(*(column.tolist() for column in curve), strict=True)
    text = "\n".join(["tau,u,t", *(",".join(repr(cell) for cell in row) for row in rows)]) + "\n"
    if out is None:
        sys.stdout.write(text)
        return 0
    table = loaded.file.contact
    result: dict[str, Any] = {
        **head(loaded),
        "kind": "creep",
        "seeds": {"lines": getattr(table, "seed", None)},
        "N": getattr(table, "springs", None),
        "L": getattr(table, "line_length", None),
        "average": average,
        "time": time,
        "warnings": notes,
    }
    with open_run(out, force=force) as run:
        from ..show.plots import creep_figure, save

        run.text(text, "creep.csv")
        save(creep_figure(*curve, loaded.title), run.path("creep.png"))
        run.json(result)
    print(f"written to {out}: creep.csv, creep.png, result.json")
    return 0
