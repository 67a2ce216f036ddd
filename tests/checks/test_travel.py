"""Travel of a block over whole cycles, on motions that are written down."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.checks.sign import sign_findings
from stickslip.data.checks.travel import travel
from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace

SLIP, LAST = 45e-6, 0.03  # m, s


def pulled(drive: Drive, stop: float, scatter: float = 0.0, factor: float = 1.0) -> Trace:
    """A block that slips by half cosines whenever the spring is 200 um long (and a little scatter), either way."""
    rng = np.random.default_rng(1)
    t = np.arange(0.0, stop, 5e-4)
    way, x, k = drive.position(t), np.zeros_like(t), 0
    while k < t.size:
        strength = 200e-6 + scatter * rng.standard_normal()
        due = np.flatnonzero(np.abs(way[k:] - x[k:]) > strength)
        if not due.size:
            break
        k += int(due[0])
        # a slip that begins higher ends lower
        size = np.sign(way[k] - x[k]) * (SLIP + 2.0 * (strength - 200e-6))
        x[k:] += 0.5 * size * (1.0 - np.cos(np.pi * np.clip((t[k:] - t[k]) / LAST, 0.0, 1.0)))
        k += int(LAST / 5e-4) + 2
    noise = 1e-9 * rng.standard_normal(t.size)
    return Trace("run", t, displacement=factor * x + noise, drive=drive, noise=1e-9)


STEADY = Drive.constant(50e-6, 0.0, 20.0)
FORTH_AND_BACK = Drive(np.array([0.0, 12.0, 26.0]), np.array([0.0, 600e-6, -200e-6]))
HELD = Drive(np.array([0.0, 8.0, 9.0, 20.0]), np.array([0.0, 400e-6, 400e-6, 950e-6]))


@pytest.mark.parametrize("drive", [STEADY, FORTH_AND_BACK, HELD, Drive.constant(-50e-6, 0.0, 20.0)])
@pytest.mark.parametrize("factor", [1.0, 1.07])
@pytest.mark.parametrize("scatter", [0.0, 2e-6])
def test_the_slope_is_the_scale_within_its_error(drive, factor, scatter):
    trace = pulled(drive, float(drive.times[-1]), scatter, factor)
    seen = travel(trace, segment(trace))
    assert abs(seen.slope - factor) < 3.0 * seen.std
    assert seen.std < 0.03
    assert seen.release == pytest.approx(factor * SLIP, rel=0.1)
    assert sign_findings([trace]) == []


def test_few_slips_know_less():
    long, short = (travel(t, segment(t)) for t in (pulled(STEADY, 20.0, 2e-6), pulled(STEADY, 7.5, 2e-6)))
    assert short.slips < long.slips
    assert short.std > 2.0 * long.std


def test_a_clock_that_the_pieces_of_the_drive_contradict():
    trace = pulled(HELD, 19.0)
    slow = trace.replace(time=1.1 * trace.time)
    assert travel(trace, segment(trace)).clock == pytest.approx(1.0, abs=0.004)
    assert travel(slow, segment(slow)).clock == pytest.approx(1.0 / 1.1, abs=0.01)
    steady = pulled(STEADY, 20.0)
    assert travel(steady, segment(steady)).clock is None


def test_a_block_that_slides_against_its_drive():
    t = np.arange(0.0, 5.0, 1e-3)
    noise = 1e-9 * np.random.default_rng(2).standard_normal(t.size)
    trace = Trace("slides", t, displacement=-50e-6 * t + noise, drive=Drive.constant(50e-6, 0.0, 5.0), noise=1e-9)
    (found,) = sign_findings([trace])
    assert found.value == pytest.approx(-1.0, abs=0.01)
    assert "against its drive" in segment(trace).reason
