"""Friction that wanders: the process it is a draw of, and that a record simulated with it says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import stickslip as ss
from stickslip.data.segment import segment
from stickslip.effects import Motion, make
from stickslip.errors import InputError
from stickslip.inference.force.candidates import every_form
from stickslip.inference.forecast.levels import level_arrays
from stickslip.inference.forecast.wander import Component, covariance, fit
from stickslip.simulation.scenario import load_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SIZE, LENGTH, TIME = 0.1, 300e-6, 7.0  # 1, m, s


def test_a_course_has_the_covariance_of_the_process():
    s = np.linspace(0.0, 2000.0, 80001)
    for draw in (0.0, 1.0, 7.5):
        w = np.asarray(make("wandering-friction", size=0.1, draw=draw).course(s))
        assert abs(w.mean()) < 0.05
        for lag in (0.25, 0.5, 1.0, 2.0):
            k = round(lag / (s[1] - s[0]))
            assert np.mean(w[k:] * w[:-k]) == pytest.approx(covariance("matern-3/2", lag, 1.0), abs=0.05)


@pytest.mark.parametrize("lag", [0.02, 0.04, 0.1, 0.24, 1.0])
def test_a_course_is_as_rough_over_short_ways_as_the_process(lag):
    """Mean squares of first and second differences, from the covariance; the slope of the process jumps everywhere."""
    s = np.arange(0.0, 1000.0, 0.02)
    w = np.asarray(make("wandering-friction", size=0.1, draw=2.0).course(s))
    k = round(lag / 0.02)
    at = [float(covariance("matern-3/2", n * lag, 1.0)) for n in range(3)]
    assert np.mean((w[k:] - w[:-k]) ** 2) == pytest.approx(2.0 * (at[0] - at[1]), rel=0.1)
    second = w[2 * k :] - 2.0 * w[k:-k] + w[: -2 * k]
    assert np.mean(second**2) == pytest.approx(6.0 * at[0] - 8.0 * at[1] + 2.0 * at[2], rel=0.1)


def test_draws_are_independent_and_normal():
    s = np.arange(0.0, 400.0, 8.0)  # hardly correlated
    w = np.stack([np.asarray(make("wandering-friction", size=0.1, draw=n / 2).course(s)) for n in range(60)])
    apart = np.corrcoef(w)[np.triu_indices(60, 1)]
    assert apart.std() == pytest.approx(s.size**-0.5, rel=0.2)  # as of independent ones
    assert abs(apart.mean()) < 0.02
    assert np.mean(w**4) / np.mean(w**2) ** 2 == pytest.approx(3.0, abs=0.2)


@pytest.mark.slow
def test_its_course_is_no_law_to_fit():
    assert every_form(["wandering-friction"]) == []
    with pytest.raises(InputError, match="random process"):
        ss.load_campaign(SCENARIOS / "hidden-effect" / "campaign.toml").fit(["wandering-friction"])


def test_every_form_goes_with_its_own():
    """There, a rest, and back over the same places: what place, way and time have become, and what the level is."""
    step = 20e-6
    steps = np.concatenate([np.full(30, step), np.zeros(20), np.full(30, -step)])
    x, t = np.cumsum(steps), 0.5 * np.arange(1, steps.size + 1)
    where = {"place": x / LENGTH, "slip": np.cumsum(np.abs(steps)) / LENGTH, "time": t / TIME}
    zero = jnp.zeros(())
    found = {}
    for along, s in where.items():
        effect = make("wandering-friction", size=SIZE, length=LENGTH, time=TIME, draw=2, along=along)
        assert effect.along == along
        state, levels = effect.start(None), []
        for dx, at, when in zip(steps, x, t, strict=True):
            motion = Motion(jnp.asarray(when), jnp.asarray(0.5), jnp.asarray(at), zero, zero, jnp.asarray(dx), zero)
            state = effect.advance(state, motion, None)
            levels.append(float(effect.strength(state, motion, None)))
        np.testing.assert_allclose(levels, np.exp(SIZE * np.asarray(effect.course(s))), rtol=1e-9)
        found[along] = np.array(levels)
    there, back = slice(0, 29), slice(50, 79)
    np.testing.assert_allclose(found["place"][there], found["place"][back][::-1], rtol=1e-9)
    assert np.abs(found["slip"][there] - found["slip"][back][::-1]).max() > 0.05
    for form in ("place", "slip"):  # nothing changes at rest
        assert np.ptp(found[form][30:50]) == 0.0
    assert np.ptp(found["time"][30:50]) > 0.01


def test_static_and_sliding_friction_wander_together_or_apart():
    """Caps of a model, rested and slid: mu_s or mu_k alone is multiplied, and both parts together make the whole."""
    where, level = 20e-6, float(jnp.exp(SIZE * make("wandering-friction", size=SIZE).course(20e-6 / LENGTH)))
    drive = ss.LoadPoint([0.0, 1.0], [0.0, 0.0])
    base = ss.Model(ss.Block(), ss.power_law_bank(0.26, 1e-6, 2.0), ss.Weakening(ratio=0.8), drive)
    full = float(base.bank.total_strength)

    def cap(psi: float, of: str | None) -> float:
        own = () if of is None else (make("wandering-friction", size=SIZE, length=LENGTH, of=of),)
        model = replace(base, effects=own)
        state = replace(model.rest(x=where), psi=jnp.asarray(psi))
        now, still = jnp.zeros(()), jnp.asarray(1e-12)
        motion = Motion(now, still, jnp.asarray(where), now, now, now, now)
        after, _ = model.advance(state, model.shaped(), model.contact(state, model.shaped(), now), motion)
        return float(after.cap.sum()) / full

    assert abs(level - 1.0) > 0.02
    for of, rested, slid in (("both", level, 0.8 * level), ("static", level, 0.8), ("sliding", 1.0, 0.8 * level)):
        assert cap(1.0, of) == pytest.approx(rested, rel=1e-9)
        assert cap(0.0, of) == pytest.approx(slid, rel=1e-9)
        assert cap(0.3, of) == pytest.approx(0.7 * slid + 0.3 * rested, rel=1e-9)
    assert cap(0.3, "static") + cap(0.3, "sliding") - cap(0.3, None) == pytest.approx(cap(0.3, "both"), rel=1e-12)


def simulated(folder: Path, seconds: int, **fields: float | str) -> dict[str, np.ndarray]:
    """Levels of the paper slider's slips at 42 um/s with friction that wanders."""
    text = (SCENARIOS / "paper_slider.toml").read_text(encoding="utf-8")
    before, after = text.index("[[effect]]"), text.index("[sensor]")
    own = {"type": "wandering-friction", "size": SIZE, "length": LENGTH, "time": TIME, "draw": 3, **fields}
    lines = "".join(f"{name} = {json.dumps(value)}\n" for name, value in own.items())
    path = folder / "wander.toml"
    path.write_text(f"{text[:before]}[[effect]]\n{lines}\n{text[after:]}".replace('"40 s"', f'"{seconds} s"'), "utf-8")
    data = ss.simulate(load_scenario(path))
    trace = ss.Trace.from_arrays(
        "wander", time=data.time.values, displacement=data.displacement.values, drive_velocity="42 um/s"
    )
    return level_arrays(segment(trace).events, 168.0, lambda t: 42e-6 * t)


@pytest.mark.slow
def test_levels_at_onset_and_arrest_follow_the_friction_that_wanders(tmp_path):
    """A spring that lets go at F_s and is caught by F_k stops at F_k - q (F_s - F_k), q from its damping."""
    found = {}
    for of in ("both", "static", "sliding"):
        levels = simulated(tmp_path, 120, along="time", of=of)
        w = make("wandering-friction", along="time", size=SIZE, time=TIME, draw=3).course
        sizes = []
        for end in ("onset", "arrest"):
            course = SIZE * np.asarray(w(levels[f"time_{end}"] / TIME))
            sizes.append(np.polyfit(course, levels[end] / levels["onset"].mean(), 1)[0])
        found[of] = np.array(sizes)
    assert found["static"][0] == pytest.approx(1.0, abs=0.05)
    assert found["sliding"][0] == pytest.approx(0.0, abs=0.02)
    overshoot = -found["static"][1]
    assert 0.2 < overshoot < 0.5
    assert found["sliding"][1] == pytest.approx(0.9 * (1.0 + overshoot), rel=0.1)  # mu_k / mu_s = 0.9
    np.testing.assert_allclose(found["both"], found["static"] + found["sliding"], atol=0.08)


@pytest.mark.slow
@pytest.mark.parametrize(("along", "coordinate"), [("place", "place"), ("slip", "slip path"), ("time", "time")])
def test_what_is_simulated_is_found_in_the_levels_of_the_slips(tmp_path, along, coordinate):
    """Size and length of the wander from the forces at onset and arrest, by the forecast's law."""
    levels = simulated(tmp_path, 250, along=along)
    assert levels["onset"].std() > 0.05 * levels["onset"].mean()
    law = fit(levels, (Component("matern-3/2", coordinate),))
    (wander,) = law.components
    std = dict(zip(("size", "ratio", "length"), law.std, strict=False))
    strength = 0.32 * 0.301  # N
    true = TIME if along == "time" else LENGTH
    assert abs(np.log(wander.size[0] / (SIZE * strength))) < 3.0 * std["size"] < 0.6
    assert abs(np.log(wander.length / true)) < 3.0 * std["length"] < 0.9
    assert wander.size[0] > 5.0 * law.scatter[0]  # nothing else makes slips differ
    assert fit(levels, ()).aic - law.aic > 50.0
    # a block that never goes back does not tell place from slip path; time it does
    other = "slip path" if along == "time" else "time"
    assert fit(levels, (Component("matern-3/2", other),)).aic - law.aic > 50.0
