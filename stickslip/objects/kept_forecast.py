"""Finished parts of a forecast in its run folder, as plain arrays, from which an interrupted one goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ..errors import InputError
from ..inference.forecast.predict import Compared
from ..inference.forecast.rolling import Rolled
from ..inference.forecast.wander import Component, Wander
from .checkpoints import FinishedParts

Arrays = Mapping[str, np.ndarray]


class Kept:
    """What was found before, or is made and kept.

    Args:
        pieces: of the run folder; None: nothing is kept.
    """

    def __init__(self, pieces: FinishedParts | None = None) -> None:
        self._pieces = pieces

    def law(self, components: Sequence[Component], make: Callable[[], Compared]) -> Compared:
        """A fitted law of these components."""
        key = "-".join(["law", *(f"{c.kernel}-{c.coordinate}" for c in components)]).replace("/", "").replace(" ", "-")
        return self._part(key, make, _law_arrays, _law)

    def choice(self, laws: Sequence[Compared], make: Callable[[], tuple[Wander, bool]]) -> tuple[Wander, bool]:
        """One of the laws, and whether the rise of late is used."""

        def packed(found: tuple[Wander, bool]) -> Arrays:
            return {"number": np.array([c.law is found[0] for c in laws].index(True)), "rise": np.array(found[1])}

        def unpacked(piece: Arrays) -> tuple[Wander, bool]:
            return laws[int(piece["number"])].law, bool(piece["rise"])

        return self._part("choice", make, packed, unpacked)

    def rolled(self, key: str, make: Callable[[], Rolled]) -> Rolled | InputError:
        """Forecasts along the later part; why there are none."""

        def made() -> Rolled | InputError:
            try:
                return make()
            except InputError as error:
                return error

        return self._part(key, made, _rolled_arrays, _rolled)

    def _part(
        self, key: str, make: Callable[[], Any], packed: Callable[[Any], Arrays | None],
        unpacked: Callable[[Arrays], Any],
    ) -> Any:  # fmt: skip
        piece = None if self._pieces is None else self._pieces.load(key)
        if piece is not None:
            return unpacked(piece)
        found = make()
        if self._pieces is not None and (piece := packed(found)) is not None:
            self._pieces.save(key, piece)
        return found


def _law_arrays(found: Compared) -> Arrays:
    return {"law": np.array(json.dumps(asdict(found.law))), "unseen": found.unseen}


def _law(piece: Arrays) -> Compared:
    plain = json.loads(str(piece["law"]))
    parts = tuple(Component(**{**c, "size": tuple(c["size"])}) for c in plain["components"])
    law = Wander(parts, tuple(plain["scatter"]), tuple(plain["std"]), plain["log_likelihood"], plain["aic"])
    return Compared(law, piece["unseen"])


def _rolled_arrays(found: Rolled | InputError) -> Arrays | None:
    if isinstance(found, InputError):
        return None
    out = {"sample": found.sample, "slip": found.slip, "truth": found.truth, "names": np.array(list(found.members))}
    for n, members in enumerate(found.members.values()):
        out[f"size {n}"] = np.array([m.size for m in members])
        out[f"members {n}"] = np.concatenate(members)
    return out


def _rolled(piece: Arrays) -> Rolled:
    members = {
        str(name): np.split(piece[f"members {n}"], np.cumsum(piece[f"size {n}"])[:-1])
        for n, name in enumerate(piece["names"])
    }
    return Rolled(piece["sample"], piece["slip"], piece["truth"], members)
