"""Symbols of formulas: finding them in LaTeX, what those of the base model mean, and keeping two meanings apart.

An effect chooses its symbols without knowing the others. Where two effects of one model, or an effect and the base
model, use the same one for different things, it gets the effect's initials as a subscript.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from ..params import specs
from .base import BodyForce, Effect

BASE: dict[str, str] = {
    "x": "displacement of the block (m)",
    "t": "time (s)",
    "x_0": "position of the load point (m)",
    "m": "mass of the block (kg)",
    "c": "viscous damping of the block (N s/m)",
    "c_s": "stiffness of the driving spring (N/m)",
    r"F_{\mathrm{spring}}": "force of the driving spring (N)",
    "i": "number of the element",
    "j": "number of a contact, or of another element",
    "f_i": "force of an element (N)",
    "k_i": "stiffness of an element (N/m)",
    "c_i": "cap of an element at full strength (N)",
    "C_i": "cap of an element as it is now (N)",
    "u_i": "displacement at which an element of a virgin contact slides (m)",
    "u": "displacement on first loading (m)",
    "F": "force of the contacts on first loading (N)",
    "F_s": "full static friction of all contacts (N)",
    r"u_{\mathrm{max}}": "displacement at which the last element of the typical contact slides (m)",
    "p": "exponent of the contacts' curve on first loading",
    r"\sigma_u": "rms of ln(u_max) over the contacts",
    "U_j": "displacement at which all of a contact slides (m)",
    "z_j": "normal score of a contact: quantile of the normal distribution, rms 1",
    "w_i": "threshold of an element as a share of the largest",
    "N_c": "number of contacts",
    "N_e": "number of Jenkins elements",
    r"\mu": "coefficient of friction as it is now",
    r"\mu_s": "static coefficient of friction",
    r"\mu_k": "kinetic coefficient of friction",
    "r": "kinetic over static friction",
    r"\psi": "state of the weakening, 1 rested ... 0 fully weakened",
    "D_c": "slip over which strength is lost (m)",
    "t_h": "time over which strength returns (s)",
    "y": "reading of the sensor (m)",
}
BASE |= {f"{name}_j": f"{BASE[f'{name}_i'].replace('an element', 'element j')}" for name in "fkcu"}

# what stands in a formula and is no symbol; of letters the differential and Euler's number
_SIGN = re.compile(
    r"d|e|\\(?:to|l[en]|ge|ll|sim|sinh?|cos|tanh|exp|max|min|sum|int|left|right|cdot|times|pi|infty|t?frac|sqrt|d?dot"
    r"|bar|partial|q?quad|langle|rangle|ldots|propto)"
)
_NAME = r"\\(?:mathrm|text|operatorname)\{[^}]*\}"
_SUBSCRIPT = r"_(?:\{(?:[^{}]|\{[^{}]*\})*\}|\\[A-Za-z]+|\w)"
_TOKEN = re.compile(rf"{_NAME}|(?:\\[A-Za-z]+|[A-Za-z](?:\^\*)?)(?:{_SUBSCRIPT})?")


def symbol_of(name: str, symbol: str) -> str:
    """LaTeX of a parameter: its symbol, or its name where it has none."""
    return symbol or rf"\mathrm{{{name}}}".replace("_", r"\ ")


def found(latex: str) -> list[str]:
    """The symbols of a formula in the order they come; function names, operators and words left out."""
    tokens = dict.fromkeys(_plain_subscript(t) for t in _TOKEN.findall(latex) if not re.match(_NAME, t))
    return [t for t in tokens if not _SIGN.fullmatch(t.split("_")[0])]


def of_parameters(thing: type[Effect] | Effect) -> set[str]:
    """Symbols that stand for parameters of an effect; ``a/b`` is the two of them."""
    written = (symbol_of(name, spec.symbol) for name, spec in specs(thing).items())
    return {t for s in written for t in ([s] if re.fullmatch(_NAME, s) else found(s))}


def replaced(latex: str, names: Mapping[str, str]) -> str:
    """A formula with some of its symbols (as :func:`found` gives them) written otherwise."""
    return _TOKEN.sub(lambda m: names.get(_plain_subscript(m[0]), m[0]), latex)


def subscripted(symbol: str, words: str) -> str:
    """A symbol with words as an additional subscript."""
    head, _, sub = symbol.partition("_") if not re.match(_NAME, symbol) else (symbol, "", "")
    before = f"{sub.removeprefix('{').removesuffix('}')}," if sub else ""
    return rf"{head}_{{{before}\mathrm{{{words}}}}}"


def distinct(effects: Sequence[Effect]) -> list[dict[str, str]]:
    """For every effect of a model its symbols that mean something else elsewhere in it, and what to write instead."""
    own = [_own(effect) for effect in effects]
    users = Counter(symbol for mine in own for symbol in mine)
    return [
        {symbol: subscripted(symbol, words) for symbol in sorted(mine) if users[symbol] > 1 or symbol in BASE}
        for mine, words in zip(own, marks(effects), strict=True)
    ]


def marks(effects: Sequence[Effect]) -> list[str]:
    """A short subscript for every effect of a model: initials of its tag, the tag where others have the same."""
    tags = [effect.tag for effect in effects]
    short = {tag: tag if "-" not in tag else "".join(word[0] for word in tag.split("-")) for tag in tags}
    unique = {tag: mark if list(short.values()).count(mark) == 1 else tag for tag, mark in short.items()}
    numbers = [str(tags[: k + 1].count(tag)) if tags.count(tag) > 1 else "" for k, tag in enumerate(tags)]
    return [f"{unique[tag]}{number}" for tag, number in zip(tags, numbers, strict=True)]


def _own(effect: Effect) -> set[str]:
    """What an effect brings along: its parameters, what it declares, and what the base model does not know."""
    brought = {t for t in found(effect.formula()) if t not in BASE or t in effect.symbols}
    return of_parameters(effect) | brought | ({"F"} if isinstance(effect, BodyForce) else set())


def _plain_subscript(symbol: str) -> str:
    """``x_{1}`` as ``x_1``."""
    return re.sub(r"_\{(\w)\}$", r"_\1", symbol)
