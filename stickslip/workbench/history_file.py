"""The history of a workbench in a folder beside the campaign, so that a server that is started again is where it was.

The folder ``.stickslip-workbench`` holds ``NAME-DIGEST.json`` (the steps, with the data they belong to), the numbers of
their models as plain arrays, and what the last diagnosis found. The digest is of the data: with another file or run in
the campaign a history of its own begins. Nothing in the folder is ever run as code.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..objects.campaign import Campaign
from ..objects.result_base import write_arrays
from ..system.runstore import digests, json_text, read_result, write_aside

if TYPE_CHECKING:
    from ..inference.force.fit import Fit as ForceFit
    from ..objects.diagnosis import Diagnosis
    from ..objects.fit import Fit
    from ..objects.stored_fit import Arrays

FOLDER = ".stickslip-workbench"
SCHEMA = 1


class HistoryFile:
    """Where the history of one campaign file is kept.

    Args:
        campaign: with a file.
    """

    def __init__(self, campaign: Campaign) -> None:
        path = campaign.description.path
        self.campaign = campaign
        self.folder = path.parent / FOLDER
        own = hashlib.sha256(" ".join(digests(campaign.inputs())).encode()).hexdigest()[:8]
        self.file = self.folder / f"{path.stem}-{own}.json"
        self.diagnosis = self.folder / f"{path.stem}-{own}-diagnosis"
        self._names: dict[int, tuple[ForceFit, str]] = {}
        self._packed: dict[int, tuple[Fit, dict[str, Any]]] = {}

    def write(self, steps: list[dict[str, Any]], fits: list[Fit], more: Mapping[str, Any]) -> None:
        """Keep the history.

        Raises:
            OSError: nothing can be written there.
        """
        self.folder.mkdir(exist_ok=True)
        rows = [{**step, "fit": self._of(fit)} for step, fit in zip(steps, fits, strict=True)]
        self._packed = {id(fit): self._packed[id(fit)] for fit in fits}
        write_aside(
            self.file, json_text({"schema": SCHEMA, "inputs": digests(self.campaign.inputs()), "steps": rows, **more})
        )
        self._clean({name for row in rows for name in _named(row["fit"])})

    def read(self) -> tuple[list[dict[str, Any]], list[Fit], dict[str, Any]]:
        """The history of the same data: steps, their fits, what else was kept; empty where there is none.

        Raises:
            OSError, KeyError, ValueError, TypeError, StickslipError: it is damaged, or its effects are gone.
        """
        from ..objects.stored_fit import unpacked

        if not self.file.is_file():
            return [], [], {}
        kept = json.loads(self.file.read_text(encoding="utf-8"))
        if kept.get("schema") != SCHEMA or kept.get("inputs") != digests(self.campaign.inputs()):
            return [], [], {}
        steps, fits = [], []
        for row in kept.pop("steps"):
            fits.append(unpacked(self.campaign, row["fit"], self._load))
            self._packed[id(fits[-1])] = (fits[-1], row.pop("fit"))
            steps.append(row)
        return steps, fits, kept

    def diagnosed(self) -> Diagnosis | None:
        """What the last diagnosis of the same data found, if it was finished."""
        from ..objects.diagnosis import Diagnosis

        if not (self.diagnosis / "result.json").is_file():
            return None
        result = read_result(self.diagnosis)
        same = digests(result.get("inputs", ())) == digests(self.campaign.inputs())
        return Diagnosis(self.campaign, None, dict(result), {}, self.diagnosis) if same else None

    def _of(self, fit: Fit) -> dict[str, Any]:
        from ..objects.stored_fit import packed

        if id(fit) not in self._packed:
            self._packed[id(fit)] = (fit, packed(fit, self._keep))
        return self._packed[id(fit)][1]

    def _keep(self, found: ForceFit, arrays: Arrays) -> str:
        if id(found) in self._names:
            return self._names[id(found)][1]
        digest = hashlib.sha256()
        for key, array in sorted(arrays.items()):
            digest.update(key.encode() + np.ascontiguousarray(array).tobytes())
        name = digest.hexdigest()[:20]
        if not self._path(name).is_file():
            write_arrays(self._path(name), arrays)
        self._names[id(found)] = (found, name)
        return name

    def _load(self, name: str) -> Arrays:
        if not name.isalnum():
            raise ValueError(f"no name of a model: {name!r}")
        try:
            with np.load(self._path(name), allow_pickle=False) as file:
                return dict(file)
        except (EOFError, zipfile.BadZipFile) as error:
            raise ValueError(str(error)) from None

    def _path(self, name: str) -> Path:
        return self.folder / f"{self.file.stem}-{name}.npz"

    def _clean(self, used: set[str]) -> None:
        """Remove the models of steps that were forgotten."""
        for path in self.folder.glob(f"{self.file.stem}-*.npz"):
            name = path.stem.removeprefix(f"{self.file.stem}-")
            if name.isalnum() and len(name) == 20 and name not in used:
                path.unlink(missing_ok=True)
        self._names = {key: value for key, value in self._names.items() if value[1] in used}


def _named(row: Mapping[str, Any]) -> list[str]:
    return [r["arrays"] for r in row["rungs"]] + ([row["moved"]] if row["moved"] else [])
