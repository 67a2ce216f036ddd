"""Pictures of workbench.md: the pages as Chromium draws them.

    python docs/make_workbench.py

Writes workbench-model.png and workbench-missing.png into docs/images, from the shipped campaign in a folder of its own.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.workbench.browser import Browser, Served

IMAGES = ROOT / "docs" / "images"
SIZE = 1280, 1100
SETTLED = 1.5  # s after the last change until all is drawn


def main() -> None:
    """Open, look, switch the effect on, look."""
    with tempfile.TemporaryDirectory() as folder:
        for path in (ROOT / "scenarios" / "hidden-effect").iterdir():
            if path.is_file():
                shutil.copy(path, folder)
        served = Served(Path(folder) / "campaign.toml")
        browser = Browser(str(shutil.which("chromium")), str(shutil.which("chromedriver")), *SIZE)
        try:
            browser.open(served.url, "What is missing")
            browser.idle()
            browser.wait(
                lambda: browser.js("return seen('.line').some((e) => e.textContent.startsWith('by the fall'))"), 300
            )
            browser.js("seen('.effect-row[data-tag=\"contact-ageing\"]')[0].click()")
            time.sleep(SETTLED)
            browser.driver.save_screenshot(str(IMAGES / "workbench-missing.png"))
            browser.press('.effect-row[data-tag="contact-ageing"] button', "Switch on")
            browser.wait(lambda: "contact-ageing" in browser.text(".model"), 120)
            browser.tab("Model")
            browser.wait(lambda: browser.js("return seen('.knob').length"))
            browser.idle()
            time.sleep(SETTLED)
            browser.driver.save_screenshot(str(IMAGES / "workbench-model.png"))
        finally:
            browser.close()
            served.end()


if __name__ == "__main__":
    main()
