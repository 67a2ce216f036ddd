"""``stickslip forecast``: when the next slip comes, as a distribution, scored on slips that were not seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..system.progress import working
from ..system.runstore import json_text, refuse_existing
from . import show
from .parameters import CampaignFile, Force, Json, OutFolder


def forecast(
    campaign: CampaignFile,
    *,
    run: str | None = None,
    train: float = 0.5,
    at: float | None = None,
    out: OutFolder = None,
    json: Json = False,
    force: Force = False,
) -> int:
    """Forecast the next slip from how strength wanders and load rises, and score it on unseen slips.

    Parameters
    ----------
    run:
        The run to be forecast. Default: the one with the most slips.
    train:
        Share of the run's length from which everything is learned; the rest is forecast.
    out:
        Folder for result.json, arrays.nc and report.html; an interrupted forecast resumes from its finished parts.
    at:
        Forecast once in each stick, so many mean recurrences after the arrest (0.5: half of one). Default: moments
        all along, ten in a mean recurrence.
    """
    from ..objects.campaign import load_campaign

    refuse_existing(out, force)
    loaded = load_campaign(campaign)
    with working("forecasting") as tell:
        result = loaded.forecast(run, train, at, out=out, force=force, progress=tell).result
    print(json_text(result) if json else _text(result, out))
    return 0


def _text(result: dict[str, Any], out: Path | None) -> str:
    """What is printed."""
    train, score, ties = result["train"], result["score"], result["levels"]
    lines = [
        f"{result['title']}: {result['run']}, {train['of']} slips, {train['slips']} of them for training",
        f"level at onset: varies by {100 * ties['variation']:.2g} %; less a running mean over {ties['window']} slips "
        f"its correlation is {ties['carried_over']:.2f} with the level at the next onset, {ties['with_arrest']:.2f} "
        f"with that at the arrest, {ties['with_waiting']:.2f} with the time since the last onset",
        result["coordinate"]["text"],
        "",
    ]
    rows = [
        [name, show.quantity(m["crps"], "s", 3), f"{100 * m['coverage_50']:.0f} %", f"{100 * m['coverage_90']:.0f} %",
         show.quantity(m["mae"], "s", 3), f"{m['r2']:.3f}"]
        for name, m in result["methods"].items()
    ]  # fmt: skip
    lines += [show.table(["time to the next slip by", "CRPS", "in 50 %", "in 90 %", "mean error", "R2"], rows), ""]
    lines.append(f"{score['forecasts']} forecasts of {score['slips']} slips. {' '.join(result['notes'])}")
    for name, g in result["gains"].items():
        lines.append(f"CRPS below that of {name} by {100 * g['share']:.0f} % (+-{100 * g['std']:.0f} %)")
    if result["next"] is not None:
        q = {k: show.quantity(v, "s", 3) for k, v in result["next"].items()}
        lines.append(
            f"After the end of the record the next slip comes in {q['0.5']} (median; half of the forecast from "
            f"{q['0.25']} to {q['0.75']}, nine tenths from {q['0.05']} to {q['0.95']})"
        )
    lines += [f"left out: {text}" for text in result["dropped"]]
    lines += [f"{result['seconds']:.1f} s", show.kept(out)]
    return "\n".join(lines)
