"""Every effect, through the whole chain: a record made with it is described by the model that has it, and by no other.

A record comes from one continuous integration; a fit sets clock and position anew at every arrest. Whatever an effect
does at an arrest (a reading that is late, a memory that goes on) must come out the same both ways.
"""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.effects import catalogue
from stickslip.errors import StickslipError
from stickslip.fit.problem import Problem
from stickslip.floors import floors
from stickslip.params import specs
from stickslip.residual import misfit

from . import synthetic

SHARES = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5)  # of the amplitude's range, the largest that goes
MOST = 60.0  # floors, by which the base alone is off
SILENT = {"flash-heating", "thresholds"}  # do next to nothing at these velocities and in so few slips
FORMS = [(tag, form) for tag in catalogue.tags() for form in catalogue.forms(catalogue.get(tag))]


def _error(family, data) -> float:
    events = np.zeros((*data.values.shape[:2], 2))
    return misfit(data, Problem(family, data).features(synthetic.truth(), events), floors(data)).total


@pytest.mark.slow
@pytest.mark.parametrize(("tag", "form"), FORMS)
def test_a_record_with_an_effect_is_described_with_it(tag, form):
    cls = catalogue.get(tag)
    spec = specs(cls(**form))[cls.amplitude]
    null = spec.null or 0.0
    end = spec.upper if spec.upper > null else spec.lower
    for share in SHARES:
        effect = catalogue.make(tag, **{cls.amplitude: null + share * (end - null)}, **form)
        try:
            data = synthetic.measured(synthetic.traces(effect=effect))
            without = _error(synthetic.composition(), data)
        except StickslipError:  # the block does not stick and slip any more
            continue
        if without < MOST:
            break
    else:
        pytest.fail("no amplitude leaves the block sticking and slipping")
    own = _error(synthetic.composition().with_effect(effect, ()), data)
    # half a floor is what sampling at 10 kHz leaves; a reading that rises slowly tells its top less well
    assert own < 1.5, (share, without, own)
    if not SILENT & {tag, *form.values()}:
        assert without > 2.0 * own or without > own + 1.0, (share, without, own)
