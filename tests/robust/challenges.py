"""Sealed challenges of a few cases, and an invented diagnosis that works piece by piece as the real one does."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from stickslip.blind.seal import CASES, TRUTH, make_seal
from stickslip.objects.checkpoints import FinishedParts
from stickslip.system.runstore import file_record, open_run


def _line(folder: Path) -> None:
    """A campaign that is one line."""
    (folder / "campaign.toml").write_text(f"# {folder.name}\n")


def challenge(folder: Path, number: int = 4, campaign: Callable[[Path], object] = _line) -> Path:
    """A sealed challenge; ``campaign`` writes the files of a case into its folder."""
    names = [f"case-{i:03d}" for i in range(1, number + 1)]
    files = [folder / TRUTH]
    for name in names:
        (folder / CASES / name).mkdir(parents=True)
        campaign(folder / CASES / name)
        files += sorted((folder / CASES / name).iterdir())
    (folder / TRUTH).parent.mkdir()
    cases = [{"name": name, "kind": "none", "effects": []} for name in names]
    (folder / TRUTH).write_text(json.dumps({"schema": 1, "seed": 5, "cases": cases}))
    make_seal(folder, files, cases=len(cases))
    return folder


def piecewise(campaign: Path, out: Path) -> None:
    """Eight pieces of a tenth of a second, each kept; the result depends on all of them."""
    seed = int.from_bytes(out.name.encode(), "little") % 2**32
    with open_run(out, resume=True) as run:
        store, total = FinishedParts(run, "inputs"), np.zeros(1000)
        for n in range(8):
            kept = store.load(f"piece{n}")
            if kept is None:
                time.sleep(0.1)
                kept = {"z": np.random.default_rng([seed, n]).normal(size=1000)}
                store.save(f"piece{n}", kept)
            total += kept["z"]
        run.json(
            {
                "verdict": {"kind": "complete", "effects": [], "set": [], "text": "", "reasons": []},
                "ladder": [], "parameters": {}, "inputs": [file_record(campaign)], "seconds": time.time(),
                "total": total,
            }
        )  # fmt: skip
