"""``stickslip diagnose``: which physical effect is missing, and how far the error falls with it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..system.progress import EVERY, paced
from ..system.runstore import json_text
from .parameters import Candidates, Files, Flag, Force, Jobs, MaxEffects, Several, names

UNRESOLVED = 3


def diagnose(
    campaign: str,
    *,
    out: Path | None = None,
    candidates: Candidates = None,
    max_effects: MaxEffects = 4,
    holdout: Several = (),
    effect: Files = (),
    jobs: Jobs = None,
    time_limit: float | None = None,
    json: Flag = False,
    force: Force = False,
) -> int:
    """Find the physical effect that the model lacks, add it, and test it on runs left out of the fit.

    Parameters
    ----------
    campaign:
        TOML file that describes the rig and its measured runs.
    out:
        Folder for report.html, result.json and the finished parts; an interrupted diagnosis resumes from them.
        Default: NAME-diagnosis in this folder, after the campaign's file or, where that is campaign.toml, its folder.
    holdout:
        A run to keep aside; may be given several times. Default: runs whose role in the campaign is "held-out". Every
        other run is predicted from the others in turn.
    effect:
        A Python file with an effect of your own, which is run and then tried with the others.
    time_limit:
        Seconds after which the best answer so far is given; it says so.
    json:
        Print result.json.
    """
    from ..objects.diagnosis import diagnose_campaign

    out = _named_after(Path(campaign)) if out is None else out
    result = diagnose_campaign(
        campaign,
        out,
        candidates=names(candidates),
        max_effects=max_effects,
        holdout=holdout,
        effect_files=effect,
        jobs=jobs,
        time_limit=time_limit,
        force=force,
        progress=_teller(),
    )
    if json:
        print(json_text(result))
    else:
        _print(result, out)
    return 0 if result["verdict"]["kind"] in ("complete", "missing") else UNRESOLVED


def _named_after(campaign: Path) -> Path:
    """Where the results go if nothing is said."""
    name = campaign.stem if campaign.name != "campaign.toml" else campaign.resolve().parent.name
    return Path(f"{name or 'campaign'}-diagnosis")


def _teller(clock: Callable[[], float] = time.perf_counter) -> Callable[[str, float], None]:
    """Progress on stderr: what was finished, the share of the stage, the time left; for a log only now and then.

    A stage begins where the share falls. How long it will take follows from the ``clock`` (s) and the share since then.
    """

    def show(text: str, share: float | None, spent: float, left: float | None) -> None:
        rest = "" if left is None else f", about {left:.0f} s left of this stage"
        print(f"{spent:6.0f} s  {text} ({100 * (share or 0.0):.0f} %{rest})", file=sys.stderr, flush=True)

    return paced(show, every=0.0 if sys.stderr.isatty() else EVERY, clock=clock)


def _free_table(ladder: list[dict[str, Any]]) -> Any:
    """Errors of the free simulations; None where there is none."""
    from rich.table import Table

    from .show import quantity

    rows = [(rung["added"], rung["free"]) for rung in ladder if rung.get("free")]
    if not rows:
        return None
    table = Table(
        title="Free simulation from arrest to arrest through unseen runs: error in % of the measured\n"
        "(in brackets: divided by the scatter between events)"
    )
    table.add_column("model")
    for name in ("recurrence", "slip", "creep before the onset", "slips missed"):
        table.add_column(name, justify="right")

    def error(part: dict[str, Any]) -> str:
        share = "-" if part["relative"] is None else f"{quantity(100.0 * part['relative'], '1', 2)} %"
        return share if part["scatters"] is None else f"{share} ({quantity(part['scatters'], '1', 2)})"

    for added, free in rows:
        errors = (error(free[name]) for name in ("recurrence", "slip", "creep"))
        table.add_row(f"+ {added}", *errors, f"{free['missed']} of {free['events']}")
    return table


def _print(result: dict[str, Any], out: Path) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from .show import quantity, told

    console = Console(width=None if sys.stdout.isatty() else 110)
    table = Table(title="Ladder of models: error in floors (1: as good as noise and scatter allow)")
    table.add_column("model")
    phases = list(dict.fromkeys(p for rung in result["ladder"] for p in rung["by_phase"]))
    table.add_column("cycles")
    for name in ("all", *phases):
        table.add_column(name, justify="right", no_wrap=True)
    for rung in result["ladder"]:
        label = "static" if rung["added"] is None else f"+ {rung['added']}"
        label = f"without {rung['removed']}" if rung["removed"] else label
        for which, total, parts in (
            ("fitted", rung["train_error"], rung["by_phase"]),
            ("unseen", rung["heldout_error"], rung["heldout_by_phase"]),
        ):
            if total is not None:
                table.add_row(label, which, quantity(total, "1", 3), *(quantity(parts.get(p), "1", 3) for p in phases))
            label = ""
    console.print(table)
    if (free := _free_table(result["ladder"])) is not None:
        console.print(free)
    verdict = result["verdict"]
    sure = "" if verdict["confidence"] is None else f" ({100 * verdict['confidence']:.0f} % if it is in the catalogue)"
    console.print(f"[bold]{verdict['kind']}[/bold]: {escape(verdict['text'])}{sure}", highlight=False)
    proposed = result["next_experiment"]
    for found in [proposed, *proposed.get("others", ())] if proposed else ():
        between = f" ({' or '.join(found['separates'])})" if proposed.get("others") else ""
        console.print(f"next experiment{between}: {escape(found['text'])}", highlight=False)
    rig = [finding["sentence"] for finding in result["rig"] if not finding["stops"]]  # the verdict says the others
    for text in [*rig, *result["notes"], *result["caution"]]:
        console.print(escape(text), highlight=False)
    repaired = told(result)
    lost = [f"left out: {text}" for text in result["dropped"]]
    for text in [*repaired, *lost[:8], *([f"... and {len(lost) - 8} more"] if len(lost) > 8 else [])]:
        console.print(escape(text), highlight=False)
    console.print(f"report in {escape(str(out / 'report.html'))}", highlight=False)
