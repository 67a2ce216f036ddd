"""Every page in windows of many widths: nothing lies over anything else, nothing beyond the window's edge."""

from __future__ import annotations

import time

import pytest

from .browser import Browser, Served
from .conftest import campaign_in
from .test_browser import CHROMIUM, DRIVER

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason="there is no Chromium with its driver"),
    pytest.mark.slow,
]
WIDTHS = (1200, 1440, 1920, 2560)
PAGES = ("Data", "Model", "missing", "Simulate", "Keep")
SETTLED = 1.0  # s after a change of the window until all lies where it stays
ACROSS = """
const there = (e) => getComputedStyle(e).visibility !== 'hidden' && getComputedStyle(e).opacity !== '0'
const edge = document.documentElement.clientWidth
const wide = document.scrollingElement.scrollWidth
const beyond = seen('button, select, input, table, canvas, .line, .knob, .effect-row')
  .map((e) => [e, e.getBoundingClientRect()])
  .filter(([e, r]) => there(e) && r.width > 0 && (r.right > edge + 1 || r.left < -1))
return [wide - edge, beyond.map(([e, r]) => `${e.tagName}.${e.className} ${r.left}-${r.right}`)]
"""
# what a hand presses or an eye reads: each has its own place
OVER = """
const parts = seen(
  'button:not(.bk-spin-btn), select, input:not([type=range]), table, .knob, .effect-row, .bk-Canvas, iframe')
  .filter((e) => !e.closest('.bk-ToolbarPanel') && getComputedStyle(e).opacity !== '0' &&
                 getComputedStyle(e).visibility !== 'hidden')
const hosts = (e) => {
  const found = []
  for (let at = e; at; at = at.parentNode || at.host) found.push(at)
  return found
}
const shown = (e) => {
  let { left, right, top, bottom } = e.getBoundingClientRect()
  for (const at of hosts(e).slice(1)) {
    if (!(at instanceof Element) || getComputedStyle(at).overflow === 'visible') continue
    const own = at.getBoundingClientRect()
    left = Math.max(left, own.left); right = Math.min(right, own.right)
    top = Math.max(top, own.top); bottom = Math.min(bottom, own.bottom)
  }
  return { left, right, top, bottom }
}
const found = []
for (let i = 0; i < parts.length; i++) for (let j = 0; j < i; j++) {
  const [a, b] = [parts[i], parts[j]]
  if (hosts(a).includes(b) || hosts(b).includes(a)) continue
  const [p, q] = [shown(a), shown(b)]
  const w = Math.min(p.right, q.right) - Math.max(p.left, q.left)
  const h = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top)
  if (w > 2 && h > 2) found.push(`${a.tagName}.${a.className} over ${b.tagName}.${b.className}: ${w} x ${h}`)
}
return [parts.length, found]
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    served = Served(campaign_in(tmp_path_factory.mktemp("layout")))
    made = Browser(str(CHROMIUM), str(DRIVER))
    made.open(served.url, "Data")
    made.idle()
    made.tab("missing")
    made.wait(lambda: made.js("return seen('.effect-row').length > 3"), 200)
    yield made
    made.close()
    served.end()


@pytest.mark.parametrize("page", PAGES)
def test_nothing_lies_over_anything_else_or_beyond_the_edge(browser, page):
    browser.tab(page)
    browser.wait(lambda: browser.js(OVER)[0] > 5, 60)
    for width in WIDTHS:
        browser.driver.set_window_size(width, 1100)
        time.sleep(SETTLED)
        assert browser.js("return window.innerWidth") == width
        too_wide, beyond = browser.js(ACROSS)
        assert too_wide <= 0 and not beyond, (width, too_wide, beyond)
        count, over = browser.js(OVER)
        assert count > 5 and not over, (width, over[:5])


def test_a_slider_stays_under_the_hand_that_moves_it(browser):
    """What the head says more of a model that was moved by hand takes no second line."""
    browser.driver.set_window_size(WIDTHS[0], 1100)
    browser.tab("Model")
    browser.wait(lambda: browser.js("return seen('.knob').length"), 60)
    browser.idle()
    place = "return all('.knob[data-name=\"weakening.drop\"]')[0].getBoundingClientRect().top"
    before = browser.js(place)
    browser.redraw("weakening.drop", 0.6)
    browser.wait(lambda: "by hand" in browser.text(".errors"))
    time.sleep(SETTLED)
    assert browser.js(place) == before
    browser.press("button", "Base")


def test_what_lies_over_something_is_found(browser):
    """The test itself: a button that is moved over another, and a table that is wider than the window."""
    browser.tab("Model")
    browser.wait(lambda: browser.js("return seen('.knob').length"), 60)
    time.sleep(SETTLED)
    browser.js("""
        const [a, b] = seen('button').filter((e) => /Fit|Undo/.test(e.textContent))
        a.id = 'moved'
        a.style.position = 'relative'
        a.style.left = `${b.getBoundingClientRect().left - a.getBoundingClientRect().left}px`
    """)
    assert browser.js(OVER)[1]
    browser.js("const e = all('#moved')[0]; e.style.left = '5000px'")
    assert browser.js(ACROSS)[1]
    browser.js("const e = all('#moved')[0]; e.style.left = '0px'")
