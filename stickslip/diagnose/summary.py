"""A diagnosis as plain numbers and words: what goes into ``result.json``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..effects import catalogue
from ..fit import multistart
from ..fit.record import KEY, fitted, record
from ..fit.solved import solved
from ..floors import scatter_factor
from . import experiment
from .candidate import Candidate
from .caution import cautions
from .engine import Diagnosis, Round
from .experiment import TELLING, recommend_among
from .menu import Conditions
from .rungs import Rung
from .verdict import passed_over


def summary(
    diagnosis: Diagnosis,
    rig: Any = None,
    asked: Sequence[str] = (),
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """The verdict, the ladder, the ranking, parameters with units, what to measure next, and the last model.

    Args:
        diagnosis: what was found.
        rig: ``[rig]`` of the campaign, for the load on a contact.
        asked: tags the user wanted tried.
        progress: told what is simulated for the next experiment, and the share done.
    """
    d = diagnosis
    used = np.asarray(d.measurement.cycles.used)
    last = next((r for r in reversed(d.ladder) if r.fit is not None), None)
    return {
        "schema": 1,
        "verdict": {
            "kind": d.verdict.kind,
            "effects": list(d.verdict.effects),
            "set": list(d.verdict.set),
            "text": d.verdict.text,
            "reasons": list(d.verdict.reasons),
            "confidence": d.verdict.confidence,
            "forms": {tag: dict(form) for tag, form in d.verdict.forms.items()},
        },
        "caution": cautions(d, asked),
        "ladder": [_rung(r) for r in d.ladder],
        "ranking": _ranking(d.rounds[0]) if d.rounds else [],
        "ranking_base": _ranking_base(d.rounds[0]) if d.rounds else None,
        "later_rounds": [{"base": _ranking_base(r), "ranking": _ranking(r)} for r in d.rounds[1:]],
        "parameters": {} if last is None else _parameters(last),
        "next_experiment": next_experiment(d, progress),
        "seeds": {"starts": multistart.SEED, "draws": experiment.SEED},
        "held_out": {
            n: [int(k) for k in (~d.train[r] & used[r]).nonzero()[0]] for r, n in enumerate(d.measurement.names)
        },
        "dropped": list(d.dropped),
        **({} if last is None else _model(last, d, rig)),
    }


def _model(rung: Rung, d: Diagnosis, rig: Any) -> dict[str, Any]:
    """The last model, so that it can be made again, and the equations it solves."""
    assert rung.composition is not None
    assert rung.fit is not None
    found = fitted(rung.composition, rung.fit, d.measurement, rig)
    words = solved(found)
    return {"equations": [{"text": words.text(), "latex": words.latex()}], KEY: record(found)}


def _rung(rung: Rung) -> dict[str, Any]:
    return {
        "model": list(rung.model),
        "added": rung.added,
        "removed": rung.removed,
        "train_error": rung.train.total,
        "heldout_error": None if rung.held is None else rung.held.error,
        "by_phase": rung.train.by_phase,
        "heldout_by_phase": {} if rung.held is None else rung.held.by_phase,
        "by_run": rung.train.by_run,
        "alike": rung.train.alike,
    }


def _ranking(done: Round) -> list[dict[str, Any]]:
    """Candidates of a round, the best first; those that were not refitted last."""
    order = sorted(done.candidates, key=lambda c: (bool(c.note), -c.promise if c.note else c.cost))
    return [_ranked(c, done) for c in order]


def _ranking_base(done: Round) -> dict[str, Any]:
    """What the candidates of a round were added to."""
    base = done.base
    assert base.fit is not None
    held = None if base.held is None else base.held.error
    return {"model": list(base.model), "cost": base.fit.cost, "train_error": base.train.total, "heldout_error": held}


def _ranked(c: Candidate, done: Round) -> dict[str, Any]:
    out: dict[str, Any] = {
        "effect": c.tag,
        "form": c.form,
        "score": c.score,
        "promise": c.promise,
        "refit": c.fit is not None and not c.note,
        "note": c.note,
        "heldout_gain": None,
        "amplitude": None,
    }
    if c.fit is None or c.held is None or c.train is None or c.note:
        return out
    base = done.base.held
    gain = np.zeros(0) if base is None else base.per_cycle - c.held.per_cycle
    gain = gain[np.isfinite(gain)]
    judged = next((j for j in done.judged if j.candidate is c), None)
    forms = [e for e in done.every if e.tag == c.tag and e.fit is not None and not e.note]
    out |= {
        "cost": c.fit.cost,
        "train_error": c.train.total,
        "heldout_error": c.held.error,
        "heldout_gain": None if base is None else 1.0 - c.held.score / base.score,
        "heldout_gain_std": None
        if base is None or gain.size < 2
        else float(np.std(gain, ddof=1) / np.sqrt(gain.size) / base.score),
        "heldout_cycles": int(gain.size),
        "failures": [] if judged is None else list(passed_over(judged, done.judged)),
        "forms": [{"form": e.form, "cost": e.cost} for e in sorted(forms, key=lambda e: e.cost)],
    }
    if c.amplitude is not None:
        name = c.amplitude.name
        std = c.fit.std()[name]
        out["amplitude"] = {"name": name, "value": c.fit.values[name], "std": std, "unit": c.amplitude.unit}
    return out


def _parameters(rung: Rung) -> dict[str, Any]:
    assert rung.fit is not None
    sd = rung.fit.std()
    values = rung.fit.values
    return {f.name: {"value": values[f.name], "std": sd[f.name], "unit": f.unit, "doc": f.doc} for f in rung.fit.free}


def next_experiment(d: Diagnosis, progress: Callable[[str, float], None] | None = None) -> dict[str, Any] | None:
    """For effects these data cannot tell apart: the experiment in which their fitted models differ most.

    With several sets it is that of the first, and in ``others`` those of the others.
    """
    if not d.sets:
        return None
    first, *others = (_separating(rivals, d, progress) for rivals in d.sets)
    return {**first, "others": others} if others else first


def _separating(
    rivals: Sequence[Candidate], d: Diagnosis, progress: Callable[[str, float], None] | None
) -> dict[str, Any]:
    """Where none of the menu tells them apart, what the catalogue knows of the first two comes first."""
    a, b = (catalogue.get(c.tag) for c in rivals[:2])
    known = catalogue.alike(a.tag).get(b.tag)
    fitted = [c for c in rivals if c.fit is not None and c.composition is not None]
    if len(fitted) > 1:
        factor = 1.0 + min(scatter_factor(d.measurement), 1.0)
        found = recommend_among(fitted, Conditions.of(d.measurement), factor=factor, progress=progress)
        if found["floors"] < TELLING and known is not None and len(fitted) == 2:
            found["text"] = f"{known} ({found['text']})"
        return found
    text = "add what this campaign lacks: another velocity (a factor of 4), holds of 1 s and 10 s, a virgin start"
    return {"text": known or text, "separates": [c.tag for c in rivals[:2]]}
