"""Levels of strokes: what belongs to the place, to the way from a turn, and what changes from stroke to stroke."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.data.prescribed import with_motion
from stickslip.inference.forecast.strokes import KNEE, Strokes
from stickslip.objects.wander import wander, wander_sentence

LEVEL, STIFFNESS, STROKE = 2.0, 4e4, 3e-4  # N, N/m, m


def loops(strokes: int, friction, seed: int = 0, zero: float = 0.0) -> ss.Trace:
    """Strokes of an elastic and plastic contact, rests between them of any length: friction(place, path, time)."""
    rng = np.random.default_rng(seed)
    step, speed = 0.005, 2e-4
    x, now = [np.zeros(1)], 0.0
    for n in range(strokes):
        ahead = np.arange(1, round(STROKE / speed / step) + 1) * speed * step
        rest = np.full(round(rng.uniform(0.2, 4.0) / step), ahead[-1])
        x.append(now + (1 if n % 2 == 0 else -1) * np.concatenate([ahead, rest]))
        now = x[-1][-1]
    x = np.concatenate(x)
    t = step * np.arange(x.size)
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    force, slid = np.zeros(x.size), 0.0
    for i in range(1, x.size):
        trial = STIFFNESS * (x[i] - slid)
        most = friction(slid, gone[i], t[i])
        force[i] = np.clip(trial, -most, most)
        slid = x[i] - force[i] / STIFFNESS
    force = force + zero + 2e-3 * rng.normal(size=t.size)
    return ss.Trace.from_arrays("loops", time=t, displacement=x, spring_force=force)


def course(length: float, seed: int):
    """A smooth wander of one unit."""
    rng = np.random.default_rng(seed)
    q, turn = rng.standard_t(3, 40) / length, rng.uniform(0, 2 * np.pi, 40)
    return lambda s: np.sqrt(2 / 40) * np.sum(np.cos(q * s + turn))


@pytest.mark.slow
@pytest.mark.parametrize("follows", ["place", "slip path", "time"])
def test_what_strokes_follow(follows):
    w = course({"place": 4e-5, "slip path": 6e-3, "time": 50.0}[follows], 4)
    at = {"place": 0, "slip path": 1, "time": 2}[follows]
    trace = loops(90, lambda *where: LEVEL * np.exp(0.03 * w(where[at])), zero=0.1)
    found = wander(ss.Campaign.from_traces([trace]))
    assert found is not None and found["strokes"] >= 75
    share = found["shares"]["by the place" if follows == "place" else "from stroke to stroke"]
    assert share > 0.9 and sum(found["shares"].values()) == pytest.approx(1.0)
    if follows == "place":
        assert found["coordinate"] == "place" and "the same in every stroke" in found["text"]
    else:
        assert found["coordinate"] == follows and "nats a stroke" in found["text"]
    assert "slid both ways" in wander_sentence(found)


def test_what_comes_with_the_way_from_a_turn_is_no_place():
    def friction(place, path, time):
        way = path % STROKE  # since the motion turned
        return LEVEL * (1.0 + 0.1 * way / STROKE)

    found = Strokes.of(with_motion(loops(40, friction)))
    assert found is not None
    assert found.shares["by the way from the turn"] > 0.9
    assert found.shares["by the place"] < 0.02


def test_places_are_the_contacts_and_behind_the_knee():
    """The contact follows the motion by twice the force over the stiffness at a turn; the force's zero is taken off."""
    found = Strokes.of(with_motion(loops(20, lambda *_: LEVEL, zero=0.3)))
    assert found is not None
    give = LEVEL / STIFFNESS
    slides = STROKE - 2 * give
    low = give + KNEE * slides
    assert found.place[0] == pytest.approx(low, abs=8e-6)
    assert found.place[-1] == pytest.approx(STROKE - low, abs=8e-6)
    assert found.level.mean() == pytest.approx(LEVEL, rel=2e-3)


def test_strokes_that_share_no_place_have_no_level():
    still = loops(4, lambda *_: LEVEL)
    assert Strokes.of(with_motion(still.replace(spring_force=np.abs(still.spring_force)))) is None
    assert wander(ss.Campaign.from_traces([loops(8, lambda *_: LEVEL)])) is None  # too few
    stuck = loops(40, lambda *_: 100.0)  # never slides
    found = wander(ss.Campaign.from_traces([stuck]))
    assert found is None


@pytest.mark.slow
def test_a_motion_read_as_a_velocity_or_as_the_stage_serves_as_well():
    trace = loops(60, lambda place, path, time: LEVEL * (1.0 + 1e-4 * time))
    x = trace.displacement
    told = wander(ss.Campaign.from_traces([trace]))
    stage = ss.Trace.from_arrays("loops", time=trace.time, drive_position=x, spring_force=trace.spring_force)
    speed = np.gradient(x, trace.time)
    read = ss.Trace.from_arrays("loops", time=trace.time, velocity=speed, spring_force=trace.spring_force)
    assert told is not None
    for other in (stage, read):
        found = wander(ss.Campaign.from_traces([other]))
        assert found is not None
        assert found["shares"]["from stroke to stroke"] == pytest.approx(
            told["shares"]["from stroke to stroke"], abs=0.02
        )
