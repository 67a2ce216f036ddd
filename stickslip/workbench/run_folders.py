"""Run folders beside a campaign: what lies there, and a result saved among them."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Any

from ..errors import InputError, RunFolderError
from ..objects.campaign import Campaign
from ..objects.diagnosis import Diagnosis
from ..objects.fit import Fit
from ..show.report.html import REPORT
from ..system.runstore import RESULT, read_result
from ..system.units import shown_with
from .file_names import new_folder

MOST = 100  # run folders that are listed
LARGEST = 64 << 20  # bytes of a report that is shown
PICTURES_DEEP = 2  # folders of a run folder in which pictures are looked for
MOST_PICTURES, LARGEST_PICTURE = 24, 8 << 20  # of them, and bytes of one, that are shown
STYLE = "body { font: 15px sans-serif; margin: 16px } img { max-width: 100%; display: block; margin: 8px 0 24px }"
DEEP = 2  # folders below the campaign's in which run folders are looked for


@dataclass(frozen=True)
class RunFolder:
    """A run folder.

    Attributes:
        name: relative to the campaign's folder.
        folder: where it lies.
        kind: fit, diagnose, inspect, ...
        words: verdict or error.
        when: it was written.
        report: whether it has one, or pictures.
    """

    name: str
    folder: Path
    kind: str
    words: str
    when: str
    report: bool


def listed(folder: Path) -> list[RunFolder]:
    """Run folders in a folder and in those in it, the newest first; what leads elsewhere or is damaged is left out."""
    home = folder.resolve()
    paths = [p for deep in range(1, DEEP + 1) for p in folder.glob("/".join(["*"] * deep + [RESULT]))]
    found = []
    for path in paths:
        own = path.parent
        if (own.parent / RESULT).is_file():  # a part of what is listed
            continue
        hidden = any(part.startswith(".") for part in own.relative_to(folder).parts)
        if hidden or not path.resolve().is_relative_to(home):
            continue
        try:
            result, written = read_result(own), path.stat().st_mtime
        except (RunFolderError, OSError):
            continue
        when = datetime.fromtimestamp(written).strftime("%Y-%m-%d %H:%M")
        report = any(p.resolve().is_relative_to(home) for p in (own / REPORT, *pictures(own)) if p.is_file())
        name = own.relative_to(folder).as_posix()
        found.append((written, RunFolder(name, own, str(result.get("kind", "")), words(result), when, report)))
    return [kept for _, kept in sorted(found, key=lambda pair: -pair[0])[:MOST]]


def words(result: dict[str, Any]) -> str:
    """The verdict or the errors of a result, on a line."""
    try:
        verdict = result.get("verdict")
        if isinstance(verdict, dict):
            of = ", ".join(map(str, verdict.get("effects") or verdict.get("set") or ()))
            return f"{verdict.get('kind')}{': ' + of if of else ''}{_errors(result)}"
        if result.get("ladder"):
            return f"{' + '.join(map(str, result.get('model_parts', ())))}{_errors(result)}"
        return str(verdict or result.get("title") or "")
    except (TypeError, AttributeError, KeyError, ValueError):
        return "of another form"


def _errors(result: dict[str, Any]) -> str:
    rung = (result.get("ladder") or [{}])[-1]
    texts = [
        f"{name} {shown_with(rung[key], rung.get(f'{key}_std') or 0.0)}"
        for name, key in (("error", "train_error"), ("on unseen runs", "heldout_error"))
        if rung.get(key) is not None
    ]
    return f": {', '.join(texts)}" if texts else ""


def save(
    found: Fit | Diagnosis, campaign: Campaign, name: str, tell: Callable[[str, float], None] | None = None,
    history: dict[str, Any] | None = None,
) -> Path:  # fmt: skip
    """Keep a fit or a diagnosis as a run folder beside the campaign, as the command does.

    Args:
        found: what to keep.
        campaign: with a file.
        name: of the folder.
        tell: told the progress.
        history: how a model was come to, for its ``result.json``.

    Raises:
        InputError: the name cannot be used or is there already; the campaign has no folder; it cannot be written.
    """
    folder = new_folder(campaign, name, "name of the run folder")
    if isinstance(found, Diagnosis) and found.folder is not None:
        return _copied(found.folder, folder)
    if isinstance(found, Fit):
        found.confirm(tell)
        more: dict[str, Any] = {"history": history} if history else {}
        return found.save(folder, **more)
    return found.save(folder)


def _copied(folder: Path, to: Path) -> Path:
    """A run folder once more, under another name; nothing half-written is left."""
    aside = to.with_name(f".{to.name}.writing")
    shutil.rmtree(aside, ignore_errors=True)
    try:
        shutil.copytree(folder, aside)
        aside.rename(to)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return to


def report(kept: RunFolder) -> str:
    """The report of a run folder, or a page of its pictures where it has none.

    Raises:
        InputError: it has neither, or one that is too large to be shown.
    """
    path = kept.folder / REPORT
    if kept.report and not path.is_file():
        return _pictured(kept.folder, kept.name, kept.words)
    if not kept.report:
        raise InputError("this run folder has no report", value=kept.name)
    if path.stat().st_size > LARGEST:
        raise InputError("the report is too large to be shown here", value=kept.name, hint=f"open {REPORT} itself")
    return path.read_text(encoding="utf-8", errors="replace")


def pictures(folder: Path) -> list[Path]:
    """Pictures in a run folder, and in the run folders within it; none that lies elsewhere."""
    found = [p for deep in range(PICTURES_DEEP) for p in sorted(folder.glob("/".join(["*"] * deep + ["*.png"])))]
    home = folder.resolve()
    return [p for p in found if p.is_file() and p.resolve().is_relative_to(home)][:MOST_PICTURES]


def _pictured(folder: Path, name: str, words: str) -> str:
    """A page that holds them."""
    parts = [f"<h1>{escape(name)}</h1><p>{escape(words)}</p>"]
    for path in pictures(folder):
        if path.stat().st_size <= LARGEST_PICTURE:
            data = base64.b64encode(path.read_bytes()).decode()
            title = escape(path.relative_to(folder).as_posix())
            parts.append(f'<h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{data}">')
    head = f"<meta charset='utf-8'><style>{STYLE}</style>"
    return f"<!doctype html><html><head>{head}</head><body>{''.join(parts)}</body></html>"
