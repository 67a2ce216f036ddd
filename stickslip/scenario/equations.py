"""The equations a model solves, with their parameters and values, as text and as LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..effects.base import Effect
from ..effects.catalogue import get
from ..errors import InputError, nearest
from ..model import Block, Weakening
from ..params import Spec, specs, variants

BASE = ("static", "inertia")


@dataclass(frozen=True)
class Part:
    """One law of a model.

    Attributes:
        name: tag, or "block", "contact", "weakening".
        meaning: one line.
        latex: the equation.
        parameters: name, symbol, unit, value or None where it is to be fitted, meaning.
    """

    name: str
    meaning: str
    latex: str
    parameters: tuple[tuple[str, Spec, float | str], ...]


def model_parts(names: Sequence[str]) -> list[Part]:
    """The laws of a model named by tags, such as ``["static", "inertia", "contact-ageing"]``.

    "static" is the contact alone under a slow spring; "inertia" makes it the inertial model with weakening.

    Raises:
        InputError: an unknown tag (names the nearest), or one that stands twice.
    """
    from ..effects.catalogue import tags

    known = [*BASE, *tags()]
    for name in names:
        if name not in known:
            raise InputError(f"there is no effect '{name}'", key="--model", hint=nearest(name, known))
        if list(names).count(name) > 1:
            raise InputError(f"'{name}' stands twice", key="--model")
    inertial = any(name != "static" for name in names)
    parts = [_motion(inertial), _contact(inertial)]
    if inertial:
        parts.append(_weakening())
    parts += [_effect(get(name)) for name in names if name not in BASE]
    return parts


def _motion(inertial: bool) -> Part:
    block = specs(Block)
    if not inertial:
        return Part(
            "block",
            "quasi-static balance of spring and contact",
            r"c_s\,(x_0(t) - x) = \sum_i f_i",
            (("spring_stiffness", block["spring_stiffness"], float(Block().spring_stiffness)),),
        )
    values = Block()
    return Part(
        "block",
        "motion of the block",
        r"m\,\ddot x = c_s\,(x_0(t) - x) - c\,\dot x - \sum_i f_i",
        tuple((name, spec, float(getattr(values, name))) for name, spec in block.items()),
    )


def _contact(inertial: bool) -> Part:
    limit = r"\frac{\mu(\psi)}{\mu_s}\,\mu_s f_{n,i}" if inertial else r"\mu f_{n,i}"
    return Part(
        "contact",
        "Jenkins elements: an elastic increment, cut back to the cap",
        r"f_i \leftarrow \mathrm{clip}\left(f_i + c_t\,\Delta x,\ \pm " + limit + r"\right)",
        (),
    )


def _weakening() -> Part:
    law = Weakening()
    return Part(
        "weakening",
        "strength is lost by slip and returns at rest",
        r"\frac{\mu(\psi)}{\mu_s} = \rho + (1 - \rho)\,\psi,\quad "
        r"\dot\psi = \frac{1 - \psi}{t_h} - \frac{|\dot x|\,\psi}{D_c},\quad \rho = \mu_k/\mu_s",
        tuple((name, spec, float(getattr(law, name))) for name, spec in specs(Weakening).items()),
    )


def _effect(cls: type[Effect]) -> Part:
    made = cls()
    found: list[tuple[str, Spec, float | str]] = [
        (name, spec, float(getattr(made, name))) for name, spec in specs(cls).items()
    ]
    for name, choices in variants(cls).items():
        doc = f"form of the law: {', '.join(choices)}"
        found.append((name, Spec("", 0.0, 0.0, doc), getattr(made, name)))
    return Part(cls.tag, cls.summary, cls.equation, tuple(found))


def as_text(parts: Sequence[Part]) -> str:
    """The laws and their parameters in plain lines, equations in LaTeX."""
    lines: list[str] = []
    for part in parts:
        lines += [f"{part.name}: {part.meaning}", f"    {part.latex}"]
        lines += [f"    {text}" for text in parameter_lines(part.parameters)]
        lines.append("")
    return "\n".join(lines).rstrip()


def parameter_lines(parameters: Sequence[tuple[str, Spec, float | str]]) -> list[str]:
    """One line for each parameter: name, symbol, value, range, meaning."""
    lines = []
    for name, spec, value in parameters:
        unit = "" if spec.unit in ("", "1") else f" {spec.unit}"
        shown = value if isinstance(value, str) else f"{value:.6g}{unit}"
        symbol = f" ({spec.symbol})" if spec.symbol else ""
        span = "" if isinstance(value, str) else f" [{spec.lower:g} ... {spec.upper:g}{unit}]"
        null = "" if spec.null is None else f", absent at {spec.null:g}"
        lines.append(f"{name}{symbol} = {shown}{span}: {spec.doc}{null}")
    return lines
