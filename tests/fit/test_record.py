"""What a fit keeps of its campaign: how every run was driven, and the load on a contact."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.trace import Trace
from stickslip.inference.diagnose.model_record import _driven
from stickslip.inference.fit.serialised import Fitted, from_record, record
from stickslip.system.runstore import json_text

from .synthetic import composition, truth


def driven(times, positions, begin, end, stiffness=None):
    """How a run is kept that was recorded from ``begin`` to ``end``."""
    t = np.linspace(begin, end, 50)
    drive = Drive(np.array(times), np.array(positions))
    return _driven(Trace("holds", t, displacement=0.0 * t, drive=drive, spring_stiffness=stiffness, virgin=True))


def test_pieces_of_the_drive_are_kept_from_the_start_of_the_record():
    # hold from 3 s to 4 s; the record begins at 1 s; the last nodes are padding on the last piece
    run = driven([0.0, 3.0, 4.0, 5.0, 6.0], [0.0, 3e-4, 3e-4, 4e-4, 5e-4], 1.0, 9.0)
    assert run.pieces == pytest.approx(np.array([(1e-4, 2.0), (0.0, 1.0), (1e-4, 5.0)]))
    assert run.stiffness is None


def test_a_drive_goes_on_beyond_its_last_node():
    run = driven([0.0, 1.0], [0.0, 2e-4], 0.0, 7.5, stiffness=170.0)
    assert run.pieces == ((2e-4, 7.5),)
    assert run.stiffness == 170.0


def kept(**more):
    z = truth()
    return Fitted(composition(), z, np.eye(z.size) * 1e-4, **more)


def test_the_rig_is_kept_where_it_is_known():
    section = record(kept(normal_force=0.31, friction=0.2))
    assert (from_record(section).normal_force, from_record(section).friction) == (0.31, 0.2)
    assert section["free"][0]["value"] == pytest.approx(0.26)
    assert section["free"][0]["std"] == pytest.approx(0.26 * 0.01)
    assert from_record(record(kept())).normal_force is None


def test_where_a_value_usually_lies_is_kept_and_older_records_do_not_have_it():
    free = tuple(replace(f, usual=(0.1, 0.4)) for f in composition().free)
    found = replace(kept(), composition=replace(composition(), free=free))
    section = json.loads(json_text(record(found)))
    assert {f.usual for f in from_record(section).composition.free} == {(0.1, 0.4)}
    for entry in section["free"]:
        del entry["usual"]
    assert {f.usual for f in from_record(section).composition.free} == {None}


def test_a_kept_model_is_the_same_to_the_last_digit():
    """A logarithm and back is not always: what is simulated from a run folder must be what was simulated before it."""
    strength = next(f for f in composition().free if f.name == "contact.strength")
    tried = np.random.default_rng(5).uniform(-1.5, -1.2, 100_000)
    odd = [z for z in tried if strength.outward(strength.inward(strength.outward(z))) != strength.outward(z)]
    assert odd
    at = composition().free.index(strength)
    for value in odd[:10]:
        z = truth()
        z[at] = value
        made = replace(kept(), z=z)
        again = from_record(json.loads(json_text(record(made))))
        assert np.array_equal(again.z, z) and again.values == made.values
