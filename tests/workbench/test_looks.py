"""Colours as those see them who see fewer: computed from the palette of both themes."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from stickslip.workbench.error_map import colour
from stickslip.workbench.figures import DARK, DASHES, LIGHT

# Machado, Oliveira and Fernandes (2009), IEEE Trans. Vis. Comput. Graph. 15, 1291: on linear sRGB, severity 1
SEEN = {
    "all colours": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}  # fmt: skip
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
LEAST = 15.0  # CIE 1976 difference of two curves; one that is just seen is 2.3


def lab(colour: str, seen: np.ndarray) -> np.ndarray:
    """CIELAB coordinates of a colour for an eye."""
    parts = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    share = XYZ @ np.clip(np.asarray(seen) @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    f = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def apart(one: str, other: str, seen: np.ndarray) -> float:
    return float(np.linalg.norm(lab(one, seen) - lab(other, seen)))


def test_the_colours_are_measured_as_they_should_be():
    """Against published coordinates; red and green are close to those who see no red."""
    np.testing.assert_allclose(lab("#ff0000", np.eye(3)), [53.24, 80.09, 67.20], atol=0.05)
    np.testing.assert_allclose(lab("#ffffff", np.eye(3)), [100.0, 0.0, 0.0], atol=0.05)
    assert apart("#d55e00", "#9a7400", SEEN["protanopia"]) < 2.3 < 30.0 < apart("#d55e00", "#9a7400", np.eye(3))


@pytest.mark.parametrize("theme", [LIGHT, DARK])
@pytest.mark.parametrize("eye", SEEN)
def test_the_colour_blind_can_distinguish_curves(theme, eye):
    pairs = [*combinations(theme.runs, 2), *((theme.measured, c) for c in (*theme.runs, theme.model, theme.accent))]
    assert min(apart(a, b, np.asarray(SEEN[eye])) for a, b in pairs) > LEAST


@pytest.mark.parametrize("theme", [LIGHT, DARK])
@pytest.mark.parametrize("eye", SEEN)
def test_better_as_good_and_worse_differ_in_the_heat_map(theme, eye, monkeypatch):
    monkeypatch.setattr("stickslip.workbench.error_map.look", lambda: theme)
    colours = [colour(value, 4.0) for value in (0.0, 1.0, 4.0)]
    assert min(apart(a, b, np.asarray(SEEN[eye])) for a, b in combinations(colours, 2)) > 2.0 * LEAST


def test_two_runs_of_one_colour_differ_by_their_dash():
    assert np.gcd(len(LIGHT.runs), len(DASHES)) == np.gcd(len(DARK.runs), len(DASHES)) == 1
