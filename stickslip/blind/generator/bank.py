"""The springs of all contacts as flat arrays, with a pool of fresh lines for the events to come."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .lines import Array, Surface, group, press, rough_line


@dataclass(frozen=True)
class Bank:
    """Contact springs, one row of the pool per set of lines.

    Attributes:
        normal: normal force of each element, shape (pool, elements), N; zero where padded.
        stiffness: its tangential stiffness, shape (pool, elements), N/m.
        start: first element of each contact and the end, shape (contacts + 1,).
        count: elements in use, shape (pool, contacts).
    """

    normal: Array
    stiffness: Array
    start: Array
    count: Array

    @property
    def contacts(self) -> int:
        return self.start.size - 1


def make_bank(
    surface: Surface,
    loads: Array,
    seed: int | list[int],
    *,
    pool: int = 1,
    groups: int | None = 128,
    roughness_spread: Array | None = None,
) -> Bank:
    """Draw ``pool`` sets of rough lines and press each contact to its load.

    Args:
        surface: statistics of the lines and elastic constants.
        loads: normal force of each contact, N.
        seed: of the lines.
        pool: how many sets, of which the next one comes after every slip on new lines.
        groups: elements per contact, or None for every spring.
        roughness_spread: factor on h_rms of each contact (unequal contacts).
    """
    rng = np.random.default_rng(seed)
    factor = np.ones(len(loads)) if roughness_spread is None else roughness_spread
    rows: list[list[tuple[Array, Array]]] = []
    for _ in range(pool):
        row = []
        for load, rough in zip(loads, factor, strict=True):
            own = replace(surface, h_rms=surface.h_rms * rough)
            normal = press(own, rough_line(own, rng), float(load))
            single = own.tangential_spring
            row.append((normal, np.full(normal.size, single)) if groups is None else group(normal, single, groups))
        rows.append(row)
    return join(rows)


def join(rows: list[list[tuple[Array, Array]]]) -> Bank:
    """A bank from (normal force, stiffness) of each contact in each row, padded to equal length."""
    contacts = len(rows[0])
    width = [max(row[j][0].size for row in rows) for j in range(contacts)]
    start = np.concatenate([[0], np.cumsum(width)]).astype(np.int64)
    normal = np.zeros((len(rows), start[-1]))
    stiffness = np.zeros_like(normal)
    count = np.zeros((len(rows), contacts), dtype=np.int64)
    for i, row in enumerate(rows):
        for j, (force, spring) in enumerate(row):
            stop = start[j] + force.size
            normal[i, start[j] : stop], stiffness[i, start[j] : stop] = force, spring
            count[i, j] = force.size
    return Bank(normal, stiffness, start, count)
