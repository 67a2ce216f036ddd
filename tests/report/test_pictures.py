"""What pictures of measurements and fits show, and what `inspect` says of them first."""

import numpy as np
import pytest
import xarray

from stickslip.cli import run
from stickslip.cli.show import quantity
from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.show.plots.style import scaled
from stickslip.show.report import trace_pieces
from stickslip.show.report.figures import trace_picture
from stickslip.show.report.fit_figures import creep_grid, ladder_picture, ramp_grid
from stickslip.show.report.tables import show

SPEED, PERIOD = 5e-5, 1.0  # m/s, s


def sawtooth(slips):
    """A block that stands still and slips by half a cosine of 40 ms, once a second; 1 kHz."""
    t = np.arange(0.0, (slips + 0.7) * PERIOD, 1e-3)
    x = np.zeros_like(t)
    for k in range(1, slips + 1):
        x += 0.5 * SPEED * PERIOD * (1 - np.cos(np.pi * np.clip((t - k * PERIOD) / 0.04, 0, 1)))
    x += np.random.default_rng(3).normal(0, 5e-9, t.size)
    return Trace(name="run", time=t, displacement=x, drive=Drive.constant(SPEED, 0.0, float(t[-1])), noise=5e-9)


def whole(slips):
    """Axes of the whole trace, and the trace."""
    trace = sawtooth(slips)
    found = segment(trace)
    assert len(found.events) == slips
    data = xarray.Dataset(trace_pieces(trace, found, 0))
    return trace_picture(data, 0, {"name": "run", "events": found.events}).axes[0], trace


def labels(axes):
    return [str(line.get_label()) for line in axes.get_lines()]


def test_a_short_way_is_drawn_with_its_load_point_and_onsets():
    axes, _ = whole(4)
    assert labels(axes) == ["load point", "measured", "onset"]
    assert axes.get_ylabel().startswith("position / ")
    assert axes.get_legend() is not None


def test_a_long_way_is_drawn_as_distance_to_the_load_point():
    axes, trace = whole(200)
    assert labels(axes) == ["measured"]  # 200 marks would cover it
    assert axes.get_ylabel() == "load point less position / µm"
    (line,) = axes.get_lines()
    shown = np.asarray(line.get_ydata(), float) * 1e-6
    gap = trace.drive.position(trace.time) - trace.displacement
    # every tip of the saw-tooth is there although far fewer points are drawn than were measured
    assert line.get_xdata().size < 0.05 * trace.time.size
    tips = [shown[np.abs(line.get_xdata() - k * PERIOD) < 0.5 * PERIOD].max() for k in range(1, 200)]
    assert tips == pytest.approx([SPEED * PERIOD - gap.min()] * 199, rel=0.03)


def test_grids_of_fits_say_which_line_is_the_model():
    tau = np.linspace(0, 1, 20)
    data = xarray.Dataset(
        {
            f"{kind}0_{name}": (f"{kind}0", tau * 1e-6)
            for kind, names in (
                ("ramp", ("tau", "displacement", "model")),
                ("creep", ("time", "displacement", "model")),
            )
            for name in names
        }
    )
    fit = {"trace": "run", "event": 1, "nrmse": 0.01, "u_max": 1e-6}
    for grid in (ramp_grid, creep_grid):
        legend = grid(data, [fit]).axes[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()] == ["measured", "static model"]


PART = """[[trace]]
name = "{}"
file = "a.csv"
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "m" }}
drive_velocity = "50 um/s"
"""
RIG = """[rig]
spring_stiffness = "1000 N/m"
normal_force = "0.3 N"
friction_coefficient = 0.2
"""


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run a command on a campaign of some traces of one slip or more; its exit code, output and message."""
    monkeypatch.setenv("STICKSLIP_NO_CACHE", "1")

    def run_it(slips, names, *command):
        trace = sawtooth(slips)
        np.savetxt(tmp_path / "a.csv", np.column_stack([trace.time, trace.displacement]), delimiter=",", fmt="%.9g")
        path = tmp_path / "c.toml"
        path.write_text('schema = 1\ntitle = "rig"\n' + RIG + "".join(PART.format(name) for name in names))
        code = run([command[0], str(path), *command[1:]])
        return code, *capsys.readouterr()

    return run_it


@pytest.mark.parametrize(("names", "counted"), [(["a"], "1 trace"), (["a", "b"], "2 traces")])
def test_inspect_counts_the_traces_in_words(call, names, counted):
    code, out, _ = call(3, names, "inspect")
    assert code == 0
    assert out.splitlines()[0] == f"rig: {counted}"


def test_a_campaign_without_a_creep_process_is_named(call):
    code, _, said = call(1, ["a"], "fit", "--model", "static")
    assert code == 2
    assert "c.toml: nothing here can be compared with the static model" in said


def test_steps_of_a_ladder_are_named_by_what_they_add():
    steps = [
        {"model": ["static"], "added": None, "train_error": 900.0, "by_phase": {"slip": 900.0}},
        {"model": ["static", "inertia"], "added": None, "train_error": 9.0, "by_phase": {"slip": 9.0}},
        {"model": ["static", "inertia", "tilt"], "added": "tilt", "train_error": 1.0, "by_phase": {"slip": 1.0}},
        {
            "model": ["static", "inertia", "tilt", "wear"],
            "added": "wear",
            "train_error": 0.9,
            "by_phase": {"slip": 0.9},
        },
        {"model": ["static", "inertia", "wear"], "added": None, "removed": "tilt", "train_error": 0.9, "by_phase": {}},
    ]
    axes = ladder_picture(steps).axes[0]
    labels = [text.get_text() for text in axes.get_xticklabels()]
    assert labels == ["static", "+ inertia", "+ tilt", "+ wear", "without tilt"]


def test_a_ladder_shows_every_phase_on_fitted_and_on_unseen_runs():
    steps = [
        {"model": ["static"], "by_phase": {"slip": 9.0, "creep": 3.0}, "heldout_by_phase": {"slip": 8.0}},
        {"model": ["static", "inertia"], "by_phase": {"slip": 2.0, "creep": 1.0}, "heldout_by_phase": {"slip": 4.0}},
    ]
    lines = ladder_picture(steps).axes[1].get_lines()[:-1]  # the last is the line at 1
    drawn = {(line.get_linestyle(), line.get_color()): list(line.get_ydata()) for line in lines}
    assert sorted(drawn.values()) == [[3.0, 1.0], [8.0, 4.0], [9.0, 2.0]]
    (unseen,) = (colour for style, colour in drawn if style == "--")
    assert drawn["-", unseen] == [9.0, 2.0]


def test_what_follows_a_slip_is_drawn_in_its_own_scale():
    trace = sawtooth(4)
    found = segment(trace)
    data = xarray.Dataset(trace_pieces(trace, found, 0))
    axes = trace_picture(data, 0, {"name": "run", "events": found.events}).axes[3]
    assert axes.get_title() == "after the slip" or axes.get_title(loc="left") == "after the slip"
    (line,) = axes.get_lines()
    assert np.ptp(line.get_ydata()) < 60  # nm of noise, beside a slip of 50 um
    assert axes.get_ylabel() == "position / nm"
    assert 0 <= line.get_xdata()[0] < 2


@pytest.mark.parametrize(
    ("value", "unit", "digits", "shown"),
    [(264e-6, "N", 2, "260 µN"), (1063.0, "1", 3, "1060"), (2.3e7, "1", 3, "2.3e+07"), (0.0042, "1", 2, "0.0042")],
)
def test_numbers_of_a_report_have_no_needless_powers(value, unit, digits, shown):
    assert show(value, unit, digits) == shown


def test_a_prefix_never_stands_before_a_one():
    assert show(0.614, "1/m") == "0.614 1/m"
    assert quantity(0.614, "1/m") == "0.614 1/m"
    assert scaled(np.array([0.614]), "1/m") == (1.0, "1/m")
