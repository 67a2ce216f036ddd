"""The catalogue by its evidence: what every effect promises or gained, and its signature over the residual."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from ..inference.force.first_order import Promise
from ..objects.diagnosis import Diagnosis
from ..objects.fit import Fit
from ..objects.fit_plots import AGAINST
from ..physics.effects import catalogue
from ..physics.params import specs
from ..system.units import shown_with

BINS = 12  # of a signature, each with as many points
LEAST = 1.0  # fall of the cost that is shown at all


def best_forms(promises: Sequence[Promise]) -> list[Promise]:
    """The best form of every effect, the most promising first."""
    out: dict[str, Promise] = {}
    for each in promises:
        if each.tag not in out or each.fall > out[each.tag].fall:
            out[each.tag] = each
    return sorted(out.values(), key=lambda p: -p.fall)


def name_of(found: Promise) -> str:
    """As :meth:`stickslip.Fit.add` takes it."""
    form = ",".join(f"{name}={value}" for name, value in found.form.items())
    return f"{found.tag}:{form}" if form else found.tag


def rows(
    fit: Fit,
    promises: Sequence[Promise],
    diagnosis: Diagnosis | None,
    against: str,
    period: float | None = None,
    chosen: str = "",
) -> list[dict[str, Any]]:
    """What the catalogue shows, a row for each effect: those in the model first, the others by what is shown of them.

    Args:
        fit: the model as it stands.
        promises: of effects on top of it.
        diagnosis: whose gains are shown beside.
        against: the variable over which signatures are drawn (see :data:`stickslip.objects.fit_plots.AGAINST`).
        period: over which it is folded (SI); None for not at all.
        chosen: tag of the row that is marked.
    """
    ranked = diagnosis.candidates if diagnosis is not None else None
    known = {} if ranked is None or not len(ranked) else ranked.to_dict("index")
    best = [p for p in best_forms(promises) if p.tag not in fit.effects]
    top = max([p.fall for p in best if np.isfinite(p.fall)] + [float(k["gain"]) for k in known.values()] + [1.0])
    order = bins(fit, against, period)
    said = {p.tag for p in best}
    out = [_row(fit, each, known.get(each.tag), top, order, chosen) for each in best]
    for tag, found in known.items():  # before the effects were looked at
        if tag not in said and tag not in fit.effects:
            out.append({**_empty(tag, chosen), **_gains(found), "share": _share(float(found["gain"]), top)})
    inside = [_in_model(fit, tag, order, chosen) for tag in fit.effects]
    return [*inside, *sorted(out, key=lambda row: -row["share"])]


def bins(fit: Fit, against: str, period: float | None = None) -> list[np.ndarray]:
    """Points in the order of a variable, or of its phase over a period, in parts with as many each."""
    data = fit.force
    use = np.flatnonzero(~data.left_out.values)
    x = np.asarray(data[AGAINST[against]].values, float)[use]
    x = x if period is None else np.mod(x / period, 1.0)
    return [part for part in np.array_split(use[np.argsort(x, kind="stable")], BINS) if part.size]


def law(fit: Fit, promises: Sequence[Promise], tag: str) -> np.ndarray | None:
    """What an effect takes off the residual force (N), or would take off, shape (p,); None where that is not known."""
    if tag not in fit.effects:
        return next((p.force for p in best_forms(promises) if p.tag == tag), None)
    cls = catalogue.get(tag) if tag in catalogue.tags() else None
    name = f"{tag}.{cls.amplitude}" if cls is not None else ""
    if cls is None or name not in fit.values:
        return None
    bare = _without(fit, name, specs(cls)[cls.amplitude].null or 0.0)
    return np.asarray(bare.force.residual.values - fit.force.residual.values)


def signature(fit: Fit, law: np.ndarray | None, parts: Sequence[np.ndarray]) -> list[list[list[float]]]:
    """Medians of the residual and of an effect's force over the floor, scaled into a picture of side 1."""
    if law is None or not parts:
        return []
    data = fit.force
    floor = data.floor.values
    if law.size != floor.size:
        return []
    rest = np.array([np.median(data.residual.values[p] / floor[p]) for p in parts])
    own = np.array([np.median(law[p] / floor[p]) for p in parts])
    top = max(float(np.abs(np.concatenate([rest, own])).max()), 1e-300)
    x = np.linspace(0.0, 1.0, len(parts))
    curves = [[[float(a), float(0.5 + 0.5 * b / top)] for a, b in zip(x, y, strict=True)] for y in (rest, own)]
    return [*curves, [[0.0, 0.5]]]


def _row(
    fit: Fit, found: Promise, known: dict[str, Any] | None, top: float, parts: Sequence[np.ndarray], chosen: str
) -> dict[str, Any]:  # fmt: skip
    size = ""
    if np.isfinite(found.std) and found.fall > LEAST:
        name = catalogue.get(found.tag).amplitude.replace("_", " ")
        size = f"{name} {shown_with(found.amplitude, found.std, found.unit)}"
    made = {
        **_empty(found.tag, chosen),
        "form": name_of(found),
        "share": _share(found.fall, top),
        "gain": f"expected gain {found.fall:.0f}" if found.fall > LEAST else "no expected gain",
        "unseen": f"on unseen runs {found.unseen:.0f} ± {found.unseen_std:.0f}" if found.fall > LEAST else "",
        "amplitude": size,
        "picture": signature(fit, found.force, parts) if found.fall > LEAST else [],
    }
    return made if known is None else {**made, **_gains(known), "share": _share(float(known["gain"]), top)}


@lru_cache(maxsize=8)
def _without(fit: Fit, name: str, null: float) -> Fit:
    """The model without what an amplitude does, nothing fitted; kept, as the list is made anew with every promise."""
    return fit.with_values({name: null})


def _in_model(fit: Fit, tag: str, parts: Sequence[np.ndarray], chosen: str) -> dict[str, Any]:
    if tag not in catalogue.tags():
        return {**_empty(tag, chosen), "on": True, "share": 1.0, "gain": "in the model, but its file is gone"}
    cls = catalogue.get(tag)
    name = f"{tag}.{cls.amplitude}"
    free = {f.name: f for f in fit.free}
    size, picture = "", []
    if name in free:
        std = fit.std.get(name, 0.0)
        size = shown_with(fit.values[name], std, free[name].unit)
        bare = _without(fit, name, specs(cls)[cls.amplitude].null or 0.0)
        picture = signature(bare, law(fit, (), tag), parts)
    gain = fit.climbed.gains.get(tag)
    rung = max((i for i, r in enumerate(fit.climbed.ladder) if r.added == tag), default=0)
    rungs = fit.ladder.iloc[[rung - 1, rung]] if rung else fit.ladder.iloc[:0]
    pairs = rungs[["unseen error", "unseen std"]].to_numpy(float)
    errors = [shown_with(*pair) for pair in pairs] if np.isfinite(pairs[:, 0]).all() else []
    return {
        **_empty(tag, chosen),
        "on": True,
        "share": 1.0,
        "gain": "in the model" if gain is None else f"in the model, gained {gain:.0f}",
        "unseen": f"error on unseen runs {' to '.join(errors)}" if errors else "",
        "picture": picture,
        "amplitude": f"{name.partition('.')[2].replace('_', ' ')} {size}" if size else "",
    }


def _gains(known: dict[str, Any]) -> dict[str, Any]:
    unseen = known.get("unseen gain", np.nan)
    size = ""
    if np.isfinite(known.get("amplitude", np.nan)):
        unit = known.get("unit") or "1"
        size = shown_with(known["amplitude"], known["std"], unit)
    return {
        "gain": f"gains {known['gain']:.0f} when fitted",
        "unseen": f"on unseen runs {unseen:.0f} ± {known.get('+-', np.nan):.0f}" if np.isfinite(unseen) else "",
        "amplitude": size,
    }


def _empty(tag: str, chosen: str) -> dict[str, Any]:
    cls = catalogue.get(tag) if tag in catalogue.tags() else None
    words = cls.summary or (cls.__doc__ or "").strip().partition("\n")[0] if cls is not None else ""
    others = list(catalogue.confused(tag)) if cls is not None else []
    return {
        "tag": tag, "form": tag, "words": words, "share": 0.0, "gain": "", "unseen": "", "amplitude": "",
        "similar": f"similar to {', '.join(others[:3])}" if others else "", "picture": [], "on": False,
        "chosen": tag == chosen,
    }  # fmt: skip


def _share(fall: float, top: float) -> float:
    """Length of the bar: the root, so that a tenth of the best can still be seen."""
    return float(np.sqrt(np.clip(fall / top, 0.0, 1.0))) if np.isfinite(fall) else 0.0
