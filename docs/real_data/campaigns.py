"""Campaigns of measured records: their files, and the program run on them."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray

import stickslip as ss
from stickslip.cli import run
from stickslip.show.plots import save

DOCS = Path(__file__).resolve().parents[1]
FOLDERS = {
    "paper-slider": "paper-slider-ens",
    "laboratory-fault": "psu-stickslip-p5198",
    "paper-slider-speeds": "paper-slider-ens",
    "reciprocating-loops": "reciprocating-loops-200Hz",
    "reciprocating-loops-whole": "reciprocating-loops-200Hz",
    "drill-string": "torsional-rig-drillstring",
    "robot-joint": "robot-breakaway-creep/test1",
    "robot-joint-2": "robot-breakaway-creep/test1",
    "robot-loops": "robot-breakaway-creep/test3",
    "friction-damper": "friction-damper-brfd",
    "bolted-joint": "bolted-joint-brb",
    "rock-basalt": "rock-velocity-steps",
    "rock-sepiolite": "rock-velocity-steps",
    "classroom-slider": "classroom-slider",
}


def campaign(folder: Path, name: str, title: str, *parts: str) -> str:
    """A campaign file made of its parts."""
    path = folder / f"{name}.toml"
    path.write_text(f'schema = 1\ntitle = "{title}"\n' + "".join(parts), encoding="utf-8")
    return str(path)


def shipped(name: str, data: Path, work: Path) -> ss.Campaign:
    """A campaign of scenarios/real, with its records laid beside it but for those that are in ``work`` already."""
    work.mkdir(parents=True, exist_ok=True)
    path = Path(shutil.copy(DOCS.parent / "scenarios" / "real" / f"{name}.toml", work))
    for trace in tomllib.loads(path.read_text(encoding="utf-8"))["trace"]:
        for channel in (trace, *(c for c in trace.values() if isinstance(c, dict) and "file" in c)):
            if not (work / channel["file"]).exists():
                shutil.copy(data / FOLDERS[name] / channel["file"], work)
    return ss.load_campaign(path)


def program(*arguments: str) -> tuple[int, str]:
    """Run the command line; its exit code and what it said."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(list(arguments))
    return code, (out.getvalue() if code == 0 else err.getvalue()).strip()


def result(path: str, out: Path, *command: str) -> tuple[dict, xarray.Dataset]:
    """Run a command into a run folder; its result and arrays."""
    code, said = program(command[0], path, *command[1:], "--out", str(out), "--force")
    if code:
        raise SystemExit(f"{' '.join(command)} {path} failed: {said}")
    with xarray.open_dataset(out / "arrays.nc", engine="h5netcdf") as data:
        return json.loads((out / "result.json").read_text(encoding="utf-8")), data.load()


def keep(picture: Any, name: str, dpi: int = 80) -> None:
    """Keep a picture of the page."""
    save(picture, DOCS / "figures" / f"{name}.png", dpi=dpi)


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))
