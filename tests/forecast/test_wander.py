"""The law of wandering levels: its likelihood is the dense one, and its sizes are found again."""

import time

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.inference.forecast.coordinate_text import steps, told
from stickslip.inference.forecast.predict import Compared, compare, coordinates, predictor, take
from stickslip.inference.forecast.wander import (
    ARREST,
    ONSET,
    Component,
    Filter,
    Nearby,
    Series,
    Wander,
    covariance,
    fit,
    log_likelihood,
    packed,
)

from .synthetic import series, wander

OU, MATERN = "ornstein-uhlenbeck", "matern-3/2"
LAWS = {
    "ou": Wander((Component(OU, "time", (1.0, 0.6), 8.0),), (0.3, 0.2)),
    "matern": Wander((Component(MATERN, "slip path", (1.0, -0.6), 8e-4),), (0.3, 0.2)),
    "place": Wander((Component(MATERN, "place", (1.0, 0.8), 8e-4),), (0.3, 0.2)),
    "two": Wander(
        (Component(MATERN, "time", (1.0, 1.1), 40.0), Component(OU, "slip path", (0.5, 0.9), 2e-4)), (0.3, 0.2)
    ),
    "none": Wander((), (0.3, 0.2)),
}  # fmt: skip


def dense(law: Wander, data: Series) -> float:
    """Restricted log-likelihood of a Gaussian with this covariance (Harville 1974), without a filter."""
    scatter = np.array(law.scatter)[data.kind]
    whole = np.diag(scatter**2)
    for c in law.components:
        at, size = data.coordinate[c.coordinate], np.array(c.size)[data.kind]
        whole += size[:, None] * covariance(c.kernel, np.abs(at[:, None] - at), c.length) * size
    means = np.eye(2)[data.kind]
    inverse = np.linalg.inv(whole)
    normal = means.T @ inverse @ means
    rest = data.value - means @ np.linalg.solve(normal, means.T @ inverse @ data.value)
    logs = np.linalg.slogdet(whole)[1] + np.linalg.slogdet(normal)[1]
    return -0.5 * (logs + rest @ inverse @ rest + (rest.size - 2) * np.log(2 * np.pi))


@pytest.mark.parametrize("name", LAWS)
def test_the_filters_likelihood_is_the_dense_one(name):
    law = LAWS[name]
    arrays = series(120, law, 1, (10.0, 3.0))
    if name == "place":  # there and back
        for key in ("place_onset", "place_arrest"):
            arrays[key][60:] = arrays[key][60:][::-1] - 0.37e-4
    data = Series.of(arrays, law.coordinates)
    assert log_likelihood(law, data) == pytest.approx(dense(law, data), abs=1e-9 * 240)


@pytest.mark.parametrize("name", ["ou", "matern", "two"])
def test_the_next_level_is_predicted_as_by_the_dense_formula(name):
    law = LAWS[name]
    arrays = series(60, law, 2, (10.0, 3.0))
    own = Filter(law)
    for slip in range(50):
        take(own, arrays, slip)
    there = coordinates(arrays, 55, "onset")
    mean, std = own.predict(there, ONSET)
    data = Series.of(arrays, law.coordinates, 50)
    scatter = np.array(law.scatter)
    whole, to, var = np.diag(scatter[data.kind] ** 2), np.zeros(100), scatter[ONSET] ** 2
    for c in law.components:
        at, size = data.coordinate[c.coordinate], np.array(c.size)[data.kind]
        whole += size[:, None] * covariance(c.kernel, np.abs(at[:, None] - at), c.length) * size
        to += c.size[ONSET] * size * covariance(c.kernel, np.abs(there[c.coordinate] - at), c.length)
        var += c.size[ONSET] ** 2
    # unknown means as a wander of their own that is as wide as one likes
    means, wide = np.eye(2)[data.kind], 1e5
    whole, to = whole + wide * means @ means.T, to + wide * means[:, ONSET]
    weights = np.linalg.solve(whole, to)
    assert float(mean) == pytest.approx(weights @ data.value, abs=1e-3)
    assert float(std) ** 2 == pytest.approx(var + wide - weights @ to, abs=1e-3)
    many, _ = own.predict({c: np.array([v, v]) for c, v in there.items()}, ONSET)
    np.testing.assert_allclose(many, float(mean))


def test_places_that_are_passed_again_are_predicted_from_what_is_near():
    law = LAWS["place"]
    arrays = series(80, law, 3, (10.0, 3.0))
    one, other = Nearby(law, 10**6), Filter(law)
    for slip in range(80):
        take(one, arrays, slip)
        take(other, arrays, slip)
    there = {"place": arrays["place_arrest"][-1] + 3e-4}
    for kind in (ONSET, ARREST):
        np.testing.assert_allclose(one.predict(there, kind), other.predict(there, kind), rtol=1e-8)
    inside = {"place": np.array([arrays["place_onset"][20] + 1e-5])}
    few = Nearby(law, 60)
    for slip in range(80):
        take(few, arrays, slip)
    np.testing.assert_allclose(few.predict(inside, ONSET), one.predict(inside, ONSET), rtol=0.02)


@pytest.mark.parametrize("name", ["ou", "matern", "two"])
def test_sizes_and_lengths_are_found_again(name):
    law = LAWS[name]
    pulls = []
    for seed in range(4):
        components = tuple(Component(c.kernel, c.coordinate) for c in law.components)
        found = fit(series(500, law, 10 + seed, (10.0, 3.0)), components)
        pulls.append((packed(found) - packed(law)) / np.array(found.std))
    pulls = np.array(pulls)
    assert np.isfinite(pulls).all()
    assert np.mean(np.abs(pulls) < 2.0) > 0.8 and np.abs(pulls).max() < 5.0


def test_coverage_of_the_next_level():
    """Of laws fitted to a third of a long series, the later levels lie in their intervals as often as they should."""
    law = LAWS["ou"]
    arrays = series(1500, law, 5, (10.0, 3.0))
    found = fit(arrays, (Component(OU, "time"),), 500)
    own, z = predictor(found), []
    for slip in range(1500):
        if slip >= 500:
            mean, std = own.predict(coordinates(arrays, slip, "onset"), ONSET)
            z.append(float((arrays["onset"][slip] - mean) / std))
        take(own, arrays, slip)
    assert np.mean(np.abs(z) < 0.6745) == pytest.approx(0.5, abs=0.04)
    assert np.mean(np.abs(z) < 1.6449) == pytest.approx(0.9, abs=0.03)


def test_ten_thousand_slips_cost_seconds():
    arrays = series(10_000, LAWS["ou"], 6, (10.0, 3.0))
    began = time.process_time()
    fit(arrays, (Component(OU, "time"),))
    assert time.process_time() - began < 20.0


@pytest.mark.slow
@pytest.mark.parametrize("coordinate", ["time", "slip path"])
def test_the_coordinate_is_named(coordinate):
    """Time and slip path part where the recurrence changes at the same slip: here it is 1 s and 2 s in turn."""
    law = Wander((Component(MATERN, coordinate, (1.0, 1.0), {"time": 4.0, "slip path": 3e-4}[coordinate]),), (0.1, 0.1))
    arrays = series(400, law, 7, (10.0, 3.0))
    found = told(compare(arrays, 200), False, steps(arrays))
    assert found["coordinate"] == coordinate and f"wander along {coordinate}" in found["text"]
    assert "motion back over the same track separates them" in found["text"]


@pytest.mark.slow
def test_a_way_back_decides_between_place_and_slip_path():
    law = LAWS["place"]
    arrays = series(240, law, 8, (10.0, 3.0))
    fold = np.concatenate([np.arange(60), np.arange(60)[::-1]] * 2)  # four passes over sixty places
    level = {k: arrays[k].copy() for k in ("onset", "arrest")}
    rng = np.random.default_rng(0)
    for k, name in enumerate(("onset", "arrest")):
        arrays[name] = level[name][fold] + law.scatter[k] * rng.normal(size=240)
    for end in ("onset", "arrest"):
        arrays[f"place_{end}"] = arrays[f"place_{end}"][fold]
    arrays["direction"] = np.repeat([1.0, -1.0, 1.0, -1.0], 60)
    found = told(compare(arrays, 180), True, steps(arrays))
    assert found["coordinate"] == "place" and "separates them" not in found["text"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9, 20])
def test_scatter_alone_names_no_coordinate(seed):
    arrays = series(200, LAWS["none"], seed, (10.0, 3.0))
    found = told(compare(arrays, 150), False, steps(arrays))
    assert found["coordinate"] in ("", "nothing")
    assert "only scatter" in found["text"] or "no correlation detected" in found["text"]


def test_what_ends_within_a_slip_is_no_wander():
    """Levels at the two ends of a slip go together as its size lets them, and no further slip knows of them."""
    arrays, length = series(400, LAWS["none"], 7, (10.0, 3.0)), 2e-5
    size = np.tile([2e-6, 8e-5, 1e-5], 134)[:400]
    arrays["path_arrest"] = arrays["path_onset"] + size
    at = np.stack([arrays["path_onset"], arrays["path_arrest"]], axis=1).ravel()
    w = wander(OU, at, length, np.random.default_rng(3))
    arrays["onset"], arrays["arrest"] = 10.0 + w[0::2], 3.0 + w[1::2]
    found = told(compare(arrays, 300), False, steps(arrays))
    assert found["weights"]["slip path"] > 0.95
    assert found["coordinate"] == "" and "ends before the next slip" in found["text"]


def test_what_cannot_be_fitted_is_refused():
    arrays = series(8, LAWS["ou"], 0)
    with pytest.raises(InputError, match="8 slips are too few"):
        fit(arrays, ())
    arrays = series(50, LAWS["ou"], 0)
    with pytest.raises(InputError, match="the same"):
        fit({**arrays, "onset": np.ones(50)}, ())
    with pytest.raises(InputError, match=r"no order in common|another order"):
        Series.of(arrays, ("place", "time"))
    with pytest.raises(ValueError, match="goes back"):
        own = Filter(LAWS["ou"])
        own.add({"time": 1.0}, ONSET, 1.0)
        own.add({"time": 0.5}, ONSET, 1.0)
    assert Compared(LAWS["ou"]).unseen.size == 0
