"""Floors against what fresh rough lines do to the features, in campaigns of an independent simulator."""

from __future__ import annotations

import pytest

from .line_scatter import CONTACTS, scatter

pytestmark = pytest.mark.long  # eight campaigns


def test_fresh_lines_scatter_the_features_as_the_floors_say(tmp_path):
    found, told = scatter(tmp_path, new_lines=True)
    assert min(told) > 0.4, told  # the events tell which of the two it is
    for group in ("recurrence", "size", "times", "overshoot", "ring", "frequency", "settle"):
        assert 0.6 < found[group] < 1.5, (group, found)
    # more than the floor, for two factors of each event are refitted and take most of it
    assert 1.0 < found["creep"] < 3.0, found


def test_lines_average_out_over_the_contacts(tmp_path):
    """The same rigs on one, four and nine contacts that carry the same load: about the same share of a floor."""
    each = {n: scatter(tmp_path / str(n), new_lines=True, contacts=n) for n in CONTACTS}
    assert min(min(told) for _, told in each.values()) > 0.4
    # creep falls faster than the root, by more than six from one contact to nine; most of it is refitted event by event
    for group, most in (("recurrence", 2.0), ("size", 2.0), ("creep", 3.0)):
        shares = [found[group] for found, _ in each.values()]
        assert max(shares) < most * min(shares), (group, shares)


def test_with_the_same_lines_only_the_sensor_scatters(tmp_path):
    found, told = scatter(tmp_path, new_lines=False)
    assert max(told) < 0.2, told
    for group in ("recurrence", "size", "times"):
        assert found[group] < 0.8, (group, found)
    assert found["overshoot"] == pytest.approx(1.0, abs=0.4)  # a count of the sensor
