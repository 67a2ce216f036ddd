"""What the pages say and how they are laid out, as lines: what a picture of them must show to be of this version.

Numbers are left out, and so is all that depends on how the pages are made.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import panel as pn

from stickslip.workbench import app, figures
from stickslip.workbench.page_parts import Sentences, Table
from stickslip.workbench.session import Session
from stickslip.workbench.widgets import Knobs, Signs, Words

OUTLINE = Path(__file__).parents[2] / "docs" / "images" / "workbench.txt"
STYLES = Path(figures.__file__).parent / "static"


def outline(session: Session) -> str:
    """Of the pages of a session with a model, and of their colours and style sheets."""
    session.list_promises = lambda: None  # nothing is begun beside
    lines = []
    for name, title in app.TITLES.items():
        lines.append(f"[{title}]")
        lines += [
            re.sub(r"\d[\d.]*", "#", text) for part in app.module(name).page(session).select() for text in _said(part)
        ]
    lines += ["[looks]", *(f"{name}: {colour}" for name, colour in asdict(figures.LIGHT).items())]
    lines += [f"{p.name}: {hashlib.sha256(p.read_bytes()).hexdigest()[:12]}" for p in sorted(STYLES.glob("*.css"))]
    return "\n".join(lines) + "\n"


def _said(part: Any) -> Iterator[str]:
    if isinstance(part, pn.pane.Bokeh) and part.object.visible:
        made = part.object
        axes = (str(axis.axis_label or "") for axis in made.axis)
        curves = (str(item.label.value) for legend in made.legend for item in legend.items)
        yield " | ".join(["figure", made.title.text, *axes, *curves])
    elif isinstance(part, pn.widgets.Widget):
        keys = ["name", "placeholder", "description"]
        if not isinstance(part, pn.widgets.MultiChoice):  # which lists the effects there are
            keys.append("options")
        shown = (getattr(part, key, "") for key in keys)
        yield " | ".join([type(part).__name__, *(str(each or "") for each in shown)])
    elif isinstance(part, Table):
        yield " | ".join(["table", *part.columns])
    elif isinstance(part, Sentences):
        yield " | ".join(["head", *(group["head"] for group in part.groups)])
    elif isinstance(part, Knobs):
        yield " | ".join(["sliders", *(row["label"] for row in part.rows)])
    elif isinstance(part, Signs):
        yield " | ".join(["signs", *(row["text"] for row in part.rows)])
    elif isinstance(part, Words) and part.text:
        yield f"words | {part.text}"
