"""What an experiment is expected to say for one model against another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.inference.diagnose.expected_information import KNOWN, Changed, information, margins
from stickslip.inference.force import problem as problem_module
from stickslip.inference.force.noise import by_reading, known_of
from stickslip.inference.force.posterior import posterior_density
from stickslip.inference.force.problem import Problem
from stickslip.inference.force.whitening import Whitening

pytestmark = pytest.mark.slow

RUNS = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 4))


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """Of two runs from a virgin contact."""
    folder = tmp_path_factory.mktemp("telling") / "case"
    make_campaign(folder, 11, (), runs=RUNS, spring_known=True)
    return ss.load_campaign(folder / "campaign.toml").fit()


@pytest.fixture(scope="module")
def pair(base):
    """The base and the same with a larger drop of friction."""
    return base.force_fit, base.with_values({"weakening.drop": 1.02 * base.values["weakening.drop"]}).force_fit


def _dense(one, other, run):
    """The same with whole covariances: of noise and events, and of the parameters of both by their derivatives."""
    problem = Problem(one.problem.composition, [run])
    a, k = one.point.z.size, one.point.weights.size
    forces, parts = [], []
    for fit in (one, other):
        point = replace(fit.point, events=np.zeros((problem.events, 4)), phases=np.zeros((0, 1)))
        own = problem.usual[problem.systematics :]  # the level of this run, and its hum
        point = replace(point, common=np.concatenate([fit.point.common[: problem.systematics], np.zeros(own.size)]))
        slopes = problem.evaluate(point)
        forces.append(slopes)
        shared = a + k + problem.systematics
        covariance = np.zeros((slopes.shared.shape[1],) * 2)
        covariance[:shared, :shared] = fit.covariance[:shared, :shared]
        covariance[shared:, shared:] = np.diag(own**2)
        parts.append(slopes.shared @ covariance @ slopes.shared.T)
        if fit is one:
            rows = by_reading(problem, point, slopes)
            known = known_of(problem, slopes, rows, np.zeros(problem.of.size, bool))
            white = Whitening(fit.scatter.sizes, known).with_events(problem.blocks(slopes.local))
    difference = forces[1].residual - forces[0].residual
    eye = white(problem.blocks(np.eye(difference.size))).reshape(-1, difference.size)
    inverse = eye.T @ eye  # of what is random; times the whole covariance it is better conditioned
    told = np.linalg.solve(np.eye(difference.size) + sum(parts) @ inverse, difference)
    return 0.5 * difference @ inverse @ told / DISPERSION


def test_the_margin_is_that_of_the_whole_covariance(pair):
    run = pair[0].problem.runs[1]
    found = margins(pair, [run, run])
    assert found[0, 1] == pytest.approx(_dense(*pair, run), rel=1e-6)
    assert found[1, 0] == pytest.approx(_dense(*pair[::-1], run), rel=1e-6)
    assert found[0, 0] == found[1, 1] == 0.0
    assert margins((pair[0], pair[0]), [run, run]).max() == 0.0


def test_what_the_campaign_leaves_unknown_of_the_parameters_tells_nothing(pair):
    """A change along the covariance of the parameters is less than the same change where they are known."""
    run = pair[0].problem.runs[1]

    def told(deviation):
        known = [replace(fit, valleys=tuple(deviation * v for v in fit.valleys)) for fit in pair]
        for fit in known:
            fit.__dict__["_judged"] = (*fit._judged[:2], deviation**2 * fit._judged[2])
        return margins(known, [run, run])[0, 1]

    sure, as_found, vague = told(1e-6), told(1.0), told(2.0)
    assert as_found == pytest.approx(margins(pair, [run, run])[0, 1], rel=1e-9)
    assert vague < as_found < sure
    assert sure > 2.0 * vague


def test_draws_of_the_gaussian_say_what_the_gaussian_says(base):
    other = base.with_values({"weakening.drop": 1.02 * base.values["weakening.drop"]}).refit(locked="weakening.drop")
    pair = base.force_fit, other.force_fit
    run, rng = pair[0].problem.runs[1], np.random.default_rng(0)

    def told(draws, spread):
        ways = [posterior_density(fit) for fit in pair]
        drawn = [[way.at(spread * x)[0] for x in rng.standard_normal((draws, way.size))] for way in ways]
        return margins(pair, [run, run], drawn=drawn)[0, 1]

    assert told(100, 1.0) == pytest.approx(margins(pair, [run, run])[0, 1], rel=0.3)
    # draws that agree leave unknown what is not drawn, given what is; they stand where that is at its best
    best = [posterior_density(fit).best(fit.point.z) for fit in pair]
    known = [replace(fit, point=at, valleys=()) for fit, at in zip(pair, best, strict=True)]
    for fit, one in zip(pair, known, strict=True):
        a, left = fit.point.z.size, fit.covariance.copy()
        left -= left[:, :a] @ np.linalg.solve(left[:a, :a], left[:a])
        left[:a], left[:, :a] = 0.0, 0.0
        one.__dict__["_judged"] = (*fit._judged[:2], left)
    assert told(3, 1e-7) == pytest.approx(margins(known, [run, run])[0, 1], rel=1e-3)


def test_a_load_that_is_put_in_is_known_to_one_per_cent(pair, monkeypatch):
    """The pair differs in strength while it slides: that tells less where the load is another, known less well."""
    run = pair[0].problem.runs[1]
    put = margins(pair, [run, run], Changed(load=1.0 + 1e-9))[0, 1]
    assert 0.0 < put < margins(pair, [run, run])[0, 1]
    with monkeypatch.context() as patch:  # at least as much as where the strength itself is known to a per cent
        patch.setattr(problem_module, "LEVEL", KNOWN)
        assert put < 1.001 * margins(pair, [run, run])[0, 1]
    assert margins(pair, [run, run], Changed(mass=1.0 + 1e-9))[0, 1] < margins(pair, [run, run])[0, 1]
    own = replace(run, stiffness=pair[0].values["rig.spring_stiffness"])
    assert margins(pair, [own, own], Changed(spring=1.1))[0, 1] < margins(pair, [own, own])[0, 1]


def test_information_of_an_experiment():
    """Nothing where models predict the same, all where they differ much, a bit for two by a coin's toss."""
    assert information(np.zeros((3, 3))) == pytest.approx(0.0, abs=1e-12)
    assert information(1e3 * (1.0 - np.eye(3))) == pytest.approx(np.log(3.0))
    apart = np.array([[0.0, 1e3, 0.0], [1e3, 0.0, 1e3], [0.0, 1e3, 0.0]])  # the first and the last are equal
    assert information(apart) == pytest.approx(np.log(3.0) - 2.0 / 3.0 * np.log(2.0))
