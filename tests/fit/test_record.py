"""What a fit keeps of its campaign: how every run was driven, and the load on a contact."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.campaign.fields import Unmeasured
from stickslip.fit.inertial import Fit
from stickslip.fit.record import fitted, from_record, record
from stickslip.runstore import json_text

from .synthetic import composition, truth


def measurement(times, positions, start=0.0, limit=9.0, stiffness=np.nan):
    """The parts of a measurement of one run that say how it was driven."""
    cycles = SimpleNamespace(
        used=np.array([[True, True, False]]),
        start=np.array([[start, 4.0, 99.0]]),
        limit=np.array([[5.0, limit, 99.0]]),
        load_times=np.array([times]),
        load_positions=np.array([positions]),
        stiffness=np.array([stiffness]),
        virgin=np.array([True]),
    )
    return SimpleNamespace(cycles=cycles, runs=1, names=("holds",), velocities=np.array([1e-4]))


def optimum():
    z = truth()
    none = np.zeros(0)
    return Fit(z, none, 1.0, 1.0, none, none, np.eye(z.size) * 1e-4, composition().free, none, none, 1, 1)


def test_pieces_of_the_drive_are_kept_from_the_start_of_the_record():
    # hold from 3 s to 4 s; the record begins at 1 s; the last nodes are padding on the last piece
    m = measurement([0.0, 3.0, 4.0, 5.0, 6.0], [0.0, 3e-4, 3e-4, 4e-4, 5e-4], start=1.0)
    run = fitted(composition(), optimum(), m).runs[0]
    assert run.pieces == pytest.approx(np.array([(1e-4, 2.0), (0.0, 1.0), (1e-4, 5.0)]))
    assert run.stiffness is None


def test_a_drive_goes_on_beyond_its_last_node():
    run = fitted(composition(), optimum(), measurement([0.0, 1.0], [0.0, 2e-4], limit=7.5, stiffness=170.0)).runs[0]
    assert run.pieces == ((2e-4, 7.5),)
    assert run.stiffness == 170.0


def test_the_rig_is_kept_where_it_is_known():
    m = measurement([0.0, 1.0], [0.0, 2e-4])
    guess = Unmeasured(guess=0.2, lower=0.1, upper=0.4)
    found = fitted(composition(), optimum(), m, SimpleNamespace(normal_force=0.31, friction_coefficient=guess))
    assert (found.normal_force, found.friction) == (0.31, 0.2)
    section = record(found)
    assert from_record(section).normal_force == 0.31
    assert section["free"][0]["value"] == pytest.approx(0.26)
    assert section["free"][0]["std"] == pytest.approx(0.26 * 0.01)
    bare = fitted(composition(), optimum(), m)
    assert (bare.normal_force, bare.friction) == (None, None)


def test_where_a_value_usually_lies_is_kept_and_older_records_do_not_have_it():
    free = tuple(replace(f, usual=(0.1, 0.4)) for f in composition().free)
    driven = measurement([0.0, 1.0], [0.0, 2e-4])
    found = fitted(replace(composition(), free=free), replace(optimum(), free=free), driven)
    section = json.loads(json_text(record(found)))
    assert {f.usual for f in from_record(section).composition.free} == {(0.1, 0.4)}
    for entry in section["free"]:
        del entry["usual"]
    assert {f.usual for f in from_record(section).composition.free} == {None}
