"""The pages in a notebook's output, and an effect of one's own that is saved in an editor: in a real browser."""

from __future__ import annotations

import time
import urllib.request
from pathlib import Path

import pytest

import stickslip as ss
from stickslip.workbench.session import Session

from .browser import Browser, Served
from .conftest import campaign_in
from .test_browser import CHROMIUM, DRIVER
from .test_serve import EFFECT

pytestmark = pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason="there is no Chromium with its driver")
PAGES = ("Data", "Model against measurement", "What is missing", "Simulate", "Keep")


@pytest.mark.slow
def test_the_output_of_a_cell_holds_the_pages(campaign, base, monkeypatch, tmp_path):
    """As a notebook puts it into its page: nothing but what the object gives for HTML."""
    monkeypatch.setattr(type(campaign), "fit", lambda self, **_: base)
    monkeypatch.setattr(Session, "list_promises", lambda self: None)
    browser = Browser(str(CHROMIUM), str(DRIVER), 1400, 1200)
    try:
        with ss.workbench(campaign, tall=900) as shown:
            cell = tmp_path / "cell.html"
            cell.write_text(f"<!doctype html><html><body><div>{shown._repr_html_()}</div></body></html>")
            browser.driver.get(cell.as_uri())
            browser.driver.switch_to.frame(0)
            browser.wait(lambda: browser.js("return seen('.bk-tab').length == 5"), 60)
            assert tuple(browser.text(".bk-tab").splitlines()) == PAGES
            browser.idle()
            browser.tab("Model")
            browser.wait(lambda: browser.js("const m = named('error map'); return m && m.data.error.length"), 60)
            error = f"{base.error:.3f}"[:4]
            assert error in browser.text(".errors")
            browser.redraw("weakening.drop", 0.7)  # the socket is let through
            browser.wait(lambda: "by hand" in browser.text(".errors"))
        browser.wait(lambda: "does not answer" in browser.text("#gone"))
        with pytest.raises(OSError):
            urllib.request.urlopen(shown.url, timeout=5)
    finally:
        browser.close()


@pytest.mark.long
def test_an_effect_that_is_saved_in_the_editor_is_fitted_anew_in_the_window(tmp_path):
    campaign, path = campaign_in(tmp_path), Path(tmp_path / "own_effect.py")
    path.write_text(EFFECT)
    served = Served(campaign, "--effect", str(path))
    browser = Browser(str(CHROMIUM), str(DRIVER))
    own = '.effect-row[data-tag="own-pull"]'
    try:
        browser.open(served.url)
        browser.idle()
        browser.tab("missing")
        browser.wait(lambda: browser.js(f"return seen('{own}').length"), 300)
        browser.press(f"{own} button", "Switch on")
        browser.wait(lambda: "+ own-pull" in browser.text(".model"), 120)
        browser.idle()
        assert "2 of 2: with own-pull" in browser.text(".model")
        before = float(browser.text(".errors").split()[1])
        # twice the force for the same parameter: the fit comes to the same error
        path.write_text(EFFECT.replace("return self.pull", "return 2.0 * self.pull"))
        browser.wait(lambda: "3 of 3: new own-pull" in browser.text(".model"), 120)
        browser.idle()
        assert float(browser.text(".errors").split()[1]) == pytest.approx(before, abs=3e-3)
        assert "own_effect.py was reloaded: own-pull" in browser.text(".said")
        path.write_text(EFFECT.replace("return self.pull", "return self.push"))
        browser.wait(lambda: "own_effect.py" in browser.text(".said") and "push" in browser.text(".said"), 120)
        line = 1 + EFFECT[: EFFECT.index("return self.pull")].count("\n")
        assert f"line {line}" in browser.text(".said")
        path.write_text(EFFECT)
        browser.wait(lambda: "was reloaded" in browser.text(".said"), 120)
        browser.idle()
        browser.tab("Model")  # and the server is alive
        browser.wait(lambda: browser.js("return seen('.knob').length"))
        browser.redraw("weakening.drop", 0.7)
        assert served.process.poll() is None and not browser.elsewhere()
        time.sleep(0.5)
    finally:
        browser.close()
        served.end()
