"""The best effects of a round once more: each fitted by itself, and then all compared on the same points.

A few points that lie far off and are left in hold all parameters where they are least far off, and which these are only
a model can say that has the effect. So each effect finds outliers of its own, and then all leave out those of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...errors import StickslipError
from ..force.candidates import Candidate
from ..force.fit import Fit, fit
from ..force.profile_deviations import widened
from ..force.scatter import Scatter
from .checkpoints import Store, kept, name_of
from .decide import CHANCE, DISPERSION, Judged, best_forms

MOST = 4  # of a round
HALF = 0.5  # of what the best one gains


def finalists(judged: Sequence[Judged]) -> list[Judged]:
    """Effects that explain at least half of what the best one does, each in its best form, at most :data:`MOST`."""
    beyond = sorted((j for j in best_forms(judged) if j.chance < CHANCE), key=lambda j: -j.gain)
    return [j for j in beyond if j.gain > HALF * beyond[0].gain][:MOST]


@dataclass(frozen=True)
class Finals:
    """Effects on the same points.

    Attributes:
        base: the model that they are added to.
        ends: the effects; without those that could not be fitted.
        dropped: points left out, shape (p,).
    """

    base: Fit
    ends: tuple[Candidate, ...]
    dropped: NDArray[np.bool_]

    @classmethod
    def of(cls, base: Fit, candidates: Sequence[Candidate], store: Store | None, name: str) -> Finals:
        """Settle them.

        Args:
            base: the model that they are added to.
            candidates: with their fits.
            store, name: keeps what is finished, under this name.
        """
        settled = []
        for c in candidates:
            with suppress(StickslipError):
                settled.append((c, alone(base, c, store, name)))
        dropped = np.any([base.dropped, *(own.dropped for _, own in settled)], axis=0)

        def common(own: Fit, key: str) -> Fit:
            return kept(store, f"{name}-common-{key}", own.problem, partial(_on, own, dropped))

        ends = tuple(replace(c, fit=common(own, name_of(c.tag, c.form))) for c, own in settled)
        return cls(common(base, "base"), ends, dropped)

    def on_the_same(self, other: Fit) -> Fit:
        """Another model on the same points."""
        return _on(other, self.dropped)


def _on(found: Fit, dropped: NDArray[np.bool_]) -> Fit:
    return fit(found.problem, found.point, found.scatter, dropped=dropped, first=True)


def alone(base: Fit, candidate: Candidate, store: Store | None, name: str) -> Fit:
    """An effect fitted as the base was, with outliers of its own; events may not differ more than in the base."""
    found = candidate.fit
    assert found is not None
    key = f"{name}-alone-{name_of(candidate.tag, candidate.form)}"
    return kept(
        store, key, found.problem, lambda: fit(found.problem, found.point, Scatter.wide().within(base.scatter))
    )  # fmt: skip


def settled(base: Fit, candidate: Candidate, store: Store | None = None, name: str = "round") -> Fit:
    """The model with an effect, fitted as the base was, and the deviations of its effects' amplitudes.

    What lies far off is found anew too: outliers of a model that lacks an effect are others than those of one that has
    it.
    """
    found = candidate.fit
    assert found is not None
    key = f"{name}-settled-{name_of(candidate.tag, candidate.form)}"
    amplitudes = [f.name for f in found.free if f.amplitude]
    return kept(
        store, key, found.problem,
        lambda: widened(alone(base, candidate, store, name), amplitudes, DISPERSION),
    )  # fmt: skip
