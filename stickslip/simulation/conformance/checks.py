"""All checks on one effect, or on many at once in one compilation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...errors import StickslipError
from ...physics.effects.base import Effect
from ...physics.effects.catalogue import accept, forms
from . import dynamics, gradients, statics
from .compile_check import first_line
from .rig import Rig


@dataclass(frozen=True)
class Finding:
    """A rule that an effect breaks.

    Attributes:
        tag: of the effect.
        check: ``metadata``, ``bounds``, ``compilation``, ``null``, ``finite``, ``energy`` or ``gradients``.
        text: what was found.
    """

    tag: str
    check: str
    text: str

    def __str__(self) -> str:
        return f"{self.tag}: {self.check}: {self.text}"


TOGETHER = 10  # effects in one compilation: more take longer to run than they save in compiling

RIG_CHECKS: tuple[tuple[str, Callable], ...] = (
    ("finite", dynamics.check_finite),
    ("energy", dynamics.check_energy),
    ("gradients", gradients.check_gradients),
)


def check_effect(cls: type[Effect], *, full_metadata: bool = True) -> list[Finding]:
    """Every check on one effect, in all its forms; an empty list if it keeps the rules. Takes some 10 s.

    Args:
        cls: the class.
        full_metadata: whether source, signature and confusions must be there (they must in the catalogue).

    What is checked: priors lie within the bounds and have a positive width; every form has an equation of its own;
    bounds are refused with a message; one compilation serves all values; the null reproduces the base model bit for
    bit; values and derivatives are finite in every corner of the ranges, also in steps without time or way; a passive
    contact creates no energy; derivatives through the solver agree with finite differences over a ladder of steps at
    two tolerances.
    """
    return check_effects([cls], full_metadata=full_metadata)


def check_effects(classes: Sequence[type[Effect]], *, full_metadata: bool = True) -> list[Finding]:
    """:func:`check_effect` on many classes; groups of them share a compilation, the others at their nulls."""
    findings: list[Finding] = []
    able: list[Effect] = []
    for cls in classes:
        found, usable = _alone(cls, full_metadata)
        findings += found
        if usable:
            able += [cls(**form) for form in forms(cls)]
    for first in range(0, len(able), TOGETHER):
        findings += _together(tuple(able[first : first + TOGETHER]))
    return findings


def _alone(cls: type[Effect], full_metadata: bool) -> tuple[list[Finding], bool]:
    """What needs no rig, and whether a rig can take the effect."""
    try:
        accept(cls)
    except StickslipError as error:
        return [Finding(cls.tag or cls.__name__, "metadata", str(error))], False
    found = [Finding(cls.tag, "metadata", text) for text in statics.check_metadata(cls, full_metadata)]
    found += [Finding(cls.tag, "bounds", text) for text in statics.check_bounds(cls)]
    found += [Finding(cls.tag, "compilation", text) for text in statics.check_compilation(cls)]
    found += [Finding(cls.tag, "null", text) for text in dynamics.check_null(cls)]
    return found, not any(f.check in ("null", "compilation") for f in found)


def _together(effects: tuple[Effect, ...]) -> list[Finding]:
    """What is tried on the rig; if that cannot be compiled with all effects, each has its own."""
    if not effects:
        return []
    findings: list[Finding] = []

    def alone() -> list[Finding]:
        return [f for effect in effects for f in _together((effect,))]

    rig = Rig(effects)
    for name, check in RIG_CHECKS:

        def report(index: int, text: str, name: str = name) -> None:
            findings.append(Finding(effects[index].tag, name, describe(effects[index]) + text))

        try:
            check(rig, report)
        except Exception as error:  # whatever a foreign law raises when it is traced
            if len(effects) > 1:
                return alone()
            return [Finding(effects[0].tag, "compilation", f"the law cannot be compiled: {first_line(error)}")]
        if name == "finite" and findings and len(effects) > 1:
            return alone()  # a number that is not finite spoils the others' runs and derivatives
        if name == "finite" and findings:
            break
    if rig.traces > 1:
        findings.append(Finding(effects[0].tag, "compilation", f"{rig.traces} compilations of one run"))
    return findings


def describe(effect: Effect) -> str:
    """The form of an effect that has several, as a prefix of a message."""
    own = [f for f in forms(type(effect)) if f and all(getattr(effect, k) == v for k, v in f.items())]
    return dynamics.named(own[0]) if own else ""
