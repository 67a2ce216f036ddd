"""What the laws of geometry say of the measured backbone, and whether one of them is to be named.

Effects that only shape the backbone change nothing along the motion. They are judged by the same rules as the
others (:mod:`.decide`), from the fall of chi-square of one curve: no run is left out, for all runs share the contact. A
change of shape is distinguished from roughness only where the roughness is known: else H and h_rms are parameters of
the distribution of gaps, explain most of it, and what they leave is no proof of a cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtrc

from ...errors import InputError
from ...physics.effects import catalogue
from ...system.units import shown
from ..force.backbone import Backbone, PowerLaw, backbone, power_law
from ..force.fit import Fit
from ..force.geometry import ROUGHNESS, Laws, RoughLine, Shaped, geometry_laws
from .decide import CHANCE, DISPERSION, LEAST, price


@dataclass(frozen=True)
class Law:
    """An effect that shapes the backbone, judged.

    Attributes:
        shaped: its fit.
        chance: of such a gain by chance, corrected for all that was tried.
        gain: fall of chi-square, less the price of an improbable amplitude.
    """

    shaped: Shaped
    chance: float
    gain: float

    @property
    def tag(self) -> str:
        """Of the effect."""
        return self.shaped.tag

    @property
    def name(self) -> str:
        """Of its amplitude."""
        return f"{self.tag}.{catalogue.get(self.tag).amplitude}"

    @property
    def amount(self) -> str:
        """Its amplitude in words."""
        s = self.shaped
        return f"{self.name} = {shown(s.amplitude, s.free.unit, 3)} +- {shown(s.std, s.free.unit, 2)}"


@dataclass(frozen=True)
class Shape:
    """The measured backbone and its laws.

    Attributes:
        curve, power: the backbone, and the power law that describes it.
        line, unstated: the rough line nearest to it with what the rig states of its roughness, and without.
        laws: effects on top of ``line``, the best first.
        close: what is to be named, and behind it what the curve cannot distinguish from it.
        lacking: why there is no rough line.
    """

    curve: Backbone
    power: PowerLaw
    line: RoughLine | None = None
    unstated: RoughLine | None = None
    laws: tuple[Law, ...] = ()
    close: tuple[Law, ...] = ()
    lacking: str = ""

    @property
    def stated(self) -> bool:
        """Whether the roughness is known."""
        return self.line is not None and set(self.line.stated) == set(ROUGHNESS)


def shape_of(fit: Fit, rig: Any, tags: Sequence[str] | None = None) -> Shape:
    """The laws of the backbone that a fit measured.

    Args:
        fit: along the measured motion.
        rig: ``[rig]`` of the campaign.
        tags: effects to try; default the whole catalogue.
    """
    curve = backbone(fit)
    power = power_law(curve, int(rig.contacts or 1))
    try:
        found = geometry_laws(curve, rig, tags)
    except InputError as error:
        return Shape(curve, power, lacking=f"Without a rough line beside the measured backbone: {error.what}.")
    return judged(curve, power, found)


def unshaped(fit: Fit, rig: Any) -> Shape:
    """The backbone where elasticity of the instrument is in series with the contact, so that no law of a contact is."""
    curve = backbone(fit)
    power = power_law(curve, int(rig.contacts or 1))
    return Shape(curve, power, lacking="The backbone is of contact and instrument in series, no law of a contact.")


def judged(curve: Backbone, power: PowerLaw, found: Laws) -> Shape:
    """Which of the laws is to be named: seen beyond chance, on top of a roughness that is known."""
    tried = max(len(found.shaped), 1)
    laws = []
    for s in found.shaped:
        gain = s.gain - price(s.free, s.free.inward(s.amplitude))
        chance = float(chdtrc(1, max(gain, 0.0) / DISPERSION)) * s.members * tried
        laws.append(Law(s, min(1.0, chance), gain))
    laws.sort(key=lambda law: -law.gain)
    seen = [law for law in laws if law.chance < CHANCE]
    close = [law for law in seen if seen[0].gain - law.gain < DISPERSION * LEAST]
    made = Shape(curve, power, found.line, found.unstated, tuple(laws))
    return replace(made, close=tuple(close)) if made.stated else made


def section(shape: Shape) -> dict[str, Any]:
    """Entry ``backbone`` of the result."""
    law, curve = shape.power, shape.curve
    return {
        "u_max": law.u_max, "p": law.p, "spread": law.spread, "misfit": law.misfit,
        "strength": float(curve.force[-1]), "stiffness": float(curve.force[0] / curve.displacement[0]),
        "rough_line": None if shape.line is None else _line(shape.line),
        "laws": [_law(law, shape) for law in shape.laws],
        "text": text(shape),
    }  # fmt: skip


def text(shape: Shape) -> str:
    """What the curve is, in a few sentences."""
    line = shape.line
    if line is None:
        return shape.lacking
    parts = [_line(line)["text"]]
    if shape.close:
        parts.append(named_text(shape))
    elif shape.stated and shape.unstated is not None:
        parts.append(f"No geometry effect is detected. {_free(shape.unstated)}")
    elif shape.laws:
        parts.append("The roughness is not stated, so geometry effects cannot be identified.")
    return " ".join(parts)


def named_text(shape: Shape) -> str:
    """The effect of geometry that is named; nothing where none is."""
    if not shape.close:
        return ""
    best, *others = shape.close
    also = f" This curve cannot distinguish it from {' or '.join(o.tag for o in others)}." if others else ""
    free = "" if shape.unstated is None else f" {_free(shape.unstated)}"
    return (
        f"The contact's backbone is not that of rough lines as stated, but with {best.tag} on top ({best.amount}; "
        f"chi-square falls by {best.gain:.0f}).{also}{free}"
    )


def _free(line: RoughLine) -> str:
    hurst, height = _with(line.hurst, line.hurst_std, "1"), _with(line.h_rms, line.h_rms_std, "m")
    return f"With another roughness, H = {hurst} and h_rms = {height} would be nearest (chi-square {line.cost:.0f})."


def _with(value: float, std: float, unit: str) -> str:
    return shown(value, unit, 3) + ("" if std == 0.0 else f" +- {shown(std, unit, 2)}")


def _line(line: RoughLine) -> dict[str, Any]:
    guessed = f"; guesses: {', '.join(line.guessed)}" if line.guessed else ""
    edge = "; at the edge of the range of such lines" if line.edge else ""
    stated = f" ({' and '.join(line.stated)} as the rig states)" if line.stated else ""
    return {
        "H": line.hurst, "H_std": line.hurst_std, "h_rms": line.h_rms, "h_rms_std": line.h_rms_std,
        "correlation": line.correlation, "edge": line.edge,
        "stated": list(line.stated), "guessed": list(line.guessed), "misfit": line.misfit, "cost": line.cost,
        "contacts": line.contacts, "N": line.springs, "L": line.length,
        "text": (
            f"Nearest rough lines{stated}: H = {_with(line.hurst, line.hurst_std, '1')}, h_rms = "
            f"{_with(line.h_rms, line.h_rms_std, 'm')}, for {line.contacts} "
            f"contact{'s' if line.contacts > 1 else ''} of L = {shown(line.length, 'm')} and N = {line.springs}"
            f"{guessed}; effective parameters of the distribution of gaps, not a topography{edge}. The curve is off by "
            f"{line.misfit:.2g} of the deviations, which hold what was measured and how other lines of the same "
            f"surface would differ."
        ),
    }  # fmt: skip


def _law(law: Law, shape: Shape) -> dict[str, Any]:
    s = law.shaped
    return {
        "tag": law.tag, "form": s.form, "inner": s.inner, "gain": s.gain, "chance": law.chance,
        "amplitude": {
            "name": law.name, "value": s.amplitude, "std": s.std if np.isfinite(s.std) else None, "unit": s.free.unit,
        },
        "visible": s.visible, "H": s.hurst, "h_rms": s.h_rms,
        "unique": bool(shape.close) and law is shape.close[0] and len(shape.close) == 1,
        "text": _reason(law, shape),
    }  # fmt: skip


def _reason(law: Law, shape: Shape) -> str:
    """Why an effect is named or not."""
    s, seen = law.shaped, law.chance < CHANCE
    if not shape.stated:
        names = [name for name in ROUGHNESS if shape.line is None or name not in shape.line.stated]
        missing = f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} not stated"
        if seen:
            return f"closer than any rough line, but {missing}, so this is no evidence of a cause"
        return f"{missing} and can compensate such a change of shape"
    if not seen and s.gain > law.gain:
        return "the amplitude is outside its usual range"
    if not seen:
        limit = s.visible
        if limit is None:
            return "not detectable within its range"
        return f"not detected (detection limit {shown(limit, s.free.unit, 2)})"
    if law not in shape.close:
        return f"{shape.close[0].tag} is nearer"
    others = [o.tag for o in shape.close if o is not law]
    return f"this curve cannot distinguish it from {' or '.join(others)}" if others else "named"
