"""A search begun at the amplitude that recurrences tell."""

from __future__ import annotations

import numpy as np

from stickslip.diagnose import search
from stickslip.effects import catalogue
from stickslip.fit.inertial import Fit
from stickslip.fit.problem import Problem
from stickslip.floors import floors

from .synthetic import composition, measured, traces, truth


def test_a_gain_that_bends_the_base_is_found_by_what_recurrences_tell(monkeypatch):
    """A search over records of a sensor 3 % too large, on a base that was fitted to other records."""
    data = measured(traces(slips=9.0, effect=catalogue.make("sensor-gain", gain=0.03)))
    bare = Problem(composition(), data)
    events = np.zeros((*data.valid.shape[:2], 2))
    floor, train = floors(data), np.ones(data.valid.shape[:2], bool)
    features = bare.features(truth(), events)
    columns = bare.columns(truth(), events, range(truth().size), features)
    optimum = Fit(truth(), events, 0.0, 0.0, features, np.zeros_like(features), np.eye(truth().size),
                  composition().free, columns, train, 1, 1)  # fmt: skip
    nearest = []
    for share in (search.TOLD, 2.0):  # which no share exceeds
        monkeypatch.setattr(search, "TOLD", share)
        found = search.score(catalogue.make("sensor-gain"), composition(), optimum, data, floor, train)
        at = [z[-1] * found.fit.free[-1].scale for z in (found.fit.z, *(z for z, _ in found.others))]
        nearest.append((min(abs(a - 0.03) for a in at), found.promise))
    (told, promise), (else_, less) = nearest
    assert told < 0.002
    assert else_ > 0.005
    assert promise > less + 0.1
