"""How much work a move of a hand is: processor time, which other work on the machine does not change much."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest

from stickslip.workbench import model_page
from stickslip.workbench.overview import Levels, Window
from stickslip.workbench.session import Session

from .browser import DEEP
from .speed import GLIDE, long_campaign, opened
from .test_browser import CHROMIUM, DRIVER

HAND = 0.1  # s in which a slider is followed
FRAME = 1.0 / 30.0  # s of a redraw
SAMPLES = 1_000_000
DROP = "weakening.drop"
REDRAWS = 20.0  # a second, in the best of some tries on a machine that does other things too; the aim: 30


def _least(work, times: int) -> float:
    """Processor seconds of the quickest of some calls."""
    taken = []
    for i in range(times):
        began = time.thread_time()
        work(i)
        taken.append(time.thread_time() - began)
    return min(taken)


def test_the_first_page_is_made_before_models_and_what_fits_them_are_loaded(folder):
    code = (
        "import sys; from pathlib import Path; from stickslip.workbench.open_paths import opened\n"
        "from stickslip.workbench import app, data_page, serve, session\n"
        f"made = opened(Path({str(folder / 'campaign.toml')!r})); made.busy = session.LOOKING\n"
        "from bokeh.document import Document; app.view(made).server_doc(Document()).to_json()\n"
        "heavy = {'jax', 'equinox', 'diffrax', 'scipy', 'pandas', 'xarray', 'matplotlib', 'joblib', 'arviz'}\n"
        "sys.exit(', '.join(sorted(heavy & set(sys.modules))) or 0)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert found.returncode == 0, found.stderr


@pytest.mark.slow
def test_a_move_of_a_slider_is_worked_out_within_a_tenth_of_a_second(campaign, base, monkeypatch):
    """The model, its force and errors, and all that the page of the model draws of them."""
    monkeypatch.setattr(Session, "run_freely", lambda self, run: None)  # which waits until the hand stands still
    session = Session(campaign=campaign)
    session.first(base)
    page = model_page.page(session)
    value = base.values[DROP]

    def move(i: int) -> None:
        session.by_hand({DROP: value * (1.001 + 1e-4 * i)}, over=i > 0)

    move(0)
    assert _least(move, 8) < HAND and session.fit.by_hand and page is not None


@pytest.fixture(scope="module")
def long_curve():
    rng = np.random.default_rng(3)
    return Levels(np.arange(SAMPLES) / 1e4, np.cumsum(rng.normal(size=SAMPLES)))


@pytest.mark.parametrize("what", ["pan", "zoom"])
def test_a_part_of_a_million_samples_is_reduced_within_a_redraw(long_curve, what):
    """Three curves of a run, moved along or zoomed into."""
    whole = (0.0, SAMPLES / 1e4)

    def answer(i: int) -> None:
        window = Window(whole)
        width = 60.0 if what == "pan" else 60.0 * 0.7**i
        needed = window.needed(20.0 + 0.5 * i, 20.0 + 0.5 * i + width)
        assert needed is not None
        for _ in range(3):
            t, y = long_curve(*needed)
            assert 100 < t.size == y.size < 20_000

    assert _least(answer, 8) < FRAME


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason="there is no Chromium with its driver")
def test_five_runs_of_a_million_samples_are_panned_and_zoomed_smoothly(tmp_path):
    served, seen, _, _ = opened(long_campaign(tmp_path / "long"))
    try:
        for zoom in (False, True):
            redraws = [seen.driver.execute_async_script(DEEP + GLIDE, zoom) for _ in range(3)]
            assert max(redraws) > REDRAWS, (zoom, redraws)
    finally:
        seen.close()
        served.end()
