"""From ``pip install`` to the first fall of the error: what docs/workbench.md says it takes.

``python -m tests.workbench.minutes`` installs this version with the workbench from its wheel into an environment of its
own (packages from the index that pip is set to, or from pip's cache), with nothing compiled kept from before, opens the
shipped campaign in Chromium without a screen, and switches on the effect that promises most. It writes
``docs/results/workbench_minutes.json``.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

from tests.kept_results import keep_table

from .browser import ROOT, Browser, Served
from .speed import browser as chromium

AIM = 180.0  # s


def bare() -> dict[str, str]:
    """The surroundings without what leads to this folder or to what was compiled before."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "JAX_COMPILATION_CACHE_DIR")}


class Installed(Served):
    """The server of the installed program, in an empty folder and with an empty cache."""

    def __init__(self, python: Path, folder: Path) -> None:
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [str(python), "-m", "stickslip", "open", "--no-browser"], stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, cwd=folder,
            env={**bare(), "HOME": str(folder), "XDG_CACHE_HOME": str(folder / "cache")},
        )  # fmt: skip
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert "http://127.0.0.1:" in line, line + self.process.stdout.read()
        self.url = line.split()[-1]


def measured(seen: Browser, python: Path, folder: Path) -> list[tuple[str, float]]:
    """What was done, and the seconds that it took."""
    out: list[tuple[str, float]] = []
    began = time.monotonic()

    def done(what: str) -> None:
        nonlocal began
        out.append((what, time.monotonic() - began))
        began = time.monotonic()

    served = Installed(python, folder)
    try:
        seen.driver.get(served.url)
        seen.wait(lambda: "Open the shipped example" in seen.text("button"), 120)
        done("page with the shipped campaign")
        seen.press("button", "Open the shipped example")
        seen.idle(200)
        done("fit of the base model")
        base = seen.unseen_error()
        seen.tab("missing")
        seen.wait(
            lambda: seen.js("return seen('.line').some((e) => e.textContent.startsWith('ordered by expected fall'))"),
            300,
        )
        done("expected gain of every effect")
        seen.press(".effect-row button", "Switch on")
        seen.wait(lambda: "contact-ageing" in seen.text(".model"), 200)
        seen.idle(200)
        done("fit of the effect with the largest expected gain")
        assert seen.unseen_error() < 0.9 * base, (base, seen.unseen_error())
    finally:
        served.end()
    return out


def main() -> None:
    """Install, measure, write."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = shutil.copytree(ROOT, folder / "source", ignore=shutil.ignore_patterns(".*", "docs", "tests", "out"))
        wheel = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder / "wheel"), str(source)]
        subprocess.run(wheel, check=True, cwd=folder)
        made = next((folder / "wheel").glob("*.whl"))
        began = time.monotonic()
        venv.create(folder / "own", with_pip=True)
        python = folder / "own" / "bin" / "python"
        asked = [f"{made}[workbench]", "-c", str(ROOT / "constraints.txt")]
        subprocess.run([str(python), "-m", "pip", "install", "-q", *asked], check=True, env=bare(), cwd=folder)
        stages = [("installation", time.monotonic() - began)]
        (folder / "empty").mkdir()
        seen = chromium()
        try:
            stages += measured(seen, python, folder / "empty")
        finally:
            seen.close()
    whole = sum(seconds for _, seconds in stages)
    rows = [[what, f"{seconds:.0f} s", ""] for what, seconds in stages]
    rows.append(["from pip install to the first fall of the error", f"{whole:.0f} s", f"{AIM:.0f} s"])
    columns, machine = ["what", "measured", "target"], f"{os.cpu_count()} processors"
    keep_table("workbench_minutes", "python -m tests.workbench.minutes", None, columns, rows, machine=machine)


if __name__ == "__main__":
    main()
