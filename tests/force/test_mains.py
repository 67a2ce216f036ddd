"""Hum of the mains: found in the sticks where they are long enough, and what is left of it with the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.blind.generator import Run
from stickslip.blind.generator.rigs import draw_setup
from stickslip.blind.generator.sensor import SILENT
from stickslip.inference.force.fit import fit
from stickslip.inference.force.mains import Hum, detect_hum, hum
from stickslip.inference.force.problem import Problem

from .conftest import made

pytestmark = pytest.mark.slow

SIZE = 3e-9  # m
LONG = (Run("v050", 5e-5, 5), Run("v100", 1e-4, 5))
SHORT = (Run("v600", 6e-4, 6), Run("v700", 7e-4, 6))  # what is left of a stick is shorter than a period of the mains


def pair(folder, **options):
    """The same rig, read by a sensor that does not hum, and by one that does."""
    setup = draw_setup(np.random.default_rng(11))
    return {
        size: made(
            folder / str(size), 11, spring_known=True,
            setup=replace(setup, sensor=replace(SILENT, count=1e-9, white=2e-11, hum=size)), **options,
        )
        for size in (0.0, SIZE)
    }  # fmt: skip


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    return pair(tmp_path_factory.mktemp("long"), runs=LONG)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    return pair(tmp_path_factory.mktemp("short"), runs=SHORT, virgin=False)


def runs_of(case):
    return list(zip(case.traces, case.found, strict=True))


def test_it_is_detected_where_it_is_and_nowhere_else(cases):
    told = detect_hum(runs_of(cases[SIZE]), cases[SIZE].times.slip)
    assert told.frequency == 50.0
    assert told.amplitude == pytest.approx(SIZE, rel=0.03)
    assert detect_hum(runs_of(cases[0.0]), cases[0.0].times.slip) == Hum()


def test_it_is_told(cases, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp() / "long0"
    told = {size: ss.load_campaign(folder / str(size) / "campaign.toml").prepare().dropped for size in cases}
    assert not any("hum" in text for text in told[0.0])
    (text,) = (text for text in told[SIZE] if "hum" in text)
    assert "50 Hz, 3 nm" in text


@pytest.mark.parametrize("frequency", [50.0, 60.0])
def test_it_is_taken_off_to_a_hundredth_where_sticks_are_long(cases, frequency):
    case = cases[0.0]
    for trace, found in runs_of(case):
        t = np.asarray(trace.time)
        wave = SIZE * np.sin(2.0 * np.pi * frequency * t + 0.7)
        off = hum(t, trace.displacement + wave, trace, found, case.times.slip, Hum(frequency, SIZE))
        assert np.abs(off - wave).max() < SIZE / 100.0


def test_what_is_stated_is_looked_for_where_none_is_detected(short):
    case = short[SIZE]
    told = detect_hum(runs_of(case), case.times.slip)
    assert (told.frequency, told.amplitude) == (50.0, pytest.approx(SIZE))
    for trace, found in runs_of(case):
        assert not hum(trace.time, trace.displacement, trace, found, case.times.slip, case.times.hum).any()


def test_a_vibration_beside_the_mains_is_no_hum(cases):
    case = cases[0.0]
    trace, found = runs_of(case)[0]
    t = np.asarray(trace.time)
    for frequency in (44.0, 47.0, 53.0, 56.0):
        shaken = trace.displacement + SIZE * np.sin(2.0 * np.pi * frequency * t)
        assert not hum(t, shaken, trace, found, case.times.slip, Hum(50.0, SIZE)).any()


def test_what_is_left_of_it_is_found_with_the_model(short):
    """Without that, hum is the largest misfit after an arrest: the contact is stiff there."""
    still, case = short[0.0], short[SIZE]
    bare = [replace(k, hum=np.zeros_like(k.hum)) for k in case.knots]
    shared = still.point.common.size
    deaf, found, silent = (
        fit(problem, begin)
        for problem, begin in (
            (Problem(case.problem.composition, bare), replace(case.point, common=case.point.common[:shared])),
            (case.problem, case.point),
            (still.problem, still.point),
        )
    )
    size = np.hypot(*found.point.common[shared:].reshape(-1, 2).T) * case.times.hum.amplitude / np.sqrt(2.0)
    assert size == pytest.approx([SIZE] * len(SHORT), rel=0.1)
    assert deaf.cost > found.cost + 200.0
    ringing = [f.scatter.named()["ring-down"] for f in (silent, found, deaf)]
    assert ringing[1] < 2.0 * ringing[0] < 0.5 * ringing[2]
