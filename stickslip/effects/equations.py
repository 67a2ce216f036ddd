"""The equations that a model solves, as text and as LaTeX, with the parameters, their symbols, values and units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError, nearest
from ..params import specs, variants
from . import catalogue
from .base import BodyForce, Drive, Effect, Flow, Geometry, Inertia, Sensor, Spring, Stiffness, Threshold
from .plain import plain

STATIC = "static"

# role -> what its equation does to the base model
_ACTS = {
    Inertia: "changes the moving mass",
    Drive: "moves the load point",
    Spring: "replaces the driving spring's law",
    Geometry: "changes the bank of elements",
    Threshold: "changes the caps",
    Stiffness: "changes the elements' stiffness",
    Flow: "relaxes the elements' forces",
    BodyForce: "adds a force on the block",
    Sensor: "changes what is read",
}


@dataclass(frozen=True)
class Line:
    """One equation: what it is, and its LaTeX."""

    title: str
    latex: str


@dataclass(frozen=True)
class Row:
    """One parameter: symbol (LaTeX), dotted name, value (``None`` where not given), SI unit, meaning, source."""

    symbol: str
    name: str
    value: float | None
    unit: str
    doc: str
    source: str = ""


@dataclass(frozen=True)
class Equations:
    """What a model solves.

    Attributes:
        model: its names, e.g. ``("static", "inertia", "contact-ageing")``.
        lines: the equations.
        rows: the parameters.
    """

    model: tuple[str, ...]
    lines: tuple[Line, ...]
    rows: tuple[Row, ...]

    def text(self) -> str:
        """For a terminal."""
        out = ["Model: " + " + ".join(self.model), ""]
        for line in self.lines:
            out += [f"{line.title}:", f"    {plain(line.latex)}"]
        cells = [(plain(r.symbol), r.name, _number(r.value), "" if r.unit == "1" else r.unit, r.doc) for r in self.rows]
        if cells:
            widths = [max(len(c[i]) for c in cells) for i in range(4)]
            out += ["", "Parameters:"]
            out += ["    " + "  ".join([*(c[i].ljust(widths[i]) for i in range(4)), c[4]]).rstrip() for c in cells]
        return "\n".join(out) + "\n"

    def latex(self) -> str:
        """A fragment for a document that loads ``amsmath``: an ``align*`` and a ``tabular``."""
        lines = [rf"  & {line.latex} && \text{{{_escape(line.title)}}} \\" for line in self.lines]
        rows = [
            rf"  ${r.symbol}$ & {_escape(r.name)} & {_tex_number(r.value)} & {_tex_unit(r.unit)} & {_escape(r.doc)} \\"
            for r in self.rows
        ]
        return "\n".join(
            [r"\begin{align*}", *lines, r"\end{align*}", r"\begin{tabular}{lllll}", *rows, r"\end{tabular}", ""]
        )


def equations(
    effects: Sequence[Effect], *, block: Any = None, weakening: Any = None, inertial: bool = True
) -> Equations:
    """The equations of the base model with ``effects``.

    Args:
        effects: in the order of application.
        block, weakening: the base model's parts, for the values of their parameters.
        inertial: with inertia and weakening, or the quasi-static model at constant friction.
    """
    names = [STATIC, *(["inertia"] if inertial else []), *(e.tag for e in effects if e.tag != "inertia")]
    lines = [*_base(effects, inertial), *(line for effect in effects for line in _own(effect))]
    rows: list[Row] = []
    for key, part in (("block", block), ("weakening", weakening if inertial else None)):
        if part is not None:
            rows += [r for r in _rows(key, part) if inertial or r.symbol == "c_s"]
    for effect in effects:
        rows += _rows(effect.tag, effect)
    return Equations(tuple(names), tuple(lines), tuple(rows))


def of_model(model: Any) -> Equations:
    """The equations of a :class:`stickslip.model.Model`."""
    return equations(model.effects, block=model.block, weakening=model.weakening)


def of_tags(tags: Sequence[str], *, block: Any = None, weakening: Any = None) -> Equations:
    """The equations of a list such as ``["static", "inertia", "contact-ageing"]``, effects at their defaults.

    Raises:
        InputError: an unknown tag (names the nearest).
    """
    effects = []
    for tag in tags:
        if tag == STATIC:
            continue
        if tag not in catalogue.all():
            raise InputError(
                f"there is no effect '{tag}'", key="--model", hint=nearest(tag, [STATIC, *catalogue.tags()])
            )
        effects.append(catalogue.make(tag))
    dynamic = any(tag != STATIC for tag in tags)
    if dynamic and "inertia" not in tags and STATIC in tags:
        dynamic = False
    return equations(effects, block=block, weakening=weakening, inertial=dynamic)


def _base(effects: Sequence[Effect], inertial: bool) -> Iterator[Line]:
    bodies = "".join(rf" + F_{{\mathrm{{{e.tag}}}}}" for e in effects if isinstance(e, BodyForce))
    if inertial:
        yield Line("balance of the block", r"m \ddot x = F_{\mathrm{spring}} - c\,\dot x - \sum_i f_i" + bodies)
    else:
        yield Line("balance of the block, without inertia", r"0 = F_{\mathrm{spring}} - \sum_i f_i" + bodies)
    yield Line("driving spring", r"F_{\mathrm{spring}} = c_s\,(x_0(t) - x)")
    yield Line("Jenkins elements, while stuck", r"\dot f_i = k_i\,\dot x")
    if inertial:
        yield Line("and never beyond their caps", r"|f_i| \le c_i\,\mu(\psi)/\mu_s")
        yield Line("weakening", r"\mu(\psi)/\mu_s = r + (1 - r)\,\psi,\quad r = \mu_k/\mu_s")
        yield Line("its state", r"\dot\psi = (1 - \psi)/t_h - |\dot x|\,\psi/D_c")
    else:
        yield Line("and never beyond their caps (constant friction)", r"|f_i| \le c_i")
    yield Line("full friction force", r"F_s = \sum_i c_i")


def _own(effect: Effect) -> Iterator[Line]:
    acts = ", ".join(words for role, words in _ACTS.items() if isinstance(effect, role))
    form = ", ".join(f"{name} = {getattr(effect, name)}" for name in variants(effect))
    yield Line(f"{effect.tag} ({acts}{'; ' + form if form else ''})", effect.equation)


def _rows(key: str, thing: Any) -> list[Row]:
    rows = []
    for name, spec in specs(thing).items():
        value = np.asarray(getattr(thing, name), float)
        number = float(value) if value.shape == () else None
        rows.append(
            Row(spec.symbol or rf"\mathrm{{{name}}}", f"{key}.{name}", number, spec.unit, spec.doc, spec.source)
        )
    return rows


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
