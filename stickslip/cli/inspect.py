"""``stickslip inspect``: the traces of a campaign, their events, repairs, and what the data can tell."""

from __future__ import annotations

import time
from pathlib import Path

from ..system.runstore import json_text, refuse_existing
from .parameters import CampaignFile, Flag, Force


def inspect(campaign: CampaignFile, *, out: Path | None = None, json: Flag = False, force: Force = False) -> int:
    """Traces of a campaign, their events, repairs, omissions, and what the data can tell.

    Parameters
    ----------
    out:
        Folder for result.json, arrays.nc, a picture of every trace and report.html.
    json:
        Print everything as JSON, with the events of every trace, instead of a table.
    """
    from ..objects.campaign import load_campaign

    refuse_existing(out, force)
    began = time.perf_counter()
    found = load_campaign(campaign).inspect()
    seconds = {"seconds": round(time.perf_counter() - began, 3)}
    if out is not None:
        found.save(out, force, **seconds)
    if json:
        print(json_text({**found.result, **seconds}))
    else:
        from ._inspected import text, width

        print(text(found.result, found.variables, out, width()))
    return 0
