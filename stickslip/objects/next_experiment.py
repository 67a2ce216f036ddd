"""The experiment that would separate effects that a campaign cannot, simulated for each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..inference.diagnose.model_ladder import Climbed
from ..inference.diagnose.search import Rung
from ..inference.diagnose.search_round import Round
from ..inference.diagnose.stepwise_selection import Diagnosis as Found
from ..inference.diagnose.work import Work
from ..system.progress import part
from .campaign import Campaign
from .experiments import Setting, SimulatedExperiment, practicable, scenario, simulate_rivals
from .fit import Fit
from .posterior import drawn_points, sample
from .result_base import Tell


def next_experiment(
    campaign: Campaign, found: Found, known: dict[str, Any] | None, work: Work = Work()
) -> dict[str, Any] | None:
    """What the catalogue knows to separate the effects of each set, with the experiments that are easily made.

    Args:
        campaign: that was diagnosed.
        found: where the search ended.
        known: of :func:`stickslip.inference.diagnose.summary.next_experiment`.
        work: how.
    """
    if known is None or found.prepared.prescribed:
        return known
    rounds = {tuple(j.tag for j in done.close): done for done in found.named.values() if len(done.close) > 1}
    every = [{key: value for key, value in known.items() if key != "others"}, *known.get("others", ())]
    made = [_with(campaign, found, one, rounds.get(tuple(one["separates"])), work) for one in every]
    return {**made[0], "others": made[1:]} if len(made) > 1 else made[0]


def sampled_experiments(
    campaign: Campaign, found: Found, draws: int, tune: int, seed: int, tell: Tell
) -> list[SimulatedExperiment]:
    """The experiments for the first set, the parameters of every model drawn from its posterior.

    Args:
        campaign, found: the diagnosis.
        draws, tune, seed: of :meth:`stickslip.Fit.sample`, one chain.
        tell: told the progress.

    Raises:
        InputError: no set of effects along the motion that the data cannot distinguish.
    """
    done = next((done for done in found.named.values() if len(done.close) > 1), None)
    if done is None or found.prepared.prescribed:
        raise InputError("there is no set of effects that an experiment along the motion could separate")
    fits = {j.tag: _fit(campaign, found, done, j.tag, j.candidate.fit) for j in done.close}
    first, drawn = next(iter(fits.values())), {}
    for i, (tag, fit) in enumerate(fits.items()):
        share = part(tell, i, len(fits) + 1, f"posterior with {tag}, ")
        drawn[tag] = drawn_points(fit, sample(fit, draws, tune, 1, seed, share))
    return simulate_rivals(first, fits, _options(first), part(tell, len(fits), len(fits) + 1), drawn=drawn)


def _with(campaign: Campaign, found: Found, known: dict[str, Any], done: Round | None, work: Work) -> dict[str, Any]:
    if done is None or not work.in_time():  # laws of the backbone have no model of their own along the motion
        return known
    fits = {j.tag: _fit(campaign, found, done, j.tag, j.candidate.fit) for j in done.close}
    first = next(iter(fits.values()))
    options = simulate_rivals(first, fits, _options(first), work.tell, until=work.in_time)
    if not options:
        return known
    return {**known, "text": _text(known["text"], options), "experiments": rows(options)}


def rows(options: Sequence[SimulatedExperiment]) -> list[dict[str, Any]]:
    """What is kept of experiments."""
    return [
        {"experiment": t.words, "information": t.information, "margin": t.margin, "odds": t.odds, "note": t.note}
        for t in options
    ]


def _fit(campaign: Campaign, found: Found, done: Round, tag: str, model: Any) -> Fit:
    """The model of a round with one effect of its set."""
    inertial = found.ladder[1].model
    parts = (*inertial, *(e.tag for e in done.base.problem.composition.effects), tag)
    return Fit(campaign, Climbed(found.prepared, (*found.ladder[:2], Rung.of(parts, tag, model)), {}))


def _options(model: Fit) -> dict[str, Setting]:
    """The experiments, beside the run of the middle velocity."""
    runs = sorted(model.fitted.runs, key=lambda run: abs(run.velocity))
    run = runs[len(runs) // 2]
    plain = Setting(run.name)
    block = scenario(model, replace(plain, velocity=f"{run.velocity:.6g} m/s")).file.block
    return practicable(plain, abs(run.velocity), block.spring_stiffness, block.mass)


def _text(known: str, options: list[SimulatedExperiment]) -> str:
    best = options[0]
    if best.note or best.margin < np.log(2.0):
        return f"{known} (no experiment of the usual kind is expected to separate them)"
    return f"{best.words}, after which the true one is expected to be {best.odds} as any other; or {known}"
