"""A real browser before a real server: what the tests of the workbench do with them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

ROOT = Path(__file__).parents[2]
DEEP = """
const all = (selector, from = document) => {
  const found = [...from.querySelectorAll(selector)]
  for (const each of from.querySelectorAll('*')) if (each.shadowRoot) found.push(...all(selector, each.shadowRoot))
  return found
}
const seen = (selector) => all(selector).filter((e) => e.getClientRects().length > 0)
const named = (name) => Bokeh.documents.map((d) => d.get_model_by_name(name)).find((m) => m)
"""


def command(*arguments: object) -> int:
    """The exit code of a command in a process of its own, as a user gives it.

    In a process that has JAX already, checked errors inside compiled code may stand otherwise (see
    :func:`stickslip.system.cache.keep_compiled`), and last digits with them.
    """
    whole = [sys.executable, "-m", "stickslip", *map(str, arguments)]
    return subprocess.run(whole, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL).returncode


class Served:
    """A server of its own process: of a campaign, or of what there is to choose from in a folder."""

    def __init__(self, place: Path, *more: str) -> None:
        what, folder = ((), place) if place.is_dir() else ((str(place),), place.parent)
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "stickslip", "open", *what, "--no-browser", *more],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert self.process.stdout is not None
        self.said = ""  # before the address
        while "http://127.0.0." not in (line := self.process.stdout.readline()):
            assert line, self.said
            self.said += line
        self.url = line.split()[-1]
        self.started = time.monotonic() - self.began

    def kill(self) -> None:
        """As a crash would."""
        self.process.kill()
        self.process.wait()

    def end(self) -> int:
        """As Ctrl-C would."""
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(timeout=20)
        return int(self.process.returncode)


class Browser:
    """Chromium without a screen."""

    def __init__(self, binary: str, driver: str, width: int = 1200, height: int = 1100) -> None:
        options = Options()
        options.binary_location = binary
        for argument in (
            "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", f"--window-size={width},{height}",
            "--hide-scrollbars", "--enable-unsafe-swiftshader", "--disable-background-networking",
        ):  # fmt: skip
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(driver))
        self.driver.set_script_timeout(30)

    def open(self, url: str, page: str = "", theme: str = "default") -> None:
        """Go to a page, by a part of its title, and wait until it is drawn."""
        self.driver.get(f"{url}?theme={theme}")
        self.wait(lambda: self.js("return seen('.frame').length"), 60)
        if page:
            self.tab(page)

    def tab(self, page: str) -> None:
        """Go to another page."""
        self.wait(
            lambda: self.js(
                "const t = seen('.bk-tab').find((e) => e.textContent.includes(arguments[0]));"
                "if (t) t.click(); return !!t",
                page,
            ),
            60,
        )

    def js(self, code: str, *arguments: Any) -> Any:
        """Run JavaScript that knows ``all`` and ``seen`` (they look into shadow roots) and ``named``, a Bokeh model."""
        return self.driver.execute_script(DEEP + code, *arguments)

    def text(self, selector: str) -> str:
        """Of the elements that are seen, a line each."""
        return str(self.js("return seen(arguments[0]).map((e) => e.textContent).join('\\n')", selector))

    def press(self, selector: str, text: str = "") -> None:
        """Click the first element that is seen, with a text in it."""
        self.wait(
            lambda: self.js(
                "const e = seen(arguments[0]).find((e) => e.textContent.includes(arguments[1]) && !e.disabled);"
                "if (e) e.click(); return !!e",
                selector,
                text,
            ),
            30,
        )

    def wait(self, until: Callable[[], Any], seconds: float = 30.0) -> Any:
        """Until something is true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                if found := until():
                    return found
            except Exception as error:
                if "Bokeh is not defined" not in str(error) and "stale" not in str(error):
                    raise
            time.sleep(0.05)
        raise AssertionError(f"not within {seconds} s; the page shows: {self.text('.frame')}")

    def idle(self, seconds: float = 120.0) -> None:
        """Until no fit is going on and there is a model, and none begins within half a second."""
        since = time.monotonic()

        def still() -> bool:
            nonlocal since
            errors = self.text(".errors")
            if not errors or "..." in errors or not self.js("return seen('.bar').length == 0"):
                since = time.monotonic()
            return time.monotonic() - since > 0.5

        self.wait(still, seconds)

    def unseen_error(self) -> float:
        """As the head of the window says."""
        return float(self.text(".errors").split(",")[1].split()[0])

    def redraw(self, name: str, place: float) -> float:
        """Move a slider by one event of a hand; milliseconds until the curves of the cycle were drawn anew."""
        code = """
        const [name, place, done] = arguments
        const slider = all(`.knob[data-name="${name}"] .slider`)[0]
        const data = named('cycle')
        const began = performance.now()
        const heard = () => {
          data.properties.data.change.disconnect(heard)
          window.arrived = performance.now() - began
          requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - began)))
        }
        data.properties.data.change.connect(heard)
        slider.value = place
        slider.dispatchEvent(new Event('input'))
        """
        return float(self.driver.execute_async_script(DEEP + code, name, place))

    def elsewhere(self) -> list[str]:
        """Addresses beyond this machine that were asked for."""
        out = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                url = message["params"]["request"]["url"]
                if not url.startswith(("http://127.0.0.1", "data:", "blob:", "chrome:", "about:", "devtools:")):
                    out.append(url)
        return out

    def complaints(self) -> list[str]:
        """Errors that the browser's console was told."""
        found = self.driver.get_log("browser")
        return [e["message"] for e in found if e["level"] == "SEVERE" and "favicon" not in e["message"]]

    def close(self) -> None:
        """End it."""
        self.driver.quit()
