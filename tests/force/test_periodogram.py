"""The period of a wave is met as closely as a whole run resolves it, however long the run is."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force import periodogram
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit
from stickslip.inference.force.periodogram import best_wave, waves
from stickslip.inference.force.signatures import Explained, signatures
from stickslip.physics.effects import catalogue
from stickslip.physics.params import specs

from .conftest import made, seen

DEPTH = 0.003


@pytest.fixture(scope="module")
def base(small):
    return fit(small.problem, small.point)


def wave(base, frequency, phases):
    """What a modulated load of this frequency does to the residual force."""
    effect = catalogue.get("load-modulation")()
    pair = signatures(base, effect, [{"frequency": frequency, "phase": turn} for turn in (0.0, 0.5 * np.pi)])
    run = base.problem.run
    return DEPTH * (pair[0] * np.cos(phases[run]) + pair[1] * np.sin(phases[run]))


def laid_over(base, force):
    """The residuals of a fit with a force taken off the model's."""
    explained = Explained(base)
    explained.rest = explained.rest - explained.orthogonal(force[:, None])[:, 0]
    return explained


def longest(base):
    return max(float(np.ptp(k.t)) for k in base.problem.runs)


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [2.3, 17.13, 47.77, 83.4])
def test_a_wave_laid_over_the_residuals_is_found(base, frequency):
    phases = np.array([0.4, -2.1])
    found = best_wave(base, laid_over(base, wave(base, frequency, phases)), catalogue.get("load-modulation")())
    assert found.value == pytest.approx(frequency, abs=0.25 / longest(base))
    assert found.amplitude == pytest.approx(DEPTH, rel=0.15)
    middle = np.array([np.mean(k.t) for k in base.problem.runs])
    ahead = found.phases - phases + 2.0 * np.pi * (found.value - frequency) * middle
    assert np.cos(ahead) == pytest.approx(1.0, abs=0.05)


def test_turned_columns_explain_what_columns_at_their_own_frequency_do(base):
    """Falls between the frequencies of the coarse grid against signatures taken there."""
    frequency = 31.7
    explained = laid_over(base, wave(base, frequency, np.array([0.4, -2.1])))
    effect = catalogue.get("load-modulation")()
    grid, step = periodogram._grid(base, "t", specs(effect)["frequency"], "frequency")
    one = np.searchsorted(grid, frequency)
    columns = periodogram._Frequencies(base, effect)(grid[one : one + 1])
    edges = np.array([grid[one - 1], grid[one]])  # up to a whole spacing away
    fine, falls = periodogram._turned(base, explained, columns, grid[one : one + 1], edges, step, "t")
    at = int(np.argmin(np.abs(fine - frequency)))
    pair = periodogram._Frequencies(base, effect)(fine[at : at + 1])
    exact, _ = explained.gain(periodogram.by_run(base, pair))
    assert falls[at] == pytest.approx(exact, rel=0.15)


def test_a_trend_has_no_period():
    cls = catalogue.get("position-dependent-friction")
    assert waves(cls(form="wave")) and not waves(cls(form="trend"))


@pytest.mark.slow
def test_a_modulated_load_of_the_generator_is_found_with_its_period(tmp_path):
    case = made(tmp_path / "case", 11, [seen("load-modulation", "sine", 10.0)], spring_known=True)
    base = fit(case.problem, case.point)
    found = try_effect(base, Explained(base), "load-modulation", [{}])[0]
    hidden = case.truth["effects"][0]
    assert found.fit.values["load-modulation.frequency"] == pytest.approx(
        hidden["inner"]["MOD_F"], abs=0.1 / longest(base)
    )
    assert found.fit.values["load-modulation.depth"] == pytest.approx(abs(hidden["amplitude"]), rel=0.1)
