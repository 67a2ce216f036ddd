"""Progress of long work: a bar where somebody sees it, silence elsewhere, and the caller's own where it is given."""

import io
import sys
from pathlib import Path

import pytest

import stickslip as ss
from stickslip.errors import ArgumentError
from stickslip.simulation.scenario.demonstration import RIG
from stickslip.system import progress
from stickslip.system.progress import cancellable, portion, reporting

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


class Terminal(io.StringIO):
    def isatty(self):
        return True


def terminal(monkeypatch, kind=Terminal):
    """A place for stderr, set within the test: pytest's own capture comes between fixtures and tests."""
    monkeypatch.setattr(progress, "PATIENCE", -1.0)
    monkeypatch.setattr(sys, "stderr", made := kind())
    return made


@pytest.mark.slow
def test_a_terminal_shows_a_bar_by_default(monkeypatch):
    screen, campaign = terminal(monkeypatch), ss.load_campaign(SHIPPED)
    assert "reading" in screen.getvalue()
    campaign.inspect()
    assert "inspecting" in screen.getvalue() and "holds" in screen.getvalue()
    fit = campaign.fit()
    assert "fitting" in screen.getvalue() and "the base model" in screen.getvalue()
    fit.add("contact-ageing")
    assert "adding contact-ageing" in screen.getvalue()


@pytest.mark.slow
def test_a_simulation_shows_one_too(monkeypatch):
    screen = terminal(monkeypatch)
    ss.simulate(ss.make_scenario(RIG))
    assert "simulating" in screen.getvalue() and "s simulated, " in screen.getvalue()


def test_the_callers_own_is_told_and_no_bar_is_shown(monkeypatch):
    screen, heard = terminal(monkeypatch), []
    with reporting("work", lambda text, share: heard.append((text, share))) as tell:
        tell("a step", 0.5)
    with cancellable(lambda: False), reporting("work", None) as tell:  # as in the workbench, which shows it itself
        tell("a step", 0.5)
    assert screen.getvalue() == "" and heard == [("a step", 0.5)]
    with reporting("work", None) as tell:
        tell("a step", 0.5)
    assert "a step" in screen.getvalue()


def test_what_is_told_of_a_part_of_a_process_ends_with_it(monkeypatch):
    """As by ``xarray.set_options``: the inner one holds within the outer one, and an error ends both."""
    screen, heard = terminal(monkeypatch), []

    def work(name, own=None):
        with reporting(name, own) as tell:
            tell(name, 0.5)

    with pytest.raises(KeyError), ss.progress_to(lambda text, share: heard.append(text)):
        work("outer")
        with ss.progress_to(None):
            work("inner")
        work("own", lambda text, share: heard.append("its own"))
        ss.load_campaign(SHIPPED)
        raise KeyError
    assert heard[:2] == ["outer", "its own"] and heard[2] == "reading v050" and screen.getvalue() == ""
    work("after")
    assert "after" in screen.getvalue() and "after" not in heard


def test_a_script_is_silent(monkeypatch):
    log = terminal(monkeypatch, io.StringIO)
    monkeypatch.setattr(progress, "EVERY", -1.0)
    with reporting("work", None) as tell:
        tell("a step", 0.5)
    assert log.getvalue() == ""


@pytest.mark.slow
def test_a_fit_and_a_sample_tell_their_share_as_they_go():
    heard = []
    fit = ss.load_campaign(SHIPPED).fit(progress=lambda text, share: heard.append(share))
    assert len(heard) > 3 and heard == sorted(heard) and heard[-1] <= 1.0
    pytest.importorskip("nutpie")
    heard.clear()
    fit.sample(draws=2, tune=3, chains=1, progress=lambda text, share: heard.append(share))
    assert heard == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_shares_of_a_part_are_told_as_shares_of_the_whole():
    heard = []
    with portion(0.5, 1.0, heard.append), portion(0.0, 0.5):
        progress.breathe(1.0)
    assert heard == [0.75]


def test_a_notebook_shows_a_bar_under_the_cell_while_it_lasts():
    cell = """
from stickslip.system import progress
progress.PATIENCE = progress.REFRESH = -1.0
from IPython.display import HTML
seen = []
plain = HTML.__init__
HTML.__init__ = lambda self, data: (seen.append(data), plain(self, data))[1]
with progress.reporting("<work>", None) as tell:
    tell("a step", 0.5)
    tell("another", 0.75)
print(seen)
"""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    page = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell)])
    nbclient.NotebookClient(page, timeout=60, kernel_name="python3").execute()
    shown, said = page.cells[0].outputs
    assert shown.data["text/html"] == ""  # taken away
    assert "&lt;work&gt;" in said.text and 'value="0.750"' in said.text and "another" in said.text


def test_who_cannot_be_told_is_refused_in_words():
    with pytest.raises(ArgumentError, match=r"(?s)^tell: progress is told to a function \(got 'x'\).*or None"):
        ss.progress_to("x")
    with pytest.raises(ArgumentError, match=r"^progress: .*'x'"):
        ss.load_campaign(SHIPPED, progress="x")


@pytest.mark.parametrize(
    ("drive", "until"), [(RIG["drive"], lambda steps: steps.x > 1e-7), ({"velocity": 2e-4, "events": 1}, None)]
)
def test_the_share_ends_at_one_however_a_run_ends(drive, until):
    heard = []
    scenario = ss.make_scenario({**RIG, "drive": drive})
    ended = ss.simulate(scenario, lambda text, share: heard.append(share), until=until)
    assert ended.attrs["ended"] == ("complete" if until is None else "until")
    assert heard == sorted(heard) and heard[-1] == 1.0
