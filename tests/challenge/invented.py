"""Challenges without campaigns: invented truths and results in the files of real ones, sealed like them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from stickslip.blind.run import _protocol
from stickslip.blind.seal import CASES, RUNS, TRUTH, digest, make_seal
from stickslip.system.runstore import file_record


def effect(tag: str, multiple: float, amplitude: float = 1.0, *, own: bool = False, form: str = "") -> dict[str, Any]:
    return {
        "tag": tag, "multiple": multiple, "amplitude": amplitude, "unit": "1", "form": form, "own_form": own,
    }  # fmt: skip


def result(
    kind: str,
    effects: tuple[str, ...] = (),
    among: tuple[str, ...] | None = None,
    base: float = 1.0,
    final: float | None = None,
    *,
    forms: dict[str, str] | None = None,
    confidence: float | None = None,
    text: str = "invented",
    **parameters: tuple[float, float],
) -> dict[str, Any]:
    """A ``result.json``; parameters as ``contact_ageing__rate=(value, std)``, forms of the last model by tag."""
    rungs = [("static", None, 500.0), ("inertia", "inertia", base)]
    if final is not None:
        rungs.append(("more", effects[0] if effects else "x", final))
    return {
        "schema": 1,
        "verdict": {"kind": kind, "effects": list(effects), "set": list(effects if among is None else among),
                    "text": text, "reasons": [], "confidence": confidence},
        "ladder": [
            {"model": [name], "added": added, "train_error": error, "heldout_error": error, "by_phase": {}}
            for name, added, error in rungs
        ],
        "ranking": [],
        "parameters": {
            name.replace("__", ".").replace("_", "-"): {"value": value, "std": std, "unit": "1", "doc": ""}
            for name, (value, std) in parameters.items()
        },
        **({} if forms is None else {
            "fitted_model": {"effects": [{"type": tag, "form": {"form": form}} for tag, form in forms.items()]},
        }),
        "next_experiment": None,
        "dropped": [],
        "seconds": 2.0,
    }  # fmt: skip


def make(
    folder: Path,
    cases: dict[str, tuple[str, list[dict[str, Any]]]],
    circumstances: dict[str, dict[str, bool]] | None = None,
) -> Path:
    """A sealed challenge of ``name: (kind, effects)`` with a campaign file and a trace of one line each."""
    files = [folder / TRUTH]
    for name in cases:
        (folder / CASES / name).mkdir(parents=True)
        for file in ("campaign.toml", "v100.csv"):
            path = folder / CASES / name / file
            path.write_text(f"# {name} {file}\n")
            files.append(path)
    (folder / TRUTH).parent.mkdir()
    listed = [
        {"name": name, "kind": kind, "effects": effects, **(circumstances or {}).get(name, {})}
        for name, (kind, effects) in cases.items()
    ]
    (folder / TRUTH).write_text(json.dumps({"schema": 1, "seed": 5, "cases": listed}))
    make_seal(folder, files, cases=len(cases))
    return folder


def answer(folder: Path, results: dict[str, dict[str, Any]]) -> None:
    """Write results as a run would; the protocol too."""
    runs = folder / RUNS
    runs.mkdir(exist_ok=True)
    _protocol(runs, digest(folder), {"candidates": None, "max_effects": 4})
    for name, content in results.items():
        (runs / name).mkdir()
        inputs = [file_record(path) for path in sorted((folder / CASES / name).iterdir())]
        (runs / name / "result.json").write_text(json.dumps({**content, "inputs": inputs}))
