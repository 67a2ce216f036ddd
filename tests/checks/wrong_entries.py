"""How often a wrong entry in a campaign file is noticed, and a right one suspected: what docs/checks.md tabulates.

``python -m tests.checks.wrong_entries FOLDER --number N --seed S`` makes N campaigns of the independent
simulator, every other one with an effect hidden at ten times its detection, and checks each as it is and with one entry
wrong of every kind, its run and size drawn. Only the checks run, no diagnosis. What is made stays in the folder.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.blind.detection import amplitude, largest_multiple, visible_forms
from stickslip.blind.generator import make_campaign
from stickslip.blind.generator.forms import EFFECTS
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.checks import Finding, rig_against_motion
from stickslip.data.segment import segment
from stickslip.errors import InputError
from tests.kept_results import keep

HIDDEN = ("sensor-gain", "wear", "position-dependent-friction", "velocity-weakening", "sensor-drift")
MULTIPLE = 10.0  # of detection, or the largest that is plausible
SIZES = (0.03, 0.05, 0.1, 0.2, 0.3)
RUNS = ("v050", "v100", "v200", "v400", "holds")
# kind -> what a right finding names
KINDS = {
    "velocity": "drive velocity", "scale": "displacement scale", "clock": "time", "sign": "sign", "unit": "",
    "mass": "mass", "spring": "spring",
}  # fmt: skip
SIZED = ("velocity", "scale", "clock", "mass", "spring")


def hidden(tag: str, sign: float) -> tuple[str, float, str]:
    """An effect in its first form at ten times its detection, or the largest plausible amplitude if that is less."""
    form = visible_forms(EFFECTS[tag])[0].name
    multiple = min(MULTIPLE, largest_multiple(EFFECTS[tag], form))
    return tag, amplitude(EFFECTS[tag], form, multiple, sign), form


def _scaled(factor: float) -> Callable[[re.Match[str]], str]:
    return lambda m: f"{m[1]}{float(m[2]) * factor:.8g}{m[3]}"


def wrong(text: str, kind: str, run: str, factor: float) -> str:
    """The campaign file with one entry wrong by a factor (which the kinds "sign" and "unit" do not use)."""
    if kind in ("mass", "spring"):
        key = {"mass": r"(mass = \")([^ ]+)( kg)", "spring": r"(spring_stiffness = \")([^ ]+)( N/m)"}[kind]
        return re.sub(key, _scaled(factor), text)
    head, *tables = text.split("[[trace]]")
    at = next(i for i, table in enumerate(tables) if f'"{run}.csv"' in table)
    pattern, by = {
        "velocity": (r"(velocity = \")([^ ]+)( um/s)", factor),
        "sign": (r"(velocity = \")([^ ]+)( um/s)", -1.0),
        "scale": (r"(unit = \")([^ ]+)( nm\")", factor),
        "unit": (r"(unit = \")([^ ]+)( nm\")", 1000.0),
        "clock": (r"(sampling_rate = \")([^ ]+)( kHz)", factor),
    }[kind]
    tables[at] = re.sub(pattern, _scaled(by), tables[at])
    return "[[trace]]".join([head, *tables])


def findings(path: Path) -> tuple[Finding, ...] | str:
    """What is found, or how the campaign is refused."""
    try:
        campaign = load_campaign(path)
        traces = load_traces(campaign)
    except InputError as error:
        return str(error)
    return rig_against_motion(campaign, traces, [segment(t) for t in traces])


@dataclass(frozen=True)
class Tried:
    """One campaign file, and what was said of it."""

    campaign: int
    effect: str
    kind: str
    size: float
    run: str
    noticed: bool
    right: bool
    alone: bool
    said: list[str]


def try_one(folder: Path, number: int, effect: str, kind: str, size: float, run: str, sign: float) -> Tried | None:
    """One entry made wrong, or none; None where the file does not hold that entry."""
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    changed = wrong(text, kind, run, 1.0 + sign * size) if kind else text
    if kind and changed == text:
        return None
    path = folder / "changed.toml"
    path.write_text(changed, encoding="utf-8")
    found = findings(path)
    if isinstance(found, str):
        return Tried(number, effect, kind, size, run, True, kind == "unit", kind == "unit", [found])
    stops = [f for f in found if f.stops]
    named = [f for f in stops if KINDS.get(kind, "") in f.what and (kind in ("mass", "spring") or f.run == run)]
    alone = len(stops) == 1 and bool(named) and (kind == "unit" or " or " not in named[0].what)
    said = [f"{f.what} [{f.run}]: {f.value:.6g} +- {f.std:.2g} {f.unit}, stated {f.stated:.6g}" for f in found]
    return Tried(number, effect, kind, size, run, bool(stops), bool(named), alone, said)


def campaigns(folder: Path, number: int, seed: int) -> Iterator[Tried]:
    """Every campaign as it is, and with one entry wrong of every kind."""
    for i in range(number):
        rng = np.random.default_rng([seed, i])
        tag = HIDDEN[(i // 2) % len(HIDDEN)] if i % 2 else ""
        effects = (hidden(tag, rng.choice([-1.0, 1.0])),) if tag else ()
        here = folder / f"{seed}-{i:03d}"
        new_lines, virgin, made = bool(rng.random() < 0.5), bool(rng.random() < 0.5), int(rng.integers(2**31))
        if not (here / "campaign.toml").exists():
            try:
                make_campaign(here, made, effects, new_lines=new_lines, virgin=virgin)
            except InputError as error:
                print(f"{i}: not made ({error})", flush=True)
                continue
        for kind in ("", *KINDS):
            size = float(rng.choice(SIZES)) if kind in SIZED else 0.0
            run, sign = str(rng.choice(RUNS)), float(rng.choice([-1.0, 1.0]))
            done = try_one(here, i, tag, kind, size, run, sign)
            if done is not None:
                yield done


def _share(tried: list[Tried]) -> dict[str, Any]:
    return {
        "tried": len(tried),
        **{name: sum(getattr(t, name) for t in tried) for name in ("noticed", "right", "alone")},
    }


def shares(tried: list[Tried]) -> dict[str, Any]:
    """Numbers noticed: by kind and size, and of files with nothing wrong by hidden effect."""
    wrongs = [t for t in tried if t.kind]
    by_kind = {
        kind: {
            f"{100 * size:.0f} %" if size else "all": _share([t for t in wrongs if t.kind == kind and t.size == size])
            for size in (SIZES if kind in SIZED else (0.0,))
        }
        for kind in KINDS
    }
    right = [t for t in tried if not t.kind]
    false = {tag or "nothing": _share([t for t in right if t.effect == tag]) for tag in ("", *HIDDEN)}
    return {"wrong": by_kind, "nothing wrong": {k: {n: v[n] for n in ("tried", "noticed")} for k, v in false.items()}}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--number", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=np.inf, help="begin no further file after so long")
    options = parser.parse_args()
    began, tried = time.monotonic(), []
    for one in campaigns(options.folder, options.number, options.seed):
        tried.append(one)
        if one.kind not in ("mass", "spring") and (one.noticed != bool(one.kind) or one.right != bool(one.kind)):
            print(one, flush=True)
        if time.monotonic() - began > options.seconds:
            break
    number = len({t.campaign for t in tried})
    found = {"seed": options.seed, "campaigns": number, **shares(tried)}
    print(json.dumps(found, indent=1))
    command = f"python -m tests.checks.wrong_entries FOLDER --number {number} --seed {options.seed}"
    keep("rig_checks", command, **found)


if __name__ == "__main__":
    main()
