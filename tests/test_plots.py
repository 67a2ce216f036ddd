"""Pictures: every axis has its unit, lines differ without colour, nobody else's settings change."""

from __future__ import annotations

import struct
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
import xarray
from matplotlib.colors import to_rgb

from stickslip.data.segment import thin
from stickslip.show.plots import (
    creep_figure,
    effect_figure,
    save,
    series_figure,
    static_against_inertial,
    style,
    trace_figure,
)
from stickslip.show.plots.style import scaled, signed_log


@pytest.fixture(scope="module")
def run() -> xarray.Dataset:
    """A made-up run with two slips; pictures need no physics."""
    t = np.linspace(0.0, 2.0, 4001)
    x = 1e-7 * t + 4e-5 * (np.clip((t - 0.8) / 0.04, 0, 1) + np.clip((t - 1.6) / 0.04, 0, 1))
    data = {
        "displacement": ("time", x),
        "reading": ("time", np.floor(x / 8e-9) * 8e-9),
        "velocity": ("time", np.gradient(x, t)),
        "spring_force": ("time", 0.2 + 0.05 * t),
        "drive_position": ("time", 5e-5 * t),
        "onset": ("event", np.array([0.8, 1.6])),
        "arrest": ("event", np.array([0.84, 1.64])),
        "static_displacement": ("static", np.linspace(0, 1e-7, 50)),
        "static_time": ("static", np.linspace(0, 1, 50)),
    }
    attrs = {"title": "rig", "verdict": "stick-slip", "friction_force": 0.26}
    return xarray.Dataset(data, coords={"time": t}, attrs=attrs)


@pytest.fixture(scope="module")
def table() -> xarray.Dataset:
    values = np.array([1e-5, 1e-4, 1e-3])
    data = {"value": ("run", values, {"units": "m/s"}), "events": ("run", np.array([5, 5, 0]))}
    for name in ("recurrence", "slip", "peak_velocity", "creep_before_slip"):
        data[name] = ("run", np.array([2.0, 0.2, np.nan]))
        data[f"{name}_std"] = ("run", np.array([0.1, 0.01, np.nan]))
    return xarray.Dataset(data, attrs={"key": "drive.velocity", "title": "series"})


def figures(run: xarray.Dataset, table: xarray.Dataset) -> dict:
    u = np.linspace(0, 1e-6, 20)
    empty = run.isel(event=slice(0, 0))
    return {
        "trace": trace_figure(run),
        "trace without events": trace_figure(empty),
        "creep": creep_figure(u / u[-1], u, u * 1e6, "rig"),
        "static": static_against_inertial([run, run], ["10 um/s", "20 um/s"]),
        "series": series_figure(table),
        "effect": effect_figure(run, run, "wear", "rate = 1"),
        "effect without events": effect_figure(empty, empty, "wear", "rate = 1"),
    }


def test_every_axis_says_its_unit(run, table):
    for name, figure in figures(run, table).items():
        for axes in figure.axes:
            if not axes.lines or (axes.get_title(loc="left") == "" and not axes.get_xlabel()):
                continue
            assert axes.get_ylabel(), name
            for label in (axes.get_xlabel(), axes.get_ylabel()):
                assert not label or "/" in label or "share" in label, (name, label)


def test_lines_of_one_panel_differ_in_grey(run, table):
    for name, figure in figures(run, table).items():
        for axes in figure.axes:
            looks = {
                (round(float(np.dot(to_rgb(line.get_color()), (0.3, 0.59, 0.11))), 1), line.get_linestyle())
                for line in axes.lines
                if not str(line.get_label()).startswith("_")
            }
            named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
            assert len(looks) == len(named), name


def test_equal_figures_are_equal_files(run, table, tmp_path):
    first, second = (save(trace_figure(run), tmp_path / f"{i}.png").read_bytes() for i in range(2))
    assert first == second
    assert first.startswith(b"\x89PNG")


def test_a_notebook_shows_a_picture_without_being_set_up_for_it(run):
    made = trace_figure(run)
    assert made._repr_png_().startswith(b"\x89PNG")
    made.set_size_inches(2.0, 1.0)
    assert struct.unpack(">II", made._repr_png_()[16:24]) == (200, 100)


def test_settings_of_others_stay(run, tmp_path):
    before = dict(matplotlib.rcParams)
    save(trace_figure(run), tmp_path / "a.png")
    assert dict(matplotlib.rcParams) == before


def test_units_get_prefixes():
    assert scaled(np.array([0.0, 4.3e-5]), "m") == (pytest.approx(1e6), "µm")
    assert scaled(np.array([0.02]), "N") == (pytest.approx(1e3), "mN")
    assert scaled(np.array([0.0]), "m") == (1.0, "m")
    assert scaled(np.array([0.5]), "1") == (1.0, "1")


def test_thinning_keeps_extremes():
    t = np.arange(100_000.0)
    y = np.zeros_like(t)
    y[54_321], y[777] = 5.0, -3.0
    few_t, few_y = thin(t, y)
    assert few_t.size < 10_000
    assert few_y.max() == 5.0 and few_y.min() == -3.0
    assert few_t[0] == 0 and few_t[-1] == t[-1]
    assert np.all(np.diff(few_t) >= 0)


@pytest.mark.parametrize("low", [-1e-5, -2e-3, -3.0, 0.0])
def test_numbers_of_a_signed_logarithmic_axis_do_not_touch(low):
    values = np.concatenate([[low], np.geomspace(1e-4, 8.0, 50)])
    made, axes = style.figure(1, 1, width=3.1, height=3.0)
    axes[0, 0].plot(values, values)
    signed_log(axes[0, 0], values)
    made.canvas.draw()
    inside = axes[0, 0].get_window_extent()
    boxes = [t.get_window_extent() for t in axes[0, 0].get_xticklabels()]
    boxes = sorted((b for b in boxes if b.x1 > inside.x0 and b.x0 < inside.x1), key=lambda b: b.x0)
    assert len(boxes) >= 3
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))
