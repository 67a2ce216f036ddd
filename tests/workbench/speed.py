"""How fast the workbench follows: what docs/workbench tabulates.

``python -m tests.workbench.speed`` opens the shipped campaign, and one of five runs of a million samples that it makes,
in Chromium without a screen, and writes ``docs/results/workbench.json``. It takes some minutes of a machine that does
nothing else.
"""

from __future__ import annotations

import os
import shutil
import statistics
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from tests.kept_results import keep_table

from .browser import DEEP, ROOT, Browser, Served
from .conftest import SCENARIO

SLIDERS = ("weakening.drop", "contact.strength", "weakening.slip_distance", "rig.damping")
MOVES, APART = 10, 0.6  # of each slider, and s between two
SAMPLES = 1_000_000
TICK = 5e-3  # s between two looks at the clock
LONG = tuple(Run(f"v{v:03d}", 1e-6 * v, n) for v, n in ((50, 50), (100, 100), (200, 200), (400, 400), (600, 600)))
MOVE = """
const [name, place, done] = arguments
const slider = all(`.knob[data-name="${name}"] .slider`)[0]
const drawing = CanvasRenderingContext2D.prototype
if (!window.watched) {
  window.watched = true
  for (const k of ['stroke', 'fill', 'fillText', 'fillRect', 'clearRect', 'drawImage']) {
    const own = drawing[k]
    drawing[k] = function (...a) { window.drawn = performance.now(); return own.apply(this, a) }
  }
}
const began = performance.now()
let told = 0
const errors = new MutationObserver(() => { told = performance.now() - began })
errors.observe(seen('.errors')[0], { childList: true, characterData: true, subtree: true })
slider.value = place
slider.dispatchEvent(new Event('input'))
// a model is run freely when it has stood still for a quarter of a second
const look = () => {
  if (!told || performance.now() - began < told + 150) return setTimeout(look, 10)
  errors.disconnect()
  done([window.drawn - began, told])
}
look()
"""
GLIDE = """
const [zoom, done] = arguments
const range = named('signal displacement').x_range
const [a, b] = [range.start, range.end]
const drawing = CanvasRenderingContext2D.prototype
const [stroke, image] = [drawing.stroke, drawing.drawImage]
let calls = 0, before = 0, redraws = 0, frame = 0
drawing.stroke = function (...x) { calls++; return stroke.apply(this, x) }
drawing.drawImage = function (...x) { calls++; return image.apply(this, x) }
const began = performance.now()
const step = () => {
  if (calls > before) redraws++
  before = calls
  frame++
  const half = zoom ? (b - a) * Math.exp(-frame / 30) / 2 : (b - a) * 0.1
  const middle = zoom ? (a + b) / 2 : a + (b - a) * (0.1 + 0.8 * ((frame * 0.004) % 1))
  range.setv({ start: middle - half, end: middle + half })
  if (performance.now() - began < 4000) return requestAnimationFrame(step)
  drawing.stroke = stroke
  drawing.drawImage = image
  range.setv({ start: a, end: b })
  done(redraws / 4)
}
requestAnimationFrame(step)
"""
THERE = "const d = named('data displacement'); return d && d.data.t.length"


def browser() -> Browser:
    """Chromium of this machine."""
    return Browser(str(shutil.which("chromium")), str(shutil.which("chromedriver")), 1280, 1100)


def opened(campaign: Path) -> tuple[Served, Browser, float, float]:
    """A campaign in the browser; seconds from the command, and from the request, to the drawn record."""
    seen = browser()
    served = Served(campaign)
    asked = time.monotonic()
    seen.driver.get(served.url)
    seen.wait(lambda: seen.js(THERE), 200)
    return served, seen, time.monotonic() - served.began, time.monotonic() - asked


def hand(seen: Browser) -> tuple[list[float], list[float]]:
    """Milliseconds from a hand's move to the last drawing command, and to the errors in the head."""
    seen.tab("Model")
    seen.wait(lambda: seen.js("return seen('.knob').length"))
    seen.idle()
    time.sleep(3.0)
    found = []
    for name in SLIDERS:
        seen.redraw(name, 0.5)
        for i in range(MOVES):
            time.sleep(APART)
            found.append(seen.driver.execute_async_script(DEEP + MOVE, name, 0.45 + 0.02 * i))
    return [d for d, _ in found], [t for _, t in found]


def long_campaign(folder: Path) -> Path:
    """Five runs of a million samples: cycles that the challenge's generator simulated, repeated."""
    make_campaign(folder, 11, (), runs=LONG, spring_known=True)
    campaign = ss.load_campaign(folder / "campaign.toml")
    for trace, found in zip(campaign.traces, campaign.events, strict=True):
        assert trace.resolution is not None and trace.drive_velocity is not None
        file = folder / f"{trace.name}.csv"
        head, body = file.read_text().split("\n", 1)
        counts = np.array(body.split(), int)
        first, last = (round(found.events[i].t_arrest * trace.sampling_rate) for i in (2, -1))
        way = round(trace.drive_velocity * (last - first) / trace.sampling_rate / trace.resolution)
        times = -(-(SAMPLES - last) // (last - first))
        whole = np.concatenate([counts[:last], *(counts[first:last] + way * (i + 1) for i in range(times))])
        file.write_text("\n".join([head, *map(str, whole[:SAMPLES].tolist())]) + "\n")
    return folder / "campaign.toml"


def spread(values: list[float], unit: str) -> str:
    """Median, and from where to where nine of ten lie."""
    low, high = np.quantile(values, [0.05, 0.95])
    return f"{statistics.median(values):.0f} {unit} (nine of ten from {low:.0f} to {high:.0f} {unit})"


def forget() -> None:
    """Have the system read the files of this environment and of the program from the disk again, as after a start."""
    for place in (Path(sys.prefix), ROOT / "stickslip"):
        for path in place.rglob("*"):
            if path.is_file() and not path.is_symlink():
                with suppress(OSError), path.open("rb") as file:
                    os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def lateness() -> tuple[float, float, float]:
    """ms by which the server's thread is late while a fit goes on in its process (quantiles 0.9, 0.99); MB of a fit."""
    from cloudpickle import dumps

    fit = ss.load_campaign(SCENARIO / "campaign.toml").fit()
    fit.add("contact-ageing")  # compiled
    late: list[float] = []
    work = threading.Thread(target=lambda: fit.add("contact-ageing"))
    work.start()
    while work.is_alive():
        began = time.monotonic()
        time.sleep(TICK)
        late.append(1e3 * (time.monotonic() - began - TICK))
    return float(np.quantile(late, 0.9)), float(np.quantile(late, 0.99)), len(dumps(fit)) / 1e6


def main() -> None:
    """Measure and write."""
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as name:
        short = Path(shutil.copytree(SCENARIO, Path(name) / "short"))
        forget()
        served, seen, cold, _ = opened(short / "campaign.toml")
        seen.close(), served.end()
        opened_short = []
        for _ in range(3):
            shutil.rmtree(short / ".stickslip-workbench", ignore_errors=True)
            served, seen, since, asked = opened(short / "campaign.toml")
            opened_short.append((since, asked))
            if len(opened_short) == 3:
                drawn, told = hand(seen)
            seen.close(), served.end()
        since, asked = (statistics.median(v) for v in zip(*opened_short, strict=True))
        rows += [
            [
                "first picture of the shipped campaign after the command, files not in memory",
                f"{cold:.1f} s",
                "8 s",
            ],
            ["the same, started again", f"{since:.1f} s", "3 s"],
            ["of this, after the request of the browser", f"{asked:.1f} s", ""],
            ["errors after a slider is moved", spread(told, "ms"), "100 ms"],
            ["all curves after it, except the free simulation", spread(drawn, "ms"), "100 ms"],
        ]
        served, seen, since, asked = opened(long_campaign(Path(name) / "long"))
        rows += [["first picture of five runs of a million samples after the command", f"{since:.1f} s", ""]]
        for zoom, words in ((False, "panning of"), (True, "zooming into")):
            redraws = seen.driver.execute_async_script(DEEP + GLIDE, zoom)
            rows += [[f"redraws per second during {words} such a run", f"{redraws:.0f}", "30"]]
            time.sleep(2.0)
        seen.close(), served.end()
    busy = os.getloadavg()[1]
    most, rare, size = lateness()
    told_late = f"up to {most:.0f} ms in 90 % of the cases, {rare:.0f} ms in 99 %"
    rows += [
        ["delay of the server during a fit in its process", told_late, ""],
        ["size of a fit, if it were sent to another process", f"{size:.0f} MB", ""],
        [
            f"load of the {os.cpu_count()} processors meanwhile, this script included",
            f"{busy:.0f}",
            "",
        ],
    ]
    machine = f"{os.cpu_count()} processors, Chromium without a screen and without a graphics card"
    keep_table(
        "workbench", "python -m tests.workbench.speed", None, ["what", "measured", "target"], rows, machine=machine
    )


if __name__ == "__main__":
    main()
