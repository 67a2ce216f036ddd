"""The pictures of a run folder that has no report, such as one of a simulation, as a page."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path

DEEP = 2  # folders in which pictures are looked for
MOST, LARGEST = 24, 8 << 20  # of them, and bytes of one, that are shown
STYLE = "body { font: 15px sans-serif; margin: 16px } img { max-width: 100%; display: block; margin: 8px 0 24px }"


def of(folder: Path) -> list[Path]:
    """Pictures in a run folder, and in the run folders within it; none that lies elsewhere."""
    found = [p for deep in range(DEEP) for p in sorted(folder.glob("/".join(["*"] * deep + ["*.png"])))]
    home = folder.resolve()
    return [p for p in found if p.is_file() and p.resolve().is_relative_to(home)][:MOST]


def page(folder: Path, name: str, words: str) -> str:
    """A page that holds them."""
    parts = [f"<h1>{escape(name)}</h1><p>{escape(words)}</p>"]
    for path in of(folder):
        if path.stat().st_size <= LARGEST:
            data = base64.b64encode(path.read_bytes()).decode()
            title = escape(path.relative_to(folder).as_posix())
            parts.append(f'<h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{data}">')
    head = f"<meta charset='utf-8'><style>{STYLE}</style>"
    return f"<!doctype html><html><head>{head}</head><body>{''.join(parts)}</body></html>"
