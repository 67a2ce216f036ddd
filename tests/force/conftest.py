"""Small campaigns of the challenge's generator, an independent simulator: made once, loaded once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from stickslip.blind.detection import detection
from stickslip.blind.generator import Run, make_campaign
from stickslip.blind.generator.forms import EFFECTS
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import Segmentation, segment
from stickslip.data.trace import Trace
from stickslip.inference.fit.resonance import ringing
from stickslip.inference.force.knots import Knots, knots
from stickslip.inference.force.point import Point
from stickslip.inference.force.problem import Problem
from stickslip.inference.force.scales import Scales, scales
from stickslip.inference.force.starting_values import begin

SMALL = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 4))


@dataclass(frozen=True)
class Case:
    """A campaign as a fit begins with it.

    Attributes:
        truth: of the generator.
        rig: as it is stated.
        traces, found, knots, times: data, events, runs at their knots, and the times they were thinned by.
        problem, point: the base and where its fit begins.
    """

    truth: dict[str, Any]
    rig: Any
    traces: list[Trace]
    found: list[Segmentation]
    knots: list[Knots]
    times: Scales
    problem: Problem
    point: Point


def made(folder: Any, seed: int, effects: Any = (), runs: tuple[Run, ...] = SMALL, **options: Any) -> Case:
    """A campaign made and loaded."""
    truth = make_campaign(folder, seed, effects, runs=runs, **options)
    campaign = load_campaign(folder / "campaign.toml")
    traces = load_traces(campaign)
    found = [segment(t) for t in traces]
    times = scales(list(zip(traces, found, strict=True)), ringing(traces, found), traces[0].sampling_rate)
    thinned = [knots(t, s, times) for t, s in zip(traces, found, strict=True)]
    problem, point = begin(campaign.rig, traces, found, thinned, times)
    return Case(truth, campaign.rig, traces, found, thinned, times, problem, point)


def seen(tag: str, form: str, multiple: float) -> tuple[str, float, str]:
    """An effect to be hidden, at a multiple of the amplitude from which it can be seen."""
    return tag, multiple * detection(EFFECTS[tag], form), form


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Two runs of four events with nothing hidden, the contact virgin and the spring known."""
    return made(tmp_path_factory.mktemp("small") / "case", 11, spring_known=True)


@pytest.fixture(scope="session")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """The same from a record that begins with the spring stretched, its stiffness unknown."""
    return made(tmp_path_factory.mktemp("begun") / "case", 11, spring_known=False, virgin=False)
