"""Pictures of fits and diagnoses: a slider goes through cycles, axes of one's own keep their look."""

from types import SimpleNamespace

import matplotlib
import numpy as np
import pandas as pd
import pytest
import xarray
from matplotlib import pyplot, rc_context
from matplotlib.figure import Figure

from stickslip.errors import InputError
from stickslip.objects.diagnosis import Diagnosis
from stickslip.objects.fit_plots import FitPlots, expected_band
from stickslip.show.report.fit_figures import candidates_picture

CYCLES = [("slow", 0), ("slow", 1), ("slow", 2), ("fast", 0), ("fast", 2)]  # of the second one cycle has no points
POINTS = 7


@pytest.fixture
def plots():
    """Of a made-up fit: the force of every cycle is another one."""
    size = len(CYCLES) * POINTS
    time = np.arange(size, dtype=float)
    number = np.repeat(np.arange(len(CYCLES)), POINTS)
    data = {name: ("point", np.zeros(size)) for name in ("residual", "floor", "stiffness")}
    data["left_out"] = ("point", np.zeros(size, bool))
    coords = {
        "run": ("point", np.repeat([run for run, _ in CYCLES], POINTS)),
        "event": ("point", np.repeat([event for _, event in CYCLES], POINTS)),
        "time": ("point", time),
    }
    force = xarray.Dataset(data | {"measured": ("point", 1.0 + number), "model": ("point", 1.2 + number)}, coords)
    runs = [SimpleNamespace(name=name) for name in ("slow", "fast")]
    fit = SimpleNamespace(force=force, parts=("static",), climbed=SimpleNamespace(prepared=SimpleNamespace(runs=runs)))
    yield FitPlots(fit)
    pyplot.close("all")


def drawn(figure):
    """Title and measured force of the cycle that is shown."""
    top = figure.axes[0]
    assert len(top.get_lines()) == 2 and len(figure.axes[1].get_lines()) == 1  # nothing of another cycle stays
    return top.get_title(loc="left"), top.get_lines()[0].get_ydata()[0]


def test_a_slider_goes_through_the_cycles_of_all_runs(plots):
    made = plots.browse()
    for number, (run, event) in enumerate(CYCLES):
        made.slider.set_val(number + 1)
        assert drawn(made) == (f"{run}, cycle {event + 1}", 1.0 + number)
        assert made.slider.valtext.get_text() == f"{number + 1} of 5"


def test_or_of_one_run(plots):
    made = plots.browse("fast")
    assert drawn(made)[0] == "fast, cycle 1"
    made.slider.set_val(2)
    assert drawn(made) == ("fast, cycle 3", 5.0)
    with pytest.raises(InputError, match="did you mean 'fast'"):
        plots.browse("fest")


def test_a_dragged_slider_redraws(plots):
    """As a mouse does it, and with the figure alone kept by its owner."""
    made = plots.browse()
    made.canvas.draw()
    box = made.axes[2].get_window_extent()
    for name in ("button_press_event", "button_release_event"):
        event = matplotlib.backend_bases.MouseEvent(name, made.canvas, box.x0 + 0.68 * box.width, box.y0 + 2.0, 1)
        made.canvas.callbacks.process(name, event)
    assert drawn(made)[0] == "fast, cycle 1"


def test_other_settings_stay_while_a_slider_moves(plots):
    before = dict(matplotlib.rcParams)
    plots.browse().slider.set_val(3)
    assert dict(matplotlib.rcParams) == before


def test_axes_of_ones_own_keep_their_look(plots):
    with rc_context({"axes.titlesize": 6.0, "axes.titleweight": "normal", "legend.fontsize": 5.0}):
        axes = Figure().subplots(2, 1)
        plots.force("slow", 1, ax=axes)
    assert axes[0].title.get_fontsize() == 6.0 and axes[0].title.get_fontweight() == "normal"
    assert {text.get_fontsize() for text in axes[0].get_legend().get_texts()} == {5.0}
    assert plots.force("slow", 1).axes[0].get_legend().get_texts()[0].get_fontsize() == 9.0


def test_of_a_diagnosis_ladder_and_candidates_are_drawn():
    step = {"train_error": 9.0, "heldout_error": 8.0, "by_phase": {"slip": 9.0}, "heldout_by_phase": {}}
    row = {
        "effect": "wear",
        "gain": 90.0,
        "heldout_cost": 70.0,
        "heldout_cost_std": 20.0,
        "amplitude": None,
        "note": "",
    }
    other = {**row, "effect": "tilt", "gain": 3.0, "heldout_cost": -4.0, "heldout_cost_std": 5.0}
    result = {"ladder": [step, step], "ranking": [row, other], "visible": {}}
    found = Diagnosis(SimpleNamespace(title="rig"), None, result, {})
    own = Figure()
    first, *two = own.subplots(1, 3)
    assert found.plot.ladder(ax=two) is own and found.plot.candidates(ax=first) is own
    assert [text.get_text() for text in first.get_yticklabels()] == ["wear", "tilt"]
    assert first.get_ylim()[0] > first.get_ylim()[1]  # the best on top
    bars = first.containers[0].lines[2][0].get_segments()
    np.testing.assert_allclose([bar[:, 0] for bar in bars], [[50.0, 90.0], [-9.0, 1.0]])
    assert len(found.plot.candidates(most=1).axes[0].get_yticklabels()) == 1
    assert len(found.plot.ladder().axes) == 2
    with pytest.raises(InputError, match="no cycle of this diagnosis"):
        found.plot.free()


def test_without_a_refitted_effect_the_picture_says_so():
    table = pd.DataFrame({"gain": [np.nan], "unseen gain": [np.nan], "+-": [np.nan]}, index=["wear"])
    for rows in (table, pd.DataFrame()):
        (text,) = candidates_picture(rows).axes[0].texts
        assert "no effect" in text.get_text()


def test_a_point_that_is_left_out_does_not_widen_the_band():
    t, out = np.arange(5.0), np.arange(5) == 2
    cycle = xarray.Dataset(
        {"time": ("point", t), "floor": ("point", np.where(out, 0.3, 1e-3 * (1.0 + t))), "left_out": ("point", out)}
    )
    np.testing.assert_allclose(expected_band(cycle), 2e-3 * (1.0 + t))
