"""Pictures of workbench.md: the pages as Chromium draws them.

    python docs/make_workbench.py

Writes workbench-data.png, -missing.png, -model.png, -simulate.png and -keep.png into docs/images, from the shipped
campaign in a folder of its own, and beside them workbench.txt: what the pages say, by which a test sees whether the
pictures are of this version.
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
from tests.workbench.browser import Browser, Served
from tests.workbench.outline import OUTLINE, outline

IMAGES = ROOT / "docs" / "images"
SIZE = 1280, 1100
SETTLED = 1.5  # s after the last change until all is drawn


WRITE = """
const field = seen('input').find((e) => e.placeholder.startsWith('first'))
if (!field) return false
field.value = arguments[0]
for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, { bubbles: true }))
return true
"""


def picture(browser: Browser, name: str) -> None:
    """Save the page as it stands."""
    time.sleep(SETTLED)
    browser.driver.save_screenshot(str(IMAGES / f"{name}.png"))


def main() -> None:
    """Open, look, switch the effect on, look."""
    with tempfile.TemporaryDirectory() as folder:
        for path in (ROOT / "scenarios" / "hidden-effect").iterdir():
            if path.is_file():
                shutil.copy(path, folder)
        served = Served(Path(folder) / "campaign.toml")
        browser = Browser(str(shutil.which("chromium")), str(shutil.which("chromedriver")), *SIZE)
        try:
            browser.open(served.url, "Data")
            browser.idle()
            browser.wait(lambda: "Can tell" in browser.text("h3, h4, .head, .group"), 120)
            picture(browser, "workbench-data")
            browser.tab("What is missing")
            browser.wait(
                lambda: browser.js("return seen('.line').some((e) => e.textContent.startsWith('by the fall'))"), 300
            )
            browser.js("seen('.effect-row[data-tag=\"contact-ageing\"]')[0].click()")
            picture(browser, "workbench-missing")
            browser.press('.effect-row[data-tag="contact-ageing"] button', "Switch on")
            browser.wait(lambda: "contact-ageing" in browser.text(".model"), 120)
            browser.tab("Model")
            browser.wait(lambda: browser.js("return seen('.knob').length"))
            browser.idle()
            picture(browser, "workbench-model")
            browser.tab("Simulate")
            browser.press("button", "Simulate")
            browser.wait(lambda: "model" in browser.text("td"), 120)
            picture(browser, "workbench-simulate")
            browser.tab("Keep")
            browser.wait(lambda: browser.js(WRITE, "first"))
            browser.press("button", "Save")
            browser.wait(lambda: "first" in browser.text("td"), 200)
            browser.js("seen('.choosing tbody tr').find((e) => e.cells[0].textContent === 'first').click()")
            browser.wait(lambda: browser.js("return seen('iframe').length"))
            picture(browser, "workbench-keep")
        finally:
            browser.close()
            served.end()
    campaign = ss.load_campaign(ROOT / "scenarios" / "hidden-effect" / "campaign.toml")
    session = Session(campaign=campaign)
    session.first(campaign.fit())
    OUTLINE.write_text(outline(session), encoding="utf-8")


if __name__ == "__main__":
    main()
