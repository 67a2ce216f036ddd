"""A cycle that the fit's integration cannot finish is told, never taken for the model's answer."""

from __future__ import annotations

import inspect
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.cli import fit as cli_fit
from stickslip.contact import power_law_bank
from stickslip.errors import InputError
from stickslip.features.measurement import measure
from stickslip.forward import MOST_STEPS, Cycles, Track, cut_short, longest, run_cycle
from stickslip.model import Block, LoadPoint, Model, Weakening
from stickslip.segment.records import Segmentation
from stickslip.solve import Tolerance
from stickslip.trace import Drive, Trace


def rig() -> Model:
    points = LoadPoint(jnp.array([0.0, 1e3]), jnp.array([0.0, 0.1]))
    return Model(
        Block(0.0894, 1000.0, 10.0), power_law_bank(0.26, 1e-6, 3.2, n=32), Weakening(0.85, 1e-6, 0.02), points
    )


def cycles(limit: float) -> Cycles:
    one = np.ones(1, bool)
    zero = np.zeros(1)
    return Cycles(zero, zero, np.full(1, limit), zero + 1e-6, one, one, zero, zero, zero, one)


@pytest.fixture(scope="module")
def track():
    """One cycle with so many steps as are asked for."""

    def run(most: int, limit: float) -> Track:
        model = rig()
        found, _, _ = run_cycle(model, model.rest(), jnp.asarray(0.0), jnp.asarray(limit), jnp.asarray(1e-5),
                                Tolerance(5e-3, 2e-11, 2e-7), most)  # fmt: skip
        return jax.tree.map(lambda a: np.asarray(a)[None], found)

    return run


def test_a_cycle_that_ends_with_its_slip_is_whole(track):
    found = track(3072, 6.0)
    assert found.arrested[0]
    assert not cut_short(found, cycles(6.0)).any()


def test_a_cycle_that_is_given_up_at_its_limit_is_whole(track):
    found = track(3072, 1.0)
    assert not found.arrested[0]
    assert found.t[0, -1] == 1.0
    assert not cut_short(found, cycles(1.0)).any()


def test_a_cycle_with_too_few_steps_is_cut(track):
    found = track(200, 6.0)
    assert not found.arrested[0]
    assert cut_short(found, cycles(6.0)).all()
    # padding is no cycle
    unused = cycles(6.0)._replace(used=np.zeros(1, bool))
    assert not cut_short(found, unused).any()


def recorded(*sticks: float) -> tuple[Trace, Segmentation]:
    """A slip at the end of every stick (s), during most of which the drive holds."""
    from stickslip.segment import segment

    ends = np.cumsum(sticks)
    t = np.arange(0.0, ends[-1] + 0.5, 1e-3)
    x = sum(50e-6 * 0.5 * (1 - np.cos(np.pi * np.clip((t - e + 0.03) / 0.03, 0, 1))) for e in ends)
    until, speeds = [], []
    for end, stick in zip(ends, sticks, strict=True):
        until += [end - stick + 1e-3, end - 0.9] if stick > 2.0 else []
        speeds += [50e-6, 1e-12] if stick > 2.0 else []
        until.append(end)
        speeds.append(50e-6)
    drive = Drive.from_pieces([*until, ends[-1] + 1.0], [*speeds, 50e-6])
    trace = Trace("run", t, displacement=x + 1e-6 * t / t[-1], drive=drive, noise=1e-9, virgin=True, minimum_slip=2e-5)
    return trace, segment(trace)


def test_a_run_is_used_up_to_a_cycle_that_is_too_long_and_says_so():
    short, long = recorded(1.0, 1.0, 5.0), recorded(1.0, 1.0, longest(MOST_STEPS) + 5.0)
    assert len(short[1].events) == len(long[1].events) == 3
    whole = measure([short[0]], [short[1]], ring_period=2e-3)
    assert np.asarray(whole.cycles.used).sum() == 3
    assert whole.dropped == ()
    part = measure([long[0]], [long[1]], ring_period=2e-3)
    assert np.asarray(part.cycles.used).sum() == 2
    (said,) = part.dropped
    assert said.startswith("run: slips from number 3 on (1 of 3) are left out")
    # with more steps it is used
    more = measure([long[0]], [long[1]], ring_period=2e-3, most_steps=2 * MOST_STEPS)
    assert np.asarray(more.cycles.used).sum() == 3
    assert more.dropped == ()


def test_a_composition_decides_how_many_steps_a_cycle_has():
    from stickslip.fit.overlay import modelled_runs
    from stickslip.fit.problem import Problem
    from tests.fit import synthetic

    m = synthetic.measured(synthetic.traces((2e-4,), slips=2.6))
    events = np.zeros((1, np.asarray(m.cycles.used).shape[1], 2))

    whole, cut = (Problem(replace(synthetic.composition(), most_steps=most), m) for most in (MOST_STEPS, 512))
    right, wrong = (problem.features(synthetic.truth(), events) for problem in (whole, cut))
    assert not np.allclose(right, wrong, equal_nan=True)
    (run,) = modelled_runs(cut, synthetic.truth(), events)
    assert run.cut
    assert max(t.size for t in run.times) <= 512
    default = inspect.signature(cli_fit.fit).parameters["most_steps"].default  # a literal: help does without jax
    assert default == MOST_STEPS


def test_a_campaign_of_such_cycles_only_is_refused():
    trace, found = recorded(longest(MOST_STEPS) + 5.0, 1.0)
    assert len(found.events) == 2
    with pytest.raises(InputError, match=r"begins with a cycle of more than 30\.7 s"):
        measure([trace], [found], ring_period=2e-3)


def test_a_report_names_cut_cycles(monkeypatch):
    """The sentence of the misfit carries it into report.html, result.json and the command line."""
    from stickslip.fit.inertial import fit
    from stickslip.fit.problem import Problem
    from stickslip.floors import floors
    from stickslip.report import inertial_result
    from stickslip.segment import segment
    from tests.fit import synthetic

    traces = synthetic.traces((2e-4,), slips=2.6)
    m = synthetic.measured(traces)
    problem = Problem(synthetic.composition(), m)
    floor = floors(m)
    found = fit(problem, floor, z=synthetic.truth(), stages=((30.0, 1),))
    use = np.asarray(m.cycles.used)
    real = inertial_result.modelled_runs
    monkeypatch.setattr(inertial_result, "modelled_runs", lambda *a: [replace(r, cut=(1,)) for r in real(*a)])
    rig = type("Rig", (), dict.fromkeys(("friction_coefficient", "normal_force", "spring_stiffness"), None))()
    monkeypatch.setattr(inertial_result, "effective", lambda *a: None)
    result, _ = inertial_result.fit_sections(problem, found, traces, [segment(t) for t in traces], floor, use, rig)
    assert result["misfit"]["cut"] == ["v200, cycle 2"]
    assert "In 1 cycle the model could not be integrated to the arrest (v200, cycle 2" in result["misfit"]["sentence"]
