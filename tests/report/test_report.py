"""A report is one file made from the run folder alone, says what the result holds, and lets no file speak HTML."""

import os
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray

from stickslip.errors import RunFolderError
from stickslip.show.report import write_report
from stickslip.system.runstore import json_text

EVIL = '<script>document.title="bad"</script><img src=x onerror=alert(1)> $\\frac{1}$'
DIAGNOSIS = {
    "schema": 1,
    "kind": "diagnose",
    "title": EVIL,
    "verdict": {"kind": "ambiguous", "effects": ["tilt"], "set": ["tilt", "nonlinear-spring"], "text": EVIL},
    "ladder": [
        {
            "model": ["static"],
            "added": None,
            "train_error": 41.0,
            "heldout_error": 39.5,
            "by_phase": {"creep": 30.1, "slip": 55.0},
        },
        {
            "model": ["static", "inertia"],
            "added": "inertia",
            "train_error": 2.0,
            "heldout_error": None,
            "by_phase": {"creep": 2.5, "slip": 1.0},
        },
    ],
    "ranking": [
        {
            "effect": "tilt",
            "score": 0.61,
            "refit": True,
            "form": {"by": "contact"},
            "gain": 61.5,
            "heldout_cost": 80.2,
            "heldout_cost_std": 7.1,
            "amplitude": {"value": 0.01, "std": 0.0004, "unit": "1"},
        }
    ],
    "later_rounds": [
        {
            "base": {"model": ["static", "inertia", "tilt"], "cost": 321.0, "train_error": 1.7, "heldout_error": 1.9},
            "ranking": [{"effect": "sensor-drift", "score": 0.3, "note": "not refitted"}],
        }
    ],
    "parameters": {
        "contact.u_max": {"value": 9.2e-7, "std": 2e-8, "unit": "m"},
        "rig.mass": {"value": 0.0894, "std": None, "unit": "kg"},
    },
    "equations": [{"text": "m x'' = F < 0 & more", "latex": "x"}],
    "next_experiment": {"text": "start in reverse", "separates": ["tilt", "nonlinear-spring"]},
    "identifiability": ["h_rms, L and F_n act only together"],
    "traces": [
        {
            "name": EVIL,
            "file": EVIL,
            "sha256": "0" * 64,
            "drive_velocity": 5e-5,
            "duration": 10.0,
            "sampling_rate": 1e4,
            "regime": "stick-slip",
            "reason": EVIL,
            "units": {"slip": "m", "peak_velocity": "m/s"},
            "warnings": [EVIL],
            "repairs": [],
            "dropped": [],
            "events": [
                {"index": 0, "t_onset": 4.8, "slip": 5e-5, "recurrence": None, "peak_velocity": 2e-3, "hold_time": 0.0}
            ],
        }
    ],
    "dropped": [EVIL],
    "inputs": [{"file": EVIL, "sha256": "1" * 64}],
    "versions": {"stickslip": "0"},
    "seconds": 143.0,
}


class Reader(HTMLParser):
    """Tags, attributes and visible text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.handlers, self.text, self.images = [], [], [], "", []
        self._style = False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self._style = tag == "style"
        for name, value in attributes:
            if name in ("src", "href", "action", "data"):
                (self.images if tag == "img" else self.links).append(value)
            if name.startswith("on"):
                self.handlers.append(name)

    def handle_data(self, data):
        self.text += "" if self._style else data


def folder(tmp_path, result=DIAGNOSIS, arrays=True):
    where = tmp_path / "run"
    where.mkdir(parents=True)
    (where / "result.json").write_text(json_text(result))
    if arrays:
        t = np.linspace(0.0, 10.0, 200)
        data = {
            "trace0_whole_time": ("w", t, {"units": "s"}),
            "trace0_whole_position": ("w", 1e-6 * np.floor(t), {"units": "m"}),
            "residual": (("cycle", "phase"), np.array([[1.0, 2.0], [3.0, np.nan]])),
            **{
                f"cycle_{n}": ("cycle", np.array([1.0, 2.0])) for n in ("position", "velocity", "start", "contact_time")
            },
        }
        xarray.Dataset(data, coords={"phase": ["creep", "slip"]}).to_netcdf(where / "arrays.nc", engine="h5netcdf")
    return where


def with_markup(value):
    """A result with markup in every text that may be in it, names of parameters and phases too."""
    if isinstance(value, dict):
        return {f"{k}{EVIL}" if "." in k else k: v if k == "kind" else with_markup(v) for k, v in value.items()}
    if isinstance(value, list):
        return [with_markup(v) for v in value]
    return f"{value}{EVIL}" if isinstance(value, str) else value


def test_candidates_of_every_round_are_listed_with_form_and_standard_error(tmp_path):
    text = " ".join(Reader(write_report(folder(tmp_path)).read_text()).text.split())
    assert "tilt (contact)" in text
    assert "80 ± 7" in text
    later = text[text.index("On top of static + inertia + tilt") :]
    assert "321" in later
    assert "sensor-drift" in later


def test_markup_in_every_text_of_a_result_stays_text(tmp_path):
    page = Reader(write_report(folder(tmp_path, with_markup(DIAGNOSIS))).read_text())
    assert "script" not in page.tags
    assert page.handlers == []
    shown = page.text.count('<script>document.title="bad"</script>')
    assert shown > 2 * Reader(write_report(folder(tmp_path / "plain")).read_text()).text.count("<script>")


def test_what_files_say_stays_text(tmp_path):
    text = write_report(folder(tmp_path)).read_text()
    page = Reader(text)
    assert "script" not in page.tags
    assert page.handlers == []
    assert page.text.count('<script>document.title="bad"</script>') >= 6


def test_the_file_is_complete_in_itself(tmp_path):
    where = folder(tmp_path)
    page = Reader(write_report(where).read_text())
    assert page.links == []
    # ladder, trace
    assert len(page.images) == 2
    assert all(re.match(r"data:image/png;base64,iVBOR", image) for image in page.images)


def test_everything_a_diagnosis_holds_is_shown(tmp_path):
    words = " ".join(Reader(write_report(folder(tmp_path)).read_text()).text.split())
    for part in (
        "ambiguous", "cannot distinguish: tilt, nonlinear-spring", "start in reverse", "static + inertia", "39.5",
        "61.5", "0.01 ± 0.0004", "920 nm", "89.4 g", "m x'' = F < 0 & more",
        "h_rms, L and F_n act only together", "143 s", "0" * 64,
    ):  # fmt: skip
        assert part in words, part


def test_with_several_sets_every_experiment_is_shown(tmp_path):
    tried = {
        "experiment": "a hold of 10 s",
        "information": 0.6,
        "margin": 3.0,
        "odds": "20 times as likely",
        "note": "",
    }
    other = {"text": "hold the drive", "separates": ["wear", "thermal-creep"], "experiments": [tried]}
    result = {**DIAGNOSIS, "next_experiment": {**DIAGNOSIS["next_experiment"], "others": [other]}}
    words = " ".join(Reader(write_report(folder(tmp_path, result)).read_text()).text.split())
    assert "start in reverse (separates tilt, nonlinear-spring)" in words
    assert "hold the drive (separates wear, thermal-creep)" in words
    assert "a hold of 10 s" in words and "20 times as likely" in words


def test_results_with_little_in_them(tmp_path):
    where = folder(tmp_path, {"schema": 1, "kind": "simulate", "verdict": "stick-slip", "title": "t"}, arrays=False)
    assert "stick-slip" in Reader(write_report(where).read_text()).text


@pytest.mark.parametrize("part", ["ladder", "traces", "parameters"])
def test_a_damaged_result_is_one_message(tmp_path, part):
    with pytest.raises(RunFolderError, match="form of a stickslip result") as caught:
        write_report(folder(tmp_path, {**DIAGNOSIS, part: [7, 8]}))
    assert caught.value.exit_code == 2
    assert not (tmp_path / "run" / "report.html").exists()


def test_damaged_arrays_and_missing_folders_are_one_message(tmp_path):
    where = folder(tmp_path, arrays=False)
    (where / "arrays.nc").write_bytes(b"not a file of arrays")
    with pytest.raises(RunFolderError, match="arrays"):
        write_report(where)
    with pytest.raises(RunFolderError, match="no such folder"):
        write_report(tmp_path / "nothing")


def test_report_is_the_same_for_the_same_folder(tmp_path):
    where = folder(tmp_path)
    first = write_report(where).read_bytes()
    assert write_report(where).read_bytes() == first


@pytest.fixture
def browser(tmp_path):
    program = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)
    if program is None:
        pytest.skip("no Chromium on this machine (Debian: apt-get install chromium)")

    def call(*arguments):
        flags = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking "
        flags += "--disable-component-update --disable-sync --hide-scrollbars --window-size=1100,2400"
        command = [program, *flags.split(), f"--user-data-dir={tmp_path / 'profile'}", *arguments]
        return subprocess.run(
            command, capture_output=True, text=True, timeout=120, env={**os.environ, "HOME": str(tmp_path)}
        )

    return call


@pytest.mark.slow
def test_a_browser_shows_it(tmp_path, browser):
    from matplotlib.image import imread

    path = write_report(folder(tmp_path))
    picture = tmp_path / "page.png"
    done = browser(f"--screenshot={picture}", f"file://{path}")
    assert picture.is_file(), done.stderr
    shown = imread(picture)[..., :3]
    # rows of figures hold coloured ink; a page without its figures holds text and grey only
    coloured = (shown.max(axis=2) - shown.min(axis=2) > 0.15).any(axis=1)
    assert coloured.sum() > 400
    dom = browser("--dump-dom", f"file://{path}").stdout
    page = Reader(dom)
    assert "script" not in page.tags
    assert len(page.images) == 2
    assert "<title>bad</title>" not in dom
