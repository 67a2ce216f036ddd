"""A curve drawn with characters, for terminals."""

from __future__ import annotations

import sys

import numpy as np

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a braille character, by row and column


def sketch(
    t: np.ndarray,
    y: np.ndarray,
    *,
    columns: int = 60,
    rows: int = 4,
    limits: tuple[float, float] | None = None,
    encoding: str | None = None,
) -> list[str]:
    """Lines of text that show y over t, from its least to its greatest value or between other ``limits``.

    Braille characters (two by four dots) where the encoding has them (default: that of standard output), else ``:``.
    """
    wide, high = 2 * columns, 4 * rows
    low, top = limits or (float(np.min(y)), float(np.max(y)))
    span = top - low or 1.0
    column = np.clip(((t - t[0]) / ((t[-1] - t[0]) or 1.0) * wide).astype(int), 0, wide - 1)
    level = np.clip(((y - low) / span * high).astype(int), 0, high - 1)
    raster = np.zeros((high, wide), bool)
    # neighbouring samples are joined, so that steep parts show
    for a, b, i, j in zip(level[:-1], level[1:], column[:-1], column[1:], strict=True):
        steps = max(abs(int(b) - int(a)), int(j) - int(i), 1)
        part = np.linspace(0.0, 1.0, steps + 1)
        raster[np.round(a + part * (b - a)).astype(int), np.round(i + part * (j - i)).astype(int)] = True
    cells = raster[::-1].reshape(rows, 4, columns, 2)
    plain = not _has_braille(encoding)
    lines = []
    for row in cells.transpose(0, 2, 1, 3):
        if plain:
            lines.append("".join(":" if cell.any() else " " for cell in row))
        else:
            codes = [sum(_DOTS[r][c] for r in range(4) for c in range(2) if cell[r, c]) for cell in row]
            lines.append("".join(chr(0x2800 + code) if code else " " for code in codes))
    return [line.rstrip() for line in lines]


def _has_braille(encoding: str | None) -> bool:
    try:
        "\u28ff".encode(encoding or sys.stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
