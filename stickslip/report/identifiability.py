"""What a fit of the dynamic model cannot tell, and what its backbone says of the surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..fit.composition import run_of
from ..fit.effective import EffectiveLine, effective_line
from ..fit.parameters import to_si
from ..fit.record import Fitted
from ..fit.static_table import StaticRig
from ..fit.surface import sensitivity
from ..uncertainty import flat_directions, null_directions, relative
from ..units import shown

CONTACT = ("contact.u_max", "contact.p", "contact.spread")

ALONE = " The deviations are of the fit alone: other lines of the same surface differ by more."


def identifiability(fit: Fitted, rig: Any, line: dict[str, Any] | None) -> list[str]:
    """The identifiability table in words: directions that the fit leaves open, and what is behind u_max and p.

    Args:
        fit: its covariance, and so its words, are those of the data and the priors together.
        rig: of the campaign.
        line: (H, h_rms) that the fit implies, from `effective`.
    """
    shared = [i for i, f in enumerate(fit.composition.free) if run_of(f.name) is None]
    free, z = [fit.composition.free[i] for i in shared], [float(fit.z[i]) for i in shared]
    names, logs = [f.name for f in free], [f.scale == "log" for f in free]
    kept, covariance, lost = relative(names, z, fit.covariance[np.ix_(shared, shared)], logs)
    names = [names[i] for i in kept]
    widths = [free[i].width if logs[i] else np.inf for i in kept]
    lines = [d.text for d in flat_directions(names, covariance, widths=widths)] + lost
    if line is None:
        return lines
    try:
        behind = sensitivity(rig.model_copy(update={"H": line["H"], "h_rms": line["h_rms"]}))
    except InputError:
        return lines
    seen = [k for k, name in enumerate(behind.outputs) if name in names]
    at = [names.index(behind.outputs[k]) for k in seen]
    known = covariance[np.ix_(at, at)] + behind.scatter[np.ix_(seen, seen)]
    found = null_directions(behind.names, behind.jacobian[seen], known)
    return lines + [f"behind the contact: {d.text}" for d in found]


def effective(fit: Fitted, rig: Any) -> dict[str, Any] | None:
    """(H, h_rms) implied by the fitted (u_max, p, spread); None where load or friction is not known at all.

    Standard deviations are those of the fit alone: how other lines of the same surface would differ is not in them.
    """
    values = fit.values
    try:
        known = StaticRig.of(rig, spring_stiffness=1.0)
    except InputError:
        return None
    contacts = fit.composition.contacts
    known = replace(known, contacts=contacts)
    fitted = known.guessed == ("friction_coefficient",)
    if fitted:
        known = replace(known, friction=values["contact.strength"] / (contacts * known.normal_force))

    def line_of(values: dict[str, float]) -> EffectiveLine:
        u_max, p, spread = (values.get(name, 0.0) for name in CONTACT)
        return effective_line(u_max, p, known, spread)

    line = line_of(values)
    hurst_std, rms_std = (np.nan, np.nan) if line.edge else _line_std(fit, line_of)
    known_to = ("", "") if line.edge else (f" +- {hurst_std:.2f}", f" +- {shown(rms_std, 'm', 2)}")
    unequal = f", spread over {contacts} contacts by {values[CONTACT[2]]:.2g}" if CONTACT[2] in values else ""
    text = (
        f"Effective rough line of a contact with u_max = {shown(values['contact.u_max'], 'm', 3)} and p = "
        f"{values['contact.p']:.3g}{unequal}: H = {line.hurst:.2f}{known_to[0]}, h_rms = "
        f"{shown(line.h_rms, 'm', 3)}{known_to[1]}, for L = {shown(line.length, 'm')}, "
        f"N = {line.n_springs}, F_n = {known.normal_force:.3g} N and friction {known.friction:.3g}"
        f"{' (from the fitted strength)' if fitted else ' (guessed)' if known.guessed else ''}; {line.note}."
        f"{'' if line.edge else ALONE}"
    )
    return {
        "text": text,
        "H": line.hurst,
        "H_std": hurst_std,
        "h_rms": line.h_rms,
        "h_rms_std": rms_std,
        "N": line.n_springs,
        "L": line.length,
        "mismatch": line.mismatch,
        "contacts": contacts,
    }


def _line_std(fit: Fitted, line_of: Callable[[dict[str, float]], EffectiveLine]) -> tuple[float, float]:
    """Standard deviations of H and h_rms (m): differences one deviation to either side on the covariance's axes."""
    at = [i for i, f in enumerate(fit.composition.free) if f.name in CONTACT]
    low, high = np.array([fit.composition.free[i].bounds for i in at]).T
    variances, axes = np.linalg.eigh(fit.covariance[np.ix_(at, at)])
    total = np.zeros(2)
    for variance, axis in zip(np.maximum(variances, 0.0), axes.T, strict=True):
        ends = []
        for sign in (-1.0, 1.0):
            z = np.array(fit.z, float)
            z[at] = np.clip(z[at] + sign * np.sqrt(variance) * axis, low, high)
            line = line_of(to_si(fit.composition.free, z))
            ends.append((line.hurst, line.h_rms))
        total += (0.5 * (np.array(ends[1]) - ends[0])) ** 2
    return float(np.sqrt(total[0])), float(np.sqrt(total[1]))
