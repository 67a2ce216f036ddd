"""``stickslip fit``: the static or the dynamic model against a campaign."""

from __future__ import annotations

import re
import sys
import textwrap
import time as clock
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any, Literal

from ..errors import InputError
from ..system.progress import working
from ..system.runstore import json_text, refuse_existing
from ..system.units import to_si
from . import show
from .parameters import CampaignFile, Files, Force, Json, OutFolder, Several

if TYPE_CHECKING:
    from ..objects.fit import Fit
    from ..objects.static_fit import StaticFit

_BETWEEN = re.compile(r"(?<=\.) (?=[A-Z])")  # sentences


def fit(
    campaign: CampaignFile,
    *,
    model: Literal["static", "inertial"] = "inertial",
    out: OutFolder = None,
    add: Several = (),
    effect: Files = (),
    profile: Several = (),
    holdout: Several = (),
    align: Literal["consistent", "paper"] = "consistent",
    time: Literal["exact", "paper"] = "exact",
    v_lim: str = "1 um/s",
    sampling: Literal["log", "uniform"] = "log",
    json: Json = False,
    force: Force = False,
) -> int:
    """Fit the static or the dynamic model to a campaign, and say where it fails.

    Parameters
    ----------
    model:
        static (creep without inertia, one process after the other) or inertial (all runs together).
    add:
        Put an effect into the dynamic model: --add contact-ageing. Another form of its law than the usual one:
        --add machine-compliance:where=series. May be given several times. --add inertia fits how much mass moves with
        the block, such as that of the spring.
    effect:
        A Python file with an effect of your own, to be used with --add. Its code is run.
    profile:
        Profile likelihood of a parameter: --profile weakening.drop. May be given several times.
    holdout:
        A run that is held out of all fits: --holdout v400. May be given several times. Default: runs whose
        role in the campaign is "held-out", else none. Of the others each is predicted from a fit without it.
    align:
        Static: which point of the model's curve is shifted onto the measured passage of v_lim: its own passage, or
        (paper) its end.
    time:
        Static: virtual time with the block's own motion (exact) or without it (paper).
    v_lim:
        Static: speed of the block at which a creep process ends.
    sampling:
        Static: windows even in the logarithm of the time left, or even in time as in the paper.
    """
    from ..objects.campaign import load_campaign
    from ..objects.fit import fit as fit_dynamic
    from ..objects.static_fit import fit_static

    speed = to_si(v_lim, "m/s", key="--v-lim")
    dynamic = {"--add": add, "--profile": profile, "--holdout": holdout}
    _check(model, dynamic, speed)
    refuse_existing(out, force)
    began = clock.perf_counter()
    loaded = load_campaign(campaign, effect)
    if model == "static":
        _ = loaded.findings  # a rig that cannot be is refused
        with working("creep processes") as tell:
            found: StaticFit | Fit = fit_static(
                loaded, align=align, time=time, v_lim=speed, sampling=sampling, progress=tell
            )
        profiles = {}
    else:
        for finding in loaded.findings:  # before minutes of fitting, in which a wrong unit may be mended
            print(finding.sentence, file=sys.stderr)
        with working("fitting") as tell:
            fitted = fit_dynamic(loaded, add, holdout=holdout, key="--add", profiles=profile, progress=tell)
            fitted.confirm(tell)
            profiles = {"profiles": [fitted.profile(name, tell) for name in profile]}
        found = fitted
    more = {**profiles, "seconds": round(clock.perf_counter() - began, 3)}
    result = {**found.result, **more}
    if out is not None:
        found.save(out, force, **more)
    print(json_text(result) if json else _folded(_text(result, out)))
    return 0


def _check(model: str, dynamic: dict[str, tuple[str, ...]], speed: float) -> None:
    for what in (flag for flag, given in dynamic.items() if given and model == "static"):
        raise InputError(f"{what} belongs to the dynamic model", key=what, hint="leave it out, or use --model inertial")
    if speed <= 0:
        raise InputError("the speed must be positive", key="--v-lim", value=speed)


def _folded(text: str) -> str:
    """Long lines broken between words on a terminal; as they are in a file."""
    if not sys.stdout.isatty():
        return text
    most = max(get_terminal_size().columns, 20)
    lines: list[str] = []
    for line in text.splitlines():
        short = len(line) <= most or line.startswith(" ")
        lines += [line] if short else textwrap.wrap(line, most, subsequent_indent="  ", break_long_words=False)
    return "\n".join(lines)


def _named(model: list[str]) -> str:
    """A list of tags as one name; the effect inertia, beside the inertia of the block, by what it does."""
    first = model.index("inertia") if "inertia" in model else -1
    return " + ".join("added mass" if tag == "inertia" and i != first else tag for i, tag in enumerate(model))


def _gains_of_effects(gains: dict[str, float]) -> list[str]:
    """What each added effect takes off the cost."""
    return [
        f"{tag} takes {f'{gain:.1f}' if gain > 0.05 else 'nothing'} off the cost (twice the negative logarithm of the "
        "likelihood, priors included)"
        for tag, gain in gains.items()
    ]


def _text(result: dict[str, Any], out: Path | None) -> str:
    """What is printed."""
    rig = [finding["sentence"] for finding in result["rig"]]
    lines = [f"{result['title']}: {result['model']} model", *rig, *result["notes"]]
    for key in ("static", "ramps"):
        if result.get(key):
            lines += ["", *_BETWEEN.split(result[key]["text"])]
    if result.get("ladder"):
        ladder = result["ladder"]
        phases = list(dict.fromkeys(phase for step in ladder for phase in step["by_phase"]))
        rows = [
            [
                _named(step["model"]),
                *(show.quantity(step[k], "1", 3) for k in ("train_error", "heldout_error")),
                *(show.quantity(step["by_phase"].get(phase), "1", 3) for phase in phases),
            ]
            for step in ladder
        ]
        lines += ["", "Errors in floors of the last model (1: as good as noise and scatter allow)"]
        lines += [show.table(["model", "error", "on unseen runs", *phases], rows)]
        lines += [*_gains_of_effects(result["gains"]), *result["caution"]]
    if result.get("parameters"):
        rows = [
            [name, show.quantity(p["value"], p["unit"]), "+-", show.quantity(p["std"], p["unit"], 3), p["note"]]
            for name, p in result["parameters"].items()
        ]
        lines += ["", show.table(["parameter", "value", "", "std", ""], rows)]
    if result.get("backbone"):
        lines += ["", *_BETWEEN.split(result["backbone"]["text"])]
    lines += [f"- {text}" for text in result.get("identifiability", ())]
    lines += [p["text"] for p in result.get("profiles", ())]
    lines += ["", *show.told(result)]
    lost = result.get("dropped", ())
    lines += ["", *(f"left out: {text}" for text in lost[:8])]
    if len(lost) > 8:
        lines.append(f"... and {len(lost) - 8} more: --json, or the report of --out")
    lines += [f"{result['seconds']:.1f} s", show.kept(out)]
    return "\n".join(lines)
