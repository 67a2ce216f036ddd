"""Candidates on their way between processes: the same models, without a copy of what their base holds."""

from __future__ import annotations

import numpy as np
import pytest
from cloudpickle import dumps

from stickslip.inference.diagnose.fit_pickling import FitPickler
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit
from stickslip.inference.force.signatures import Explained
from tests.force.conftest import made


@pytest.mark.slow
def test_candidates_arrive_as_they_were_upon_the_base_that_is_there(tmp_path):
    case = made(tmp_path / "case", 3)
    here = FitPickler.packed(fit(case.problem, case.point), tmp_path / "base")
    there = FitPickler(tmp_path / "base")
    (sent,) = try_effect(there.base, Explained(there.base), "tilt", [{"by": "spring"}])
    cost = sent.fit.cost
    packed = there.pack([sent])
    assert len(packed) < 0.2 * len(dumps([sent]))
    (got,) = here.unpack(packed)
    assert got.fit.cost == cost
    assert (got.tag, got.form, got.start) == (sent.tag, sent.form, sent.start)
    assert got.fit.known.noise is here.base.known.noise
    assert got.fit.problem.runs[0].mean.data is here.base.problem.runs[0].mean.data
    for name in ("residual", "local", "shared"):
        np.testing.assert_array_equal(getattr(got.fit.forces, name), getattr(sent.fit.forces, name))
    np.testing.assert_array_equal(got.fit.white.logs, sent.fit.white.logs)
    assert got.fit.problem.forces(got.fit.point).residual.tobytes() == sent.fit.residual.tobytes()
