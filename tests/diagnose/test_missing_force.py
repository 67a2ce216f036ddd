"""The missing force: a known one is found within its band; one for prediction takes energy out; none is a candidate."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
import xarray
from fit import synthetic

from stickslip.conformance.dynamics import check_null
from stickslip.diagnose.missing_force import curves, learn
from stickslip.effects import BodyForce, catalogue
from stickslip.effects.learned import AGES, PLACES, SPEEDS, LearnedForce
from stickslip.errors import InputError
from stickslip.fit.inertial import fit
from stickslip.fit.problem import Problem
from stickslip.fit.record import fitted, from_record, record
from stickslip.floors import floors
from stickslip.report.html import render
from stickslip.report.missing_force import LABEL, _text, _variables
from stickslip.report.sections import pictures
from stickslip.solve import Tolerance, integrate
from stickslip.trace import Drive, Trace

DEPTH, WAVE = 1.5e-3, 2.4e-4  # N, m


class Detent(BodyForce):
    """A force that varies along the track."""

    def force(self, state, motion, contact):
        return DEPTH * jnp.sin(2 * jnp.pi * motion.x / WAVE)


def _traces() -> list[Trace]:
    out = []
    for v in (1e-4, 2e-4, 3e-4):
        stop = 0.26 / (1000.0 * v) + 7.6 * 52e-6 / v
        nodes = (jnp.array([0.0, 1.0]), jnp.array([0.0, v]))
        made = synthetic.composition().with_effect(Detent(), [])
        model = made.model(jnp.asarray(synthetic.truth()), jnp.zeros(2), nodes, jnp.asarray(np.nan))
        run, _ = integrate(model, stop, tolerance=Tolerance(1e-3, 1e-12, 1e-8), largest_step=0.005)
        t = np.arange(0.0, stop, 1e-4)
        out.append(Trace(name=f"v{v * 1e6:.0f}", time=t, displacement=run.at(t).x, drive=Drive.constant(v, 0.0, stop),
                         virgin=True))  # fmt: skip
    return out


@pytest.fixture(scope="module")
def ground():
    """Base family, its fit, measurement, floors and the cycles that may be fitted (the middle velocity may not)."""
    data = synthetic.measured(_traces())
    base, floor = synthetic.composition(), floors(data)
    train = np.asarray(data.cycles.used).copy()
    train[1] = False
    found = fit(Problem(base, data), floor, z=synthetic.truth(), stages=((1.0, 6),), use=train)
    return base, found, data, floor, train


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def picture(ground, told):
    return learn(*ground, progress=lambda text, share: told.append((text, share)))


@pytest.fixture(scope="module")
def learned(ground, picture):
    return learn(*ground, begin=picture, evaluations=6)


def _force(**weights):
    return catalogue.make("learned-force", size=1e-3, **weights)


def test_it_is_no_candidate():
    assert LearnedForce.tag not in catalogue.tags()
    assert LearnedForce.tag not in catalogue.all()
    assert catalogue.get(LearnedForce.tag) is LearnedForce


def test_without_a_unit_of_force_it_is_not_there():
    assert list(check_null(LearnedForce)) == []


def test_equal_weights_are_a_constant_inside_the_data_and_fade_outside():
    force = _force(**dict.fromkeys(PLACES, 1.0), x_low=1e-4, x_high=8e-4)
    inside = np.asarray(force.along(jnp.linspace(1e-4, 8e-4, 50)) @ force.weights(PLACES))
    np.testing.assert_allclose(inside, 1.0, rtol=1e-12)
    assert float(force.along(jnp.asarray(8e-4 + 4e-4)) @ force.weights(PLACES)) == 0.0


def test_the_part_of_the_velocity_opposes_every_motion():
    rng = np.random.default_rng(3)
    v = jnp.geomspace(1e-9, 1.0, 400)
    for _ in range(20):
        force = _force(**{name: float(w) for name, w in zip(SPEEDS, rng.exponential(size=len(SPEEDS)), strict=True)})
        drag = np.asarray(force.against(v) @ force.weights(SPEEDS))
        assert np.all(drag >= 0.0)
        assert drag[0] < 1e-4 * drag.max()  # and is nothing at rest


def test_a_force_that_feeds_energy_is_refused():
    with pytest.raises(InputError, match="outside its range"):
        _force(v2=-0.5)


def test_friction_never_changes_its_sign():
    force = _force(**dict.fromkeys(AGES, -30.0), first=-30.0)
    strength = type("Contact", (), {"strength": jnp.array([1e-3, 1e-3])})()
    for age in (0.0, 1.0, 1e6):
        assert float(force.strength((jnp.asarray(age), jnp.asarray(0.5)), None, strength)) > 0.0


def test_it_says_after_every_evaluation_how_far_it_is(picture, told):
    shares = [share for _, share in told]
    assert len(shares) > 10
    assert shares[0] < 0.1
    assert shares == sorted(shares)
    assert shares[-1] <= 0.99
    assert all("error" in text for text, _ in told)


def test_a_known_force_is_found_within_its_band(picture):
    found = curves(picture)["displacement"]
    inside = (found.at >= found.seen.min()) & (found.at <= found.seen.max())

    def true(x):
        return DEPTH * np.sin(2 * np.pi * x / WAVE)

    missed = found.force - (true(found.at) - np.mean(true(found.seen)))
    assert np.mean(np.abs(missed[inside]) < 2.0 * found.std[inside]) > 0.9
    # the band says something, and the estimate is nearer than no force at all
    assert np.median(found.std[inside]) < 0.3 * DEPTH
    assert np.sqrt(np.mean(missed[inside] ** 2)) < 0.4 * DEPTH


def test_what_is_not_missing_stays_within_its_band(picture):
    found = curves(picture)
    for name in ("velocity", "time in contact"):
        curve = found[name]
        known = curve.std > 0.0
        assert np.mean(np.abs(curve.force[known]) < 3.0 * curve.std[known]) > 0.9, name


def test_the_learned_force_takes_energy_out_and_predicts(ground, picture, learned):
    from stickslip.diagnose.heldout import held_out

    base, found, data, floor, train = ground
    weights = np.array([float(getattr(learned.effect, name)) for name in SPEEDS])
    assert np.all(weights >= 0.0)
    unseen = np.asarray(data.cycles.used) & ~train
    before = held_out(Problem(base, data), found, floor, unseen, found.features)
    after = held_out(Problem(learned.composition, data), learned.fit, floor, unseen, learned.fit.features)
    assert after.error < 0.5 * before.error


def test_it_is_loaded_as_it_was_written(ground, learned):
    _, _, data, _, _ = ground
    again = from_record(record(fitted(learned.composition, learned.fit, data)))
    assert again.parts[-1] == "learned-force"
    old, new = learned.effect, again.effects()[-1]
    x = jnp.linspace(0.0, 4e-4, 30)
    np.testing.assert_allclose(
        new.along(x) @ new.weights(PLACES), old.along(x) @ old.weights(PLACES), rtol=1e-9, atol=1e-12
    )


def test_the_report_draws_it_and_says_what_it_is_not(picture):
    parts = curves(picture)
    facts = {"at": 1.0, "unit": "s", "force": 1e-3, "std": 1e-4}
    stated = {name: {**facts, "stands_out": name == "displacement"} for name in parts}
    shown = [{"model": ["static", "inertia"], "parts": stated}]
    result = {
        "kind": "diagnose",
        "versions": {},
        "missing_force": {"label": LABEL, "text": _text(shown), "shown": shown},
    }
    drawn = list(pictures(result, xarray.Dataset(_variables(parts, 0))))
    assert [section for section, _, _ in drawn] == ["missing_force"]
    assert [ax.get_title(loc="left").split(",")[0] for ax in drawn[0][2].axes] == [
        "along the track", "with velocity", "with time in contact",
    ]  # fmt: skip
    text = render(result, drawn)
    assert "no proof" in text
    assert "stands out of its uncertainty in: displacement" in text


@pytest.mark.slow
def test_a_force_outside_the_catalogue_is_predicted(tmp_path):
    """A magnetic detent, simulated without the package's model: no effect tried explains it; the learned force does."""
    import stickslip as ss
    from stickslip.challenge.generator import make_campaign
    from stickslip.workflow import diagnose_campaign

    make_campaign(tmp_path / "campaign", 501, [("magnetic-detent", 6e-3)])
    out = tmp_path / "out"
    result = diagnose_campaign(
        tmp_path / "campaign" / "campaign.toml", out, candidates=["sensor-drift"], learn_residual=True, jobs=1
    )
    assert result["verdict"]["effects"] == []
    before, after = result["learned_residual"]["ladder"]
    assert after["heldout_error"] < 0.7 * before["heldout_error"]
    assert "not an explanation" in result["learned_residual"]["text"]
    assert "not an explanation" in (out / "report.html").read_text(encoding="utf-8")
    assert ss.load_run(out, learned=True).parts[-1] == "learned-force"
    assert "learned-force" not in ss.load_run(out).parts
