"""Equations, parameters and symbols of a model as text and as LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .latex_to_text import plain


@dataclass(frozen=True)
class Line:
    """One equation: what it is (empty where it goes on from the line before), and its LaTeX."""

    title: str
    latex: str


@dataclass(frozen=True)
class Row:
    """One parameter: symbol (LaTeX), dotted name, value (``None`` where not given), SI unit, meaning."""

    symbol: str
    name: str
    value: float | None
    unit: str
    doc: str


@dataclass(frozen=True)
class Equations:
    """What a model solves.

    Attributes:
        model: its names, e.g. ``("static", "inertia", "contact-ageing")``.
        lines: the equations.
        rows: the parameters.
        symbols: LaTeX and meaning of the symbols that are no parameters.
        sources: part of the model, and the papers or books that its law is from.
    """

    model: tuple[str, ...]
    lines: tuple[Line, ...]
    rows: tuple[Row, ...]
    symbols: tuple[tuple[str, str], ...] = ()
    sources: tuple[tuple[str, str], ...] = ()

    def text(self) -> str:
        """For a terminal."""
        out = ["Model: " + " + ".join(self.model), ""]
        for line in self.lines:
            out += [*([f"{line.title}:"] if line.title else []), f"    {plain(line.latex)}"]
        cells = [(plain(r.symbol), r.name, _number(r.value), "" if r.unit == "1" else r.unit, r.doc) for r in self.rows]
        out += [*(["", "Parameters:"] if cells else []), *_columns(cells)]
        told = [(plain(symbol), meaning) for symbol, meaning in self.symbols]
        out += [*(["", "Symbols (a prime is the rate of change in time):"] if told else []), *_columns(told)]
        out += [*(["", "Sources:"] if self.sources else []), *_columns(self.sources)]
        return "\n".join(out) + "\n"

    def latex(self) -> str:
        """A fragment for a document that loads ``amsmath``: an ``align*``, one or two ``tabular``, the sources."""
        lines = [
            rf"  & {line.latex}" + (rf" && \text{{{_escape(line.title)}}}" if line.title else "") + r" \\"
            for line in self.lines
        ]
        rows = [
            rf"  ${r.symbol}$ & {_escape(r.name)} & {_tex_number(r.value)} & {_tex_unit(r.unit)} & {_escape(r.doc)} \\"
            for r in self.rows
        ]
        told = [rf"  ${symbol}$ & {_escape(meaning)} \\" for symbol, meaning in self.symbols]
        parts = [r"\begin{align*}", *lines, r"\end{align*}"]
        for layout, body in (("lllll", rows), ("ll", told)):
            if body:
                parts += [rf"\begin{{tabular}}{{{layout}}}", *body, r"\end{tabular}"]
        if self.sources:
            items = [rf"  \item {_escape(part)}: {_escape(source)}" for part, source in self.sources]
            parts += [r"\begin{itemize}", *items, r"\end{itemize}"]
        return "\n".join([*parts, ""])


def pieces(latex: str) -> list[str]:
    """The equations of a formula, which stand side by side with a ``,\\quad`` between them."""
    return [part.strip() for part in re.split(r",\s*\\quad\b", latex)]


def _columns(cells: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows of text, every cell but the last as wide as the widest of its column."""
    if not cells:
        return []
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    widths[-1] = 0
    return [f"    {'  '.join(c.ljust(w) for c, w in zip(row, widths, strict=True))}".rstrip() for row in cells]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _tex_number(value: float | None) -> str:
    mantissa, _, exponent = _number(value).partition("e")
    return rf"${mantissa} \times 10^{{{int(exponent)}}}$" if exponent else f"${mantissa}$" if mantissa else ""


def _tex_unit(unit: str) -> str:
    return "" if unit == "1" else "$" + re.sub(r"[A-Za-z]+", lambda m: rf"\mathrm{{{m[0]}}}", unit) + "$"


def _escape(text: str) -> str:
    """Characters that mean something to LaTeX."""
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    return "".join(special.get(c, f"\\{c}" if c in "&%$#_{}" else c) for c in text)
