"""The equations that a model solves, with the parameters, their symbols, values and units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..params import specs, variants
from . import symbols
from .base import BodyForce, Drive, Effect, Flow, Geometry, Inertia, Sensor, Spring, Stiffness, Threshold
from .effects_from_text import STATIC, effects_of
from .equation_text import Equations, Line, Row, pieces

# role -> what its equation does to the base model
_ACTS = {
    Inertia: "changes the moving mass",
    Drive: "moves the load point",
    Spring: "changes the driving spring's law",
    Geometry: "changes the bank of elements",
    Threshold: "changes the caps",
    Stiffness: "changes the elements' stiffness",
    Flow: "relaxes the elements' forces",
    BodyForce: "adds a force on the block",
    Sensor: "changes what is read",
}
_SOURCES = (
    ("contact", "Grzemba, Phys. Mesomech. 17 (2014) 39; Ciavarella, J. Appl. Mech. 65 (1998) 998; "
     "Jäger, Arch. Appl. Mech. 65 (1995) 478"),
    ("elements", "Iwan, J. Appl. Mech. 34 (1967) 612"),
)  # fmt: skip


@dataclass(frozen=True)
class PowerLaw:
    """The numbers of contacts on a power-law curve, by default such as the paper's rig has.

    Attributes:
        strength: full friction force of all contacts together (N).
        u_max: displacement at which the last element of the typical contact slides (m).
        p: exponent of the curve, above 1.
        spread: rms of ln(u_max) over the contacts.
        contacts: how many.
        elements: Jenkins elements of all of them together.
    """

    strength: float = 0.2604
    u_max: float = 0.95e-6
    p: float = 3.3
    spread: float = 0.0
    contacts: int = 4
    elements: int = 128

    def rows(self) -> tuple[Row, ...]:
        """As parameters of a model."""
        told = (
            ("strength", "F_s", "N"),
            ("u_max", r"u_{\mathrm{max}}", "m"),
            ("p", "p", "1"),
            ("spread", r"\sigma_u", "1"),
            ("contacts", "N_c", "1"),
            ("elements", "N_e", "1"),
        )
        return tuple(
            Row(symbol, f"contact.{name}", float(getattr(self, name)), unit, _without_unit(symbol))
            for name, symbol, unit in told
        )


def equations(
    effects: Sequence[Effect],
    *,
    block: Any = None,
    weakening: Any = None,
    contact: PowerLaw | tuple[Row, ...] | None = None,
    inertial: bool = True,
) -> Equations:
    """The equations of the base model with ``effects``.

    Args:
        effects: in the order of application.
        block, weakening: the base model's parts, for the values of their parameters.
        contact: the contacts' numbers; rows of parameters where the bank comes from elsewhere than a power law.
        inertial: with inertia and weakening, or the quasi-static model at constant friction.
    """
    names = [STATIC, *(["inertia"] if inertial else []), *(e.tag for e in effects if e.tag != "inertia")]
    other = symbols.distinct(effects)
    lines = [*_base(effects, inertial), *_contact(isinstance(contact, PowerLaw))]
    lines += [_own(effect, own) for effect, own in zip(effects, other, strict=True)]
    lines = [Line(line.title if k == 0 else "", part) for line in lines for k, part in enumerate(pieces(line.latex))]
    rows: list[Row] = []
    for key, part in (("block", block), ("weakening", weakening if inertial else None)):
        if part is not None:
            rows += [r for r in _rows(key, part, {}) if inertial or r.symbol == "c_s"]
    rows += contact.rows() if isinstance(contact, PowerLaw) else contact or ()
    for effect, own in zip(effects, other, strict=True):
        rows += _rows(effect.tag, effect, own)
    sources = (*_SOURCES, *((e.tag, e.source) for e in effects if e.source))
    return Equations(tuple(names), tuple(lines), tuple(rows), tuple(_told(lines, rows, effects, other)), sources)


def of_model(model: Any, contact: PowerLaw | None = None) -> Equations:
    """The equations of a :class:`stickslip.physics.model.Model`; of its bank alone only strength and size are known."""
    numbers: PowerLaw | tuple[Row, ...] | None = contact
    if numbers is None:
        facts = (("strength", "F_s", float(model.bank.total_strength), "N"),
                 ("elements", "N_e", float(model.bank.stiffness.size), "1"))  # fmt: skip
        numbers = tuple(
            Row(symbol, f"contact.{name}", value, unit, _without_unit(symbol)) for name, symbol, value, unit in facts
        )
    return equations(model.effects, block=model.block, weakening=model.weakening, contact=numbers)


def of_tags(
    words: Sequence[str], *, block: Any = None, weakening: Any = None, contact: PowerLaw | None = None
) -> Equations:
    """The equations of a list such as ``["static", "inertia", "rate-and-state:law=slip:evolution=0.01"]``.

    Args:
        words: as of :func:`stickslip.physics.effects.effects_from_text.effects_of`; what is not chosen is at its
            default.
        block, weakening: as of :func:`equations`.
        contact: default the rig of the paper.

    Raises:
        InputError: a name, form or value that there is not, or effects without inertia.
    """
    effects, inertial = effects_of(words)
    return equations(effects, block=block, weakening=weakening, contact=contact or PowerLaw(), inertial=inertial)


def _base(effects: Sequence[Effect], inertial: bool) -> Iterator[Line]:
    marks = symbols.marks(effects)
    bodies = "".join(
        f" + {symbols.subscripted('F', mark)}"
        for effect, mark in zip(effects, marks, strict=True)
        if isinstance(effect, BodyForce)
    )
    if inertial:
        yield Line("balance of the block", r"m \ddot x = F_{\mathrm{spring}} - c\,\dot x - \sum_i f_i" + bodies)
    else:
        yield Line("balance of the block, without inertia", r"0 = F_{\mathrm{spring}} - \sum_i f_i" + bodies)
    yield Line("driving spring", r"F_{\mathrm{spring}} = c_s\,(x_0 - x)")
    yield Line("Jenkins elements, while stuck", r"\dot f_i = k_i\,\dot x")
    if inertial:
        factors = any(isinstance(effect, Threshold) for effect in effects)
        zero = " (an effect's factor below zero counts as zero)" if factors else ""
        yield Line(f"and never beyond their caps{zero}", r"|f_i| \le C_i = c_i\,\mu/\mu_s")
        yield Line("weakening", r"\mu/\mu_s = r + (1 - r)\,\psi,\quad r = \mu_k/\mu_s")
        yield Line("its state", r"\dot\psi = (1 - \psi)/t_h - |\dot x|\,\psi/D_c,\quad \psi(0) = 1")
    else:
        yield Line("and never beyond their caps (constant friction)", r"|f_i| \le c_i")
    chain = sorted((e for e in effects if isinstance(e, Sensor) and _reads(e)), key=lambda e: e.place)
    if chain:
        yield Line(f"reading of the sensor, which is changed by {', then '.join(e.tag for e in chain)}", "y = x")


def _reads(effect: Effect) -> bool:
    """Whether a sensor's effect is one in the form chosen: there are forms that act on the contact instead."""
    return not variants(effect) or "y" in symbols.found(effect.formula())


def _contact(power_law: bool) -> Iterator[Line]:
    if power_law:
        yield Line(
            "virgin contacts on first loading, mean over the contacts (beyond U_j all of a contact slides)",
            r"F(u) = \frac{F_s}{N_c} \sum_j [1 - (1 - u/U_j)^p],\quad U_j = u_{\mathrm{max}}\,e^{\sigma_u z_j}",
        )
        yield Line(
            "thresholds of the elements",
            r"u_i = w_i\,\max_j U_j,\quad w_i = \left(3 - \sqrt{9 - 8 i/N_e}\right)/2,\quad i = 1 \ldots N_e",
        )
        yield Line(
            "their stiffnesses: the slope of F up to the threshold less the slope after it; their caps",
            r"k_i = \left[F(u_i) - F(u_{i-1})\right]/(u_i - u_{i-1})"
            r" - \left[F(u_{i+1}) - F(u_i)\right]/(u_{i+1} - u_i),\quad c_i = k_i\,u_i",
        )
    else:
        yield Line(
            "stiffnesses and caps of the elements are those of the contact's curve on first loading",
            r"F(u) = \sum_i \min(k_i u, c_i),\quad u_i = c_i/k_i",
        )
    yield Line("full friction force", r"F_s = \sum_i c_i")


def _own(effect: Effect, other: Mapping[str, str]) -> Line:
    forms = variants(effect)
    acts = [words for role, words in _ACTS.items() if isinstance(effect, role)]
    if forms and len(acts) > 1:
        acts = []  # which of them it is, is a matter of the form; its equation tells
    about = "; ".join([*([", ".join(acts)] if acts else []), *(f"{name} = {getattr(effect, name)}" for name in forms)])
    return Line(f"{effect.tag} ({about})", symbols.replaced(effect.formula(), other))


def _rows(key: str, thing: Any, other: Mapping[str, str]) -> Iterator[Row]:
    for name, spec in specs(thing).items():
        value = np.asarray(getattr(thing, name), float)
        number = float(value) if value.shape == () else None
        symbol = symbols.symbol_of(name, spec.symbol)
        shown = other.get(symbol) or symbols.replaced(symbol, other)
        yield Row(shown, f"{key}.{name}", number, spec.unit, spec.doc)


def _told(
    lines: Sequence[Line], rows: Sequence[Row], effects: Sequence[Effect], other: Sequence[Mapping[str, str]]
) -> Iterator[tuple[str, str]]:
    """The symbols that are no parameters, as they come, and what they mean."""
    known = dict(symbols.BASE)
    for effect, own in zip(effects, other, strict=True):
        meant = effect.symbols | ({"F": "force on the block (N)"} if isinstance(effect, BodyForce) else {})
        known |= {own.get(symbol, symbol): meaning for symbol, meaning in meant.items()}
    for row in rows:
        for symbol in {row.symbol, *symbols.found(row.symbol)}:
            known.pop(symbol, None)
    for symbol in dict.fromkeys(s for line in lines for s in symbols.found(line.latex)):
        if symbol in known:
            yield symbol, known[symbol]


def _without_unit(symbol: str) -> str:
    return symbols.BASE[symbol].rpartition(" (")[0] or symbols.BASE[symbol]
