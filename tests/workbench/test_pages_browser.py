"""The pages of the data and of what is kept, as a person meets them: a real browser before a real server."""

from __future__ import annotations

import json
import shutil

import pytest

from .browser import Browser, Served
from .conftest import SCENARIO, campaign_in
from .test_browser import CHROMIUM, DRIVER

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason="there is no Chromium with its driver"),
    pytest.mark.slow,
]
MARKUP = "<img src=x onerror=window.hit=1>.csv"
SAID = "return seen('.line, .work .said').map((e) => e.textContent).join('|')"
RUNS = "return seen('tbody tr').map((e) => e.cells[0].textContent)"


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return campaign_in(tmp_path_factory.mktemp("pages")).parent


@pytest.fixture(scope="module")
def browser(home):
    served = Served(home / "campaign.toml")
    made = Browser(str(CHROMIUM), str(DRIVER), height=1800)
    made.open(served.url, "Data")
    made.wait(lambda: made.js("const d = named('data displacement'); return d && d.data.t.length"), 60)
    yield made
    made.close()
    served.end()


def _write(browser, placeholder, text):
    browser.js(
        "const i = seen('input').find((e) => e.placeholder.startsWith(arguments[0])); i.value = arguments[1];"
        "for (const kind of ['input', 'change']) i.dispatchEvent(new Event(kind, { bubbles: true }))",
        placeholder,
        text,
    )


def test_a_zoom_is_answered_with_every_sample(browser):
    few = browser.js("return named('data displacement').data.t.length")
    assert few < 3500
    browser.js("named('signal displacement').x_range.setv({ start: 6.83, end: 6.93 })")
    browser.wait(
        lambda: browser.js(
            "const t = [...named('data displacement').data.t].filter((a) => a >= 6.83 && a <= 6.93);"
            "return t.length > 990"  # 10 kHz
        )
    )


def test_a_tap_on_a_mark_and_a_click_on_a_row_select(browser):
    browser.js(
        "const f = named('signal displacement'); f.x_range.setv({ start: 0, end: 14 });"
        "f.trigger_event(new (Bokeh.require('core/bokeh_events').Tap)(0, 0, 12.29, 0, {}))"
    )
    marked = "return seen('tr.chosen').map((e) => e.cells[0].textContent).join()"
    browser.wait(lambda: browser.js(marked) == "v050,6")
    browser.js("seen('.choosing tbody tr').find((e) => e.cells[0].textContent === 'holds').click()")
    browser.wait(lambda: browser.js(marked) == "holds,6")


def test_a_dropped_file_becomes_a_run_and_its_name_is_no_markup(browser, home, tmp_path):
    for name in (MARKUP, "run6.csv"):
        shutil.copy(home / "v200.csv", tmp_path / name)
    browser.js("return all('input[type=file]')[0]").send_keys(str(tmp_path / MARKUP))
    browser.wait(lambda: f"{MARKUP}: 37010 rows" in browser.js(SAID), 60)
    browser.press("button", "Add the run")
    browser.wait(lambda: "cannot be used" in browser.js(SAID))
    assert browser.js("return window.hit || 0") == 0
    browser.js("return all('input[type=file]')[0]").send_keys(str(tmp_path / "run6.csv"))
    browser.wait(lambda: "run6.csv: 37010 rows" in browser.js(SAID), 60)
    _write(browser, "50 um/s", "200 um/s")
    browser.idle(200)  # a run is not added while a model is fitted
    browser.press("button", "Add the run")
    browser.wait(lambda: "run6" in browser.js(RUNS), 60)
    assert 'file = "run6.csv"' in (home / "campaign.toml").read_text()
    browser.idle(200)


def test_the_arrows_scroll_where_they_select_nothing(browser):
    press = """
    const key = new KeyboardEvent('keydown', { key: 'ArrowDown', bubbles: true, composed: true, cancelable: true })
    return !(arguments[0] ? seen(arguments[0])[0] : document.body).dispatchEvent(key)
    """
    browser.tab("Data")
    browser.wait(lambda: browser.js(press, ""))
    assert not browser.js(press, "tbody tr") and not browser.js(press, "input")
    browser.tab("Keep")
    browser.wait(lambda: not browser.js(press, ""))


def test_the_model_is_saved_listed_and_its_report_shown(browser, home):
    browser.tab("Keep")
    browser.idle(200)  # until then there is no model to save, which the page says
    browser.wait(lambda: browser.js("return seen('button').some((e) => e.textContent.trim() === 'Save')"))
    _write(browser, "first", "../elsewhere")
    browser.press("button", "Save")
    browser.wait(lambda: "cannot be used" in browser.js(SAID))
    _write(browser, "first", "kept here")
    browser.press("button", "Save")
    browser.wait(lambda: "kept here" in browser.js(RUNS), 200)
    result = json.loads((home / "kept here" / "result.json").read_text())
    assert result["kind"] == "fit" and len(result["traces"]) == 6
    browser.js("seen('.choosing tbody tr').find((e) => e.cells[0].textContent === 'kept here').click()")
    frame = browser.wait(lambda: browser.js("return seen('iframe')[0]"))
    assert frame.get_attribute("sandbox") == "" and "Force along the measured motion" in frame.get_attribute("srcdoc")
    assert not (home.parent / "elsewhere").exists()


def test_the_legend_names_a_curve_once_it_is_there(browser):
    names = """
    const own = (r) => (r.data_source || {}).name === 'simulated'
    return Bokeh.documents.flatMap((d) => [...d._all_models.values()]).filter((m) => m.type === 'LegendItem')
      .filter((i) => i.renderers.some(own) && i.label.value !== 'model').map((i) => [i.label.value, i.visible])
    """
    browser.tab("Simulate")
    browser.idle()
    browser.press("button", "Simulate")
    browser.wait(lambda: browser.js("return named('simulated').data.t.length"), 120)
    (found,) = browser.wait(lambda: browser.js(names))
    assert found[0].startswith("model: static + inertia") and found[1]


def test_a_campaign_that_was_chosen_is_shown(tmp_path):
    shutil.copytree(SCENARIO, tmp_path / "rig")
    served = Served(tmp_path)
    made = Browser(str(CHROMIUM), str(DRIVER))
    try:
        made.open(served.url)
        made.press("button", "Open rig")
        made.wait(lambda: made.js("const d = named('data displacement'); return d && d.data.t.length"), 60)
        made.wait(lambda: "Simulate" in made.text(".bk-tab"))
        assert made.complaints() == []
    finally:
        made.close()
        served.end()


def test_nothing_is_asked_of_the_network_and_nothing_complained(browser):
    assert browser.elsewhere() == [] and browser.complaints() == []
