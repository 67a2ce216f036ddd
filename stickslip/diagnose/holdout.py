"""Which cycles no fit may see: one whole velocity and the later part of the run with holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError, nearest
from ..features.measurement import Measurement


def training_cycles(measurement: Measurement, holdout: Sequence[str] = (), keep: Sequence[str] = ()) -> np.ndarray:
    """Cycles a fit may use, shape (R, n).

    By default the run of the middle velocity is held out if there are three or more velocities, and the later half of
    every run with holds; where neither applies, the last third of every run.

    Args:
        measurement: the data.
        holdout: names of runs to hold out instead.
        keep: names of runs that the choice by default leaves to be fitted.

    Raises:
        InputError: no such run, every run is held out, or nothing is.
    """
    m = measurement
    used = np.asarray(m.cycles.used)
    train = used.copy()
    if holdout:
        for name in holdout:
            found = [n for n in m.names if n == name or n == name.rsplit(".", 1)[0]]
            if not found:
                raise InputError(
                    "no run of this name to hold out", key="--holdout", value=name, hint=nearest(name, m.names)
                )
            train[m.names.index(found[0])] = False
        if not train.any():
            raise InputError("every run is held out", key="--holdout, role", hint="leave runs to fit")
        return train
    holds = m.valid[..., m.layout.slices()["hold"]].any(axis=(1, 2))
    open_to = np.array([name not in keep for name in m.names])
    steady = np.flatnonzero(~holds)
    speeds = np.unique(np.round(m.velocities[steady], 12))
    if speeds.size >= 3:
        middle = steady[np.argsort(m.velocities[steady])[steady.size // 2]]
        train[middle] &= not open_to[middle]
    for r in np.flatnonzero(holds & open_to).tolist():
        at = np.flatnonzero(m.valid[r][:, m.layout.slices()["hold"]].any(axis=1))
        # up to the hold that begins the later half of them
        cut = int(at[(at.size + 1) // 2]) if at.size > 1 else int(used[r].sum() * 0.6)
        train[r, max(cut, 3) :] = False
    if (train == used).all():
        for r in np.flatnonzero(open_to).tolist():
            n = int(used[r].sum())
            train[r, max(n - max(n // 3, 1), 1) :] = False
    if (train == used).all():
        raise InputError(
            "no cycle is left that no fit sees, and without one no effect can be named",
            key="role",
            hint='leave role = "train" out of some runs, name one with --holdout, or record more slips',
        )
    return train
