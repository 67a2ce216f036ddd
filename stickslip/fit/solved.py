"""The equations that a fitted model solves: those of its block, friction and effects, and the backbone of its bank."""

from __future__ import annotations

from dataclasses import replace

from ..effects.equations import Equations, Line, Row, of_model
from .record import Fitted, constant_drive

_SYMBOLS = {
    "contact.strength": "F_s",
    "contact.u_max": r"u_{\mathrm{max}}",
    "contact.p": "p",
    "contact.spread": r"\sigma_u",
}
_SOURCE = "Ciavarella-Jaeger theorem"


def solved(found: Fitted) -> Equations:
    """Equations and parameters with their fitted values."""
    base = of_model(found.model(constant_drive(1e-4)))
    backbone = [
        Line(
            "caps and stiffnesses follow from the virgin curve, mean over the contacts j (z_j standard normal)",
            r"F(u) = F_s\,\langle 1 - (1 - u/u_j)_+^{p} \rangle_j,\quad u_j = u_{\mathrm{max}} e^{\sigma_u z_j}",
        )
    ]
    free = {f.name: f for f in found.composition.free}
    rows = []
    for name, symbol in _SYMBOLS.items():
        f = free.get(name)
        unit, doc = (f.unit, f.doc) if f is not None else ("1", "")
        rows.append(Row(symbol, name, found.values[name], unit, doc, _SOURCE))
    return replace(base, lines=(*base.lines, *backbone), rows=(*base.rows, *rows))
