"""Cases of a long campaign, each kept in a file when it is finished, so that the same command goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any


def each(folder: Path, names: Iterable[str], one: Callable[[str], dict[str, Any]]) -> Iterator[tuple[str, Any]]:
    """Name and answer of every case, in order; made by ``one`` where the folder does not hold it yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        path = folder / f"{name}.json"
        if not path.is_file():
            aside = path.with_suffix(".part")
            aside.write_text(json.dumps(one(name)), encoding="utf-8")
            aside.replace(path)
        yield name, json.loads(path.read_text(encoding="utf-8"))
