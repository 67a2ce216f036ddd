"""A reading that jumps during a slip: found where it was, with its size, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.blind.generator import Run
from stickslip.data.segment import segment
from stickslip.inference.force.fit import fit_base
from stickslip.inference.force.fit_arrays import fit_arrays, fit_of
from stickslip.inference.force.jumps import jumps
from stickslip.inference.force.knots import knots
from stickslip.inference.force.starting_values import begin

from .conftest import made

SIZE, RUN, SLIP = 6e-8, 1, 4


@pytest.fixture(scope="module")
def longer(tmp_path_factory):
    """Two runs of nine events with nothing hidden, whose sensor meets no speckle."""
    return campaign(tmp_path_factory.mktemp("longer"), 13)


def campaign(folder, seed):
    return made(folder / "case", seed, runs=(Run("v100", 1e-4, 9), Run("v200", 2e-4, 9)), spring_known=True)


def jumped(case, size: float):
    """The problem and base fit of a case whose second run jumps in the middle of a slip."""
    trace, event = case.traces[RUN], case.found[RUN].events[SLIP - 1]
    middle = 0.5 * (event.t_onset + event.t_arrest)
    moved = replace(trace, displacement=trace.displacement + size * (trace.time > middle))
    traces = [*case.traces[:RUN], moved, *case.traces[RUN + 1 :]]
    found = [segment(t) for t in traces]
    thinned = [knots(t, s, case.times) for t, s in zip(traces, found, strict=True)]
    problem, point = begin(case.rig, traces, found, thinned, case.times)
    return problem, fit_base(problem, point)


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_is_found_with_its_size(longer, sign):
    begun, base = jumped(longer, sign * SIZE)
    problem = base.problem
    assert problem.jumps == (int(problem.first[RUN]) + SLIP,)
    assert base.point.common[-1] == pytest.approx(sign * SIZE, abs=1e-8)
    (text,) = jumps(base)
    assert f"during slip {SLIP};" in text and problem.runs[RUN].name in text
    for other in (begun, problem):
        kept = fit_of(other.with_composition(problem.composition), fit_arrays(base))
        assert kept.problem.jumps == problem.jumps
        np.testing.assert_allclose(kept.residual, base.residual, rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_a_speckle_of_the_generator_is_found(tmp_path):
    """Means of 20 ms before and after the first slip of the second run differ by 53 nm from the true motion."""
    _, base = jumped(campaign(tmp_path, 12), 0.0)
    assert base.problem.jumps == (int(base.problem.first[RUN]) + 1,)
    assert base.point.common[-1] == pytest.approx(5.3e-8, abs=1e-8)


@pytest.mark.slow
def test_where_nothing_jumps_nothing_is_found(longer):
    _, base = jumped(longer, 0.0)
    assert base.problem.jumps == ()
