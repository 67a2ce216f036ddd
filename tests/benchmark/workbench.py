"""How fast a long campaign is drawn in the workbench, in a real browser before a real server.

Redraws are counted while a hand pans and zooms at every frame of the screen; the figures of the signals follow.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from ..workbench.browser import DEEP, Browser, Served
from ..workbench.conftest import SCENARIO
from .measuring import head, keep, last_table, row

RUNS = 5
RATE = 1e4  # Hz
SECONDS = 4.0  # that a hand moves
HAND = """
const [seconds, zoom, done] = arguments
const range = named('signal displacement').x_range
const span = range.bounds[1] - range.bounds[0]
const data = named('data displacement')
let frames = 0, sent = 0
const heard = () => { sent += 1 }
data.properties.data.change.connect(heard)
const began = performance.now()
const step = () => {
  const share = (performance.now() - began) / (1e3 * seconds)
  if (share >= 1) {
    data.properties.data.change.disconnect(heard)
    return done({ frames, sent, seconds: (performance.now() - began) / 1e3 })
  }
  const width = zoom ? span * Math.pow(1e-3, Math.abs(Math.sin(Math.PI * share))) : 0.02 * span
  const middle = range.bounds[0] + span * (zoom ? 0.5 : 0.1 + 0.8 * share)
  range.setv({ start: middle - 0.5 * width, end: middle + 0.5 * width })
  frames += 1
  requestAnimationFrame(step)
}
requestAnimationFrame(step)
"""


def campaign(folder: Path, samples: int) -> Path:
    """Five runs whose cycles are those of the shipped run at 100 um/s, again and again."""
    counts = np.loadtxt(SCENARIO / "v100.csv", skiprows=1, comments="#")
    cycle = slice(counts.size // 4, -counts.size // 4)
    one = counts[cycle] - counts[cycle.start]
    rise = one[-1] + 1.0
    repeated = np.concatenate([one + rise * k for k in range(samples // one.size + 1)])[:samples]
    # the block goes on as the drive does, so that their difference stays in bounds
    speed = 7.91e-9 * (repeated[-1] - repeated[0]) / (samples / RATE)
    head = (SCENARIO / "campaign.toml").read_text(encoding="utf-8").split("[[trace]]")[0]
    rng = np.random.default_rng(1)
    for run in range(RUNS):
        noisy = np.round(repeated + rng.normal(0.0, 1.0, samples)).astype(int)
        (folder / f"long{run + 1}.csv").write_text("counts\n" + "\n".join(map(str, noisy.tolist())) + "\n")
        head += (
            f'[[trace]]\nfile = "long{run + 1}.csv"\nsampling_rate = "{RATE:g} Hz"\n'
            'displacement = { column = "counts", unit = "7.91 nm", resolution = "7.91 nm" }\n'
            f'drive_velocity = "{1e6 * speed:.8g} um/s"\n\n'
        )
    path = folder / "campaign.toml"
    path.write_text(head, encoding="utf-8")
    return path


def painted(browser: Browser, url: str) -> float:
    """Seconds from asking for the page until the signals are drawn."""
    began = time.monotonic()
    browser.open(url, "Data")
    browser.wait(lambda: browser.js("const d = named('data displacement'); return d && d.data.t.length"), 120)
    return time.monotonic() - began


def report(small: bool = False) -> None:
    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if binary is None or driver is None:
        print("\nworkbench: not measured, for there is no Chromium with its driver")
        return
    samples = 20_000 if small else 1_000_000
    head(f"workbench, {RUNS} runs of {samples} samples", "first start", "second start")
    started, drawn, moved = [], [], {}
    with tempfile.TemporaryDirectory() as home:
        path = campaign(Path(home), samples)
        for last in (False, True):
            served = Served(path)
            browser = Browser(binary, driver, height=1800)
            try:
                started.append(f"{served.started:.1f} s")
                drawn.append(f"{painted(browser, served.url):.1f} s")
                for name, zoom in (("pan", False), ("zoom", True)) if last else ():
                    moved[name] = browser.driver.execute_async_script(DEEP + HAND, SECONDS, zoom)
            finally:
                browser.close()
                served.end()
    row("address printed after", *started)
    row("signals drawn after, in the browser", *drawn)
    for name, found in moved.items():
        row(f"redraws a second, {name}", "", f"{found['frames'] / found['seconds']:.0f}")
        row(f"parts sent anew a second, {name}", "", f"{found['sent'] / found['seconds']:.1f}")
    if not small:
        keep("workbench", "workbench", **last_table())
