"""Rocks: one step of the velocity each, and the laws that describe it as well as the one it is made for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.errors import StickslipError
from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.inference.force.prescribed import applies
from stickslip.physics.effects import catalogue
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, plain, styled

from .along_the_motion import along_runs
from .campaigns import keep, rms, shipped
from .usual_rate_and_state import usual

RECORDS = {"basalt": 20e6, "sepiolite": 30e6}  # N, that the campaign files scale the friction with
LAW = "rate-and-state"


def rocks(data: Path, work: Path) -> dict[str, Any]:
    """Both records: what the program says, the law for such records, and every other law in its place."""
    steps, made = {}, {}
    for name in RECORDS:
        campaign = shipped(f"rock-{name}", data, work / "rocks")
        steps[name] = campaign, campaign.fit([LAW])
        (trace,) = campaign.traces
        found = usual(trace.time, trace.drive.position(trace.time), trace.spring_force / RECORDS[name])
        made[name] = {**stepped(*steps[name]), "usual": found}
    keep(picture({name: fit for name, (_, fit) in steps.items()}), "real-rocks")
    return {"steps": made, "dispersion": DISPERSION}


def stepped(campaign: ss.Campaign, fit: ss.Fit) -> dict[str, Any]:
    """What a single step says."""
    try:
        said = campaign.diagnose().verdict["text"]
    except StickslipError as error:
        said = error.what
    own = fit.parameters.loc[[i for i in fit.parameters.index if i.startswith(f"{LAW}.")]]
    base, last = (rung.fit for rung in fit.climbed.ladder[-2:])
    assert base is not None and last is not None
    level = float(np.quantile(np.abs(along_runs(base.problem)[0]), 0.95))
    prepared = campaign.prepare()
    rivals = []
    for tag in catalogue.tags():
        cls = catalogue.get(tag)
        if tag == LAW or cls.drawn or not applies(tag) or not prepared.shows(cls):
            continue
        try:
            other = campaign.fit([tag])
        except StickslipError:
            continue  # it only gives the backbone another shape, or nothing finite comes of it
        rivals.append(row(tag, base, other))
    return {
        "title": campaign.title, "says": said, "events": int(base.problem.events),
        "fitted": [rms(f.marginal) / level for f in (base, last)],
        "law": {name: [float(r["value"]), float(r["std"]), str(r["unit"])] for name, r in own.iterrows()},
        "laws": sorted([row(LAW, base, fit), *rivals], key=lambda r: -r["gain"]),
    }  # fmt: skip


def row(tag: str, base: Any, fit: ss.Fit) -> dict[str, Any]:
    """A law in place of the one for such records: the fall of the cost, and its own parameters."""
    return {
        "law": tag, "gain": base.cost - fit.force_fit.cost, "parameters": len(fit.free) - len(base.free),
        "fitted": rms(fit.force_fit.marginal) / float(np.quantile(np.abs(along_runs(base.problem)[0]), 0.95)),
    }  # fmt: skip


@styled
def picture(fits: dict[str, ss.Fit]) -> Any:
    """Friction against time from the step, measured, by the base and with the law; and what either leaves."""
    made, axes = figure(2, 2, width=10.0, height=6.0)
    for (name, fit), (left, right) in zip(fits.items(), axes, strict=True):
        base, last = (rung.fit for rung in fit.climbed.ladder[-2:])
        assert base is not None and last is not None
        (run,) = base.problem.runs
        mu = along_runs(base.problem)[0] / RECORDS[name]
        t = run.at - run.at[0]
        left.plot(t, mu, ".", ms=3, color=DARK, label="measured")
        for one, color, line, label in ((base, LIGHT, "-", "base"), (last, MIDDLE, "--", f"base + {LAW}")):
            left.plot(t, mu - one.marginal / RECORDS[name], line, color=color, lw=1.0, label=label)
            right.plot(t, 1e3 * one.marginal / RECORDS[name], line, color=color, lw=1.0)
        left.set(xlabel="time / s", ylabel="friction", title=plain(name))
        right.set(xlabel="time / s", ylabel="measured - model / 1e-3", title=plain(name))
    made.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="x-small")
    return made
