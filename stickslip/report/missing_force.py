"""The missing force in a ``result.json``: its curves, and with a learned force what that does to unseen cycles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..diagnose.engine import Diagnosis
from ..diagnose.missing_force import Curve, MissingForce, again, curves, learn, rung
from ..diagnose.pieces import fit_arrays, fit_from
from ..diagnose.rungs import Rung
from ..diagnose.sweep import Store
from ..diagnose.thresholds import THRESHOLDS
from ..diagnose.verdict import is_complete
from ..errors import FitError, StickslipError
from ..fit.record import KEY, fitted, record
from ..fit.solved import solved
from .pieces import Variables

LABEL = (
    "A display and no proof: smooth functions of displacement, velocity and time in contact, fitted to what the model "
    "leaves over, with everything in the model free. Other laws may leave the same. The verdict does not use them."
)
NO_EXPLANATION = (
    "The learned force is for prediction and is not an explanation: it repeats what these data show, under the "
    "conditions they were taken in, and names no cause. It takes no part in the verdict."
)
STANDS_OUT = 3.0  # standard deviations
Tell = Callable[[str, float], None]
_WORDS = {"displacement": "displacement", "velocity": "velocity", "time in contact": "age"}
_UNITS = {"displacement": "m", "velocity": "m/s", "time in contact": "s"}


def missing_sections(
    diagnosis: Diagnosis,
    store: Store | None = None,
    *,
    learn_residual: bool = False,
    rig: Any = None,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[dict[str, Any], Variables]:
    """Entries of ``result.json`` and the variables behind the picture.

    Args:
        diagnosis: what was found; it is not changed.
        store: keeps finished pieces.
        learn_residual: whether a force that may be used for prediction is fitted as well.
        rig: ``[rig]`` of the campaign, for the load on a contact.
        progress: told what goes on and the share of the work done.
    """
    d, tell = diagnosis, progress or (lambda text, share: None)
    fitted_rungs = [r for r in d.ladder if r.fit is not None]
    base, top = fitted_rungs[0], fitted_rungs[-1]
    shown: list[dict[str, Any]] = []
    variables: Variables = {}
    found: MissingForce | None = None
    try:
        # of a model that is complete nothing is missing; only what may be used for prediction is fitted on top of it
        last = top is not base and (learn_residual or not is_complete(top.train, top.held))
        for r in (base, top) if last else (base,):
            found = _piece(
                f"missing-{len(r.model)}", r, d, store, None, tell, f"force missing from {' + '.join(r.model)}"
            )
            worst = max(rung(found, r, d.measurement, d.floor, d.train).train.by_phase.values())
            if worst > THRESHOLDS.failed:
                what = f"the fit failed ({worst:.0f} floors), and no smooth force mends that"
                raise FitError(f"what {' + '.join(r.model)} leaves over is no force: {what}")
            parts = curves(found)
            variables |= _variables(parts, len(shown))
            shown.append({"model": list(r.model), "parts": {name: _largest(name, c) for name, c in parts.items()}})
    except StickslipError as error:
        text = f"Not drawn: {error}"
        nothing = {"learned_residual": {"text": f"Nothing was learned: {error}"}} if learn_residual else {}
        return {"missing_force": {"label": LABEL, "text": text, "shown": []}, **nothing}, {}
    out: dict[str, Any] = {"missing_force": {"label": LABEL, "text": _text(shown), "shown": shown}}
    if learn_residual:
        out["learned_residual"] = _learned(top, found, d, store, rig, tell)
    return out, variables


def _piece(
    name: str, r: Rung, d: Diagnosis, store: Store | None, begin: MissingForce | None, tell: Tell, stage: str
) -> MissingForce:
    """Fitted, or taken up from a finished piece; with ``begin`` the force that may be used for prediction."""
    assert r.composition is not None
    assert r.fit is not None
    where = (r.composition, r.fit, d.measurement, d.floor, d.train)
    kept = store.load(name) if store is not None else None
    if kept is not None:
        return again(*where, fit_from(kept))
    tell(stage, 0.0)
    found = learn(*where, begin=begin, progress=lambda text, share: tell(f"{stage}, {text}", share))
    if store is not None:
        store.save(name, fit_arrays(found.fit))
    return found


def _variables(parts: dict[str, Curve], number: int) -> Variables:
    out: Variables = {}
    for name, curve in parts.items():
        key = f"missing{number}_{_WORDS[name]}"
        out[f"{key}_at"] = (key, curve.at, {"units": _UNITS[name]})
        out[f"{key}_force"] = (key, curve.force, {"units": "N"})
        out[f"{key}_std"] = (key, curve.std, {"units": "N"})
        out[f"{key}_seen"] = (f"{key}_data", curve.seen, {"units": _UNITS[name]})
    return out


def _largest(name: str, curve: Curve) -> dict[str, Any]:
    """Where the force stands out most."""
    inside = (curve.at >= curve.seen.min()) & (curve.at <= curve.seen.max()) & (curve.std > 0.0)
    score = np.where(inside, np.abs(curve.force) / np.where(curve.std > 0.0, curve.std, 1.0), 0.0)
    i = int(np.argmax(score))
    return {
        "at": float(curve.at[i]), "unit": _UNITS[name], "force": float(curve.force[i]), "std": float(curve.std[i]),
        "stands_out": bool(score[i] > STANDS_OUT),
    }  # fmt: skip


def _text(shown: list[dict[str, Any]]) -> str:
    lines = []
    for entry in shown:
        model = " + ".join(entry["model"])
        out = [name for name, part in entry["parts"].items() if part["stands_out"]]
        if out:
            lines.append(f"What {model} leaves over stands out of its uncertainty in: {', '.join(out)}.")
        else:
            lines.append(f"What {model} leaves over is nowhere larger than {STANDS_OUT:g} standard deviations.")
    return " ".join(lines)


def _learned(
    top: Rung, begin: MissingForce | None, d: Diagnosis, store: Store | None, rig: Any, tell: Tell
) -> dict[str, Any]:
    try:
        found = _piece("learned", top, d, store, begin, tell, "learning the residual force")
    except StickslipError as error:
        return {"text": f"Nothing was learned: {error}"}
    after = rung(found, top, d.measurement, d.floor, d.train)
    assert top.held is not None
    assert after.held is not None
    made = fitted(found.composition, found.fit, d.measurement, rig)
    words = solved(made)
    change = (
        f"The error on unseen cycles goes from {top.held.error:.2f} to {after.held.error:.2f} floors, on fitted ones "
        f"from {top.train.total:.2f} to {after.train.total:.2f}."
    )
    if not after.held.error < top.held.error:
        change += " It predicts no better than the model without it: do not use it."
    return {
        "text": f"{change} {NO_EXPLANATION}",
        "ladder": [_step(top), _step(after)],
        "equations": [{"text": words.text(), "latex": words.latex()}],
        KEY: record(made),
    }


def _step(r: Rung) -> dict[str, Any]:
    assert r.held is not None
    return {
        "model": list(r.model), "train_error": r.train.total, "heldout_error": r.held.error,
        "by_phase": r.train.by_phase, "heldout_by_phase": r.held.by_phase,
    }  # fmt: skip
