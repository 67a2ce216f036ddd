"""Pictures of workbench.md: the pages as Chromium draws them.

    python docs/make_workbench.py

Writes into docs/images, from the shipped campaign in a folder of its own: workbench-data.png, workbench-events.png,
workbench-drop.png, workbench-missing.png, workbench-backbone.png, workbench-simulate.png, workbench-sweep.png,
workbench-rivals.png, workbench-keep.png, workbench-model.png and workbench-dark.png; and beside them workbench.txt:
what the pages say, by which a test sees whether the pictures are of this version.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

import stickslip as ss
from stickslip.workbench.session import Session
from tests.workbench.browser import DEEP, Browser, Served
from tests.workbench.page_outline import OUTLINE, outline

IMAGES = ROOT / "docs" / "images"
SIZE = 1280, 1100
FRAME = 143  # pixels of a window that are not its page
SETTLED = 1.5  # s after the last change until all is drawn


WRITE = """
const field = seen('input').find((e) => e.placeholder.startsWith('first'))
if (!field) return false
field.value = arguments[0]
for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, { bubbles: true }))
return true
"""


TOP = """
const [words, above] = arguments
const head = seen('.head, h3, th, .line, b').find((e) => e.textContent.startsWith(words))
if (!head) return false
window.scrollBy(0, head.getBoundingClientRect().top - above)
return true
"""
LISTED = "return seen('.line').some((e) => e.textContent.startsWith('ordered by expected fall'))"
FREE = "return seen('.line').some((e) => e.textContent.includes('the slip is'))"
DONE = "return seen('.work .fill').length === 0"


def picture(browser: Browser, name: str, words: str = "", tall: int = SIZE[1], above: int = 8) -> None:
    """Save what is seen.

    Args:
        browser: which shows it.
        name: of the picture.
        words: with which a heading begins that is brought to the top.
        tall: pixels of the window.
        above: pixels over the heading.
    """
    browser.driver.set_window_size(SIZE[0], tall + FRAME)
    if words:
        browser.wait(lambda: browser.js(TOP, words, above))
    else:
        browser.js("window.scrollTo(0, 0)")
    time.sleep(SETTLED)
    if words:  # what was drawn meanwhile has moved it
        browser.js(TOP, words, above)
        time.sleep(SETTLED)
    browser.driver.save_screenshot(str(IMAGES / f"workbench-{name}.png"))


def data(browser: Browser, folder: Path) -> None:
    """Runs and signals, events, and a file that is dropped."""
    browser.wait(lambda: "Can tell" in browser.text("h3, h4, .head, .group"), 120)
    browser.wait(lambda: browser.js("return seen('th').some((e) => e.textContent.startsWith('overshoot'))"), 120)
    picture(browser, "data")
    picture(browser, "events", "event", 560, 310)
    dropped = folder.parent / "another.csv"
    dropped.write_text((folder / "v200.csv").read_text(encoding="utf-8"), encoding="utf-8")
    root = browser.driver.execute_script(DEEP + "return all('input[type=file]')[0]")
    root.send_keys(str(dropped))
    browser.wait(lambda: "Are these the columns?" in browser.text(".line"), 60)
    picture(browser, "drop", "Add a run", 480)


def missing(browser: Browser) -> None:
    """The residual and the effects; the one that promises most switched on; the ladder and the backbone."""
    browser.tab("What is missing")
    browser.wait(lambda: browser.js(LISTED), 300)
    browser.js("seen('.effect-row[data-tag=\"contact-ageing\"]')[0].click()")
    picture(browser, "missing")
    browser.press('.effect-row[data-tag="contact-ageing"] button', "Switch on")
    browser.wait(lambda: "contact-ageing" in browser.text(".model"), 120)
    browser.idle()
    browser.wait(lambda: "nearest rough lines" in browser.text(".line"), 120)
    picture(browser, "backbone", "u_max", 880, 850)


def simulated(browser: Browser) -> None:
    """One run, a sweep, and rivals in every experiment."""
    browser.tab("Simulate")
    browser.press("button", "Simulate")
    browser.wait(lambda: "model" in browser.text("td"), 120)
    picture(browser, "simulate", tall=900)
    browser.press("button", "Sweep")
    browser.wait(lambda: browser.js("return named('sweep').data.v.length === 6"), 200)
    browser.wait(lambda: browser.js(DONE), 60)
    picture(browser, "sweep", "A sweep of the velocity", 420)
    browser.tab("Model")
    browser.press("button", "Undo")  # on top of the base model there are two that promise much
    browser.wait(lambda: "contact-ageing" not in browser.text(".model"))
    browser.tab("What is missing")
    browser.wait(lambda: browser.js(LISTED), 300)
    browser.tab("Simulate")
    browser.wait(lambda: "rate-and-state" in browser.text(".choices__item"), 60)
    browser.press("button", "Simulate each")
    browser.wait(lambda: browser.js("return seen('.work .fill').length"), 60)
    browser.wait(lambda: browser.js(DONE), 500)
    picture(browser, "rivals", "The experiment that would", 1050)


def kept(browser: Browser) -> None:
    """The history, and the model saved as a run folder."""
    browser.tab("Model")
    browser.press("button", "Redo")
    browser.tab("Keep")
    browser.wait(lambda: browser.js(WRITE, "first"))
    browser.press("button", "Save")
    browser.wait(lambda: "first" in browser.text("td"), 200)
    browser.js("seen('.choosing tbody tr').find((e) => e.cells[0].textContent === 'first').click()")
    browser.wait(lambda: browser.js("return seen('iframe').length"))
    picture(browser, "keep")


def model(browser: Browser, url: str) -> None:
    """Sliders, one cycle and its slip run freely, the map of the error; the same in the dark."""
    browser.tab("Model")
    browser.wait(lambda: browser.js("return seen('.knob').length"))
    browser.idle()
    browser.wait(lambda: browser.js(FREE), 120)
    picture(browser, "model")
    browser.open(url, "Model", theme="dark")
    browser.idle()
    browser.wait(lambda: browser.js(FREE), 120)
    picture(browser, "dark")


def main() -> None:
    """Open, look, switch the effect on, look."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "campaign"
        shutil.copytree(ROOT / "scenarios" / "hidden-effect", folder)
        served = Served(folder / "campaign.toml")
        browser = Browser(str(shutil.which("chromium")), str(shutil.which("chromedriver")), *SIZE)
        try:
            browser.open(served.url, "Data")
            browser.idle()
            data(browser, folder)
            missing(browser)
            simulated(browser)
            kept(browser)
            model(browser, served.url)
        finally:
            browser.close()
            served.end()
    campaign = ss.load_campaign(ROOT / "scenarios" / "hidden-effect" / "campaign.toml")
    session = Session(campaign=campaign)
    session.first(campaign.fit())
    OUTLINE.write_text(outline(session), encoding="utf-8")


if __name__ == "__main__":
    main()
