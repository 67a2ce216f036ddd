"""A diagnosis as plain numbers and words: what goes into ``result.json``, and the arrays behind its pictures."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from ...data.campaign import Rig
from ...physics.effects import catalogue
from ...system.units import shown
from ..fit.composition import run_of
from ..fit.equations import solved
from ..fit.serialised import KEY, Fitted, record
from ..force.composition import PULL
from ..force.errors import of_all, sums
from ..force.fit import Fit
from ..force.heldout import heldout_residual
from ..force.jumps import jumps
from ..force.knots import PHASES
from ..force.linearised import Array
from ..force.prescribed import placeholders
from ..force.residual import coordinates
from .backbone_laws import Law, named_text, section
from .decide import CHANCE, ERRORS, Judged, best_forms
from .free_errors import errors
from .free_report import cautions, free_variables, left_out
from .model_record import fitted_model
from .search import Rung
from .search_round import Round
from .stepwise_selection import Diagnosis
from .wandering_level import TAG

Variables = dict[str, Any]
FARTHER = "the prediction error on left-out runs rises when the random effects of events are set to zero"
LISTED = 6  # effects whose smallest visible amplitude is said in the verdict


def summary(d: Diagnosis, rig: Rig) -> tuple[dict[str, Any], Variables]:
    """The result, and the variables of its arrays.

    Args:
        d: what was found.
        rig: of the campaign.
    """
    sections, arrays, _ = fitted_sections(d, rig)
    first = d.rounds[0]
    result = {
        "schema": 1,
        "verdict": {
            "kind": d.verdict.kind,
            "effects": list(d.verdict.effects),
            "set": list(d.verdict.set),
            "text": verdict_text(d),
            "reasons": reasons(d),
            "confidence": None,
            "forms": {tag: dict(r.close[0].candidate.form) for tag, r in d.named.items()}
            | {law.tag: dict(law.shaped.form) for law in _of_shape(d)[:1]}
            | ({TAG: d.level.form} if TAG in d.verdict.effects and d.level is not None else {}),
        },
        "in_time": d.in_time,
        "ranking": _ranking(first, d.ladder[1], d),
        "ranking_base": _ranking_base(first, d.ladder[1], d),
        "later_rounds": [
            {"base": _ranking_base(r, rung, d), "ranking": _ranking(r, rung, d)}
            for r in d.rounds[1:]
            for rung in d.ladder[2:]
            if rung.fit is r.base
        ],
        "visible": visible(d),
        "structure": _structure(d),
        "next_experiment": next_experiment(d),
        "seeds": {},
        **sections,
    }
    return result, arrays


def fitted_sections(d: Diagnosis, rig: Rig) -> tuple[dict[str, Any], Variables, Fitted]:
    """What there is to say of a ladder of fits, however its effects were chosen.

    Args:
        d: the ladder; its rounds may be missing.
        rig: of the campaign.

    Returns:
        Entries of the result, the variables of its arrays, and the last model to be simulated.
    """
    found = fitted_model(d.fit, d.shape.power, d.prepared.traces, int(rig.contacts or 1), rig)
    words = solved(found)
    result = {
        "caution": [
            *([] if d.in_time else ["the time limit came before all effects were tried: this is the best so far"]),
            *cautions(d.confirmation, {r.model: error(r.unseen, d) for r in d.ladder[1:] if r.unseen is not None}),
        ],
        "ladder": [_rung(r, d) for r in d.ladder],
        "scatter": d.fit.scatter.named() | ({} if d.level is None else d.level.plain()),
        "parameters": parameters(d.fit, found, rig),
        "backbone": section(d.shape),
        "held_out": "every run in turn; in halves if a run has its own parameters",
        "kept_aside": list(d.prepared.aside),
        "dropped": [*d.dropped, *jumps(d.fit), *left_out(d.confirmation)],
        "equations": [{"text": words.text(), "latex": words.latex()}],
        KEY: record(found),
    }  # fmt: skip
    return result, variables(d), found


def error(residual: Array, d: Diagnosis, where: np.ndarray | None = None) -> float:
    """Root mean square of a residual force over its floor; what was dropped does not count."""
    use = ~d.fit.dropped if where is None else where & ~d.fit.dropped
    return float(np.sqrt(np.mean((residual[use] / d.floor[use]) ** 2))) if use.any() else float("nan")


def by_phase(residual: Array, d: Diagnosis) -> dict[str, float]:
    """The same in each phase of the cycle."""
    phase = d.fit.problem.phase
    return {name: error(residual, d, phase == i) for i, name in enumerate(PHASES) if (phase == i).any()}


def _chance(residual: Array, d: Diagnosis) -> float:
    """Standard deviation of :func:`error`, by how much events differ."""
    return of_all(sums(d.fit, residual, d.floor))[1]


def _rung(rung: Rung, d: Diagnosis) -> dict[str, Any]:
    run = d.fit.problem.run
    return {
        "model": list(rung.model),
        "added": rung.added,
        "removed": rung.removed,
        "train_error": error(rung.residual, d),
        "train_error_std": _chance(rung.residual, d),
        "heldout_error": None if rung.unseen is None else error(rung.unseen, d),
        "heldout_error_std": None if rung.unseen is None else _chance(rung.unseen, d),
        "by_phase": by_phase(rung.residual, d),
        "heldout_by_phase": {} if rung.unseen is None else by_phase(rung.unseen, d),
        "by_run": {k.name: error(rung.residual, d, run == r) for r, k in enumerate(d.prepared.runs)},
        "force_error": float(np.sqrt(np.mean(rung.residual[~d.fit.dropped] ** 2)) / d.fit.strength),
        "cost": None if rung.fit is None else rung.fit.cost,
        "free": _free(rung.model, d),
    }


def _free(model: tuple[str, ...], d: Diagnosis) -> dict[str, Any] | None:
    """Errors of a model that was run freely."""
    found = d.confirmation.models.get(model)
    return None if found is None else errors(d.confirmation, found)


def _ranking_base(done: Round, rung: Rung, d: Diagnosis) -> dict[str, Any]:
    assert rung.unseen is not None
    held = error(rung.unseen, d)
    return {
        "model": list(rung.model), "cost": done.base.cost, "train_error": error(rung.residual, d),
        "heldout_error": held,
    }  # fmt: skip


def _ranking(done: Round, rung: Rung, d: Diagnosis) -> list[dict[str, Any]]:
    """Effects of a round in their best form, the best first; then those that were not fitted."""
    best = best_forms(done.judged)
    close = {id(j) for j in done.close}
    rows = sorted(best, key=lambda j: (id(j) not in close, -float(j.gain)))
    fitted = {j.tag for j in best}
    left = {c.tag: c for c in done.candidates if c.tag not in fitted}
    return [*(_ranked(j, done, rung, d) for j in rows), *(_not_ranked(c.tag, c.form, c.note) for c in left.values())]


def _ranked(j: Judged, done: Round, rung: Rung, d: Diagnosis) -> dict[str, Any]:
    assert j.candidate.fit is not None
    fit = copy(j.candidate.fit)  # what is large and found for it goes with the copy
    spec = catalogue.amplitude(catalogue.get(j.tag))
    total = float(j.unseen.sum())
    return {
        "effect": j.tag,
        "form": dict(j.candidate.form),
        "score": None,
        "promise": j.candidate.promise,
        "refit": True,
        "note": "",
        "cost": fit.cost,
        "gain": j.gain,
        "chance": j.chance,
        "train_error": error(fit.marginal, d),
        "heldout_error": error(heldout_residual(fit), d),
        "heldout_gain": total / max(abs(j.gain), 1e-300) if j.gain > 1.0 else 0.0,
        "heldout_gain_std": j.error / max(abs(j.gain), 1e-300) if j.gain > 1.0 else 0.0,
        "heldout_cost": total,
        "heldout_cost_std": j.error,
        "heldout_cycles": int(j.unseen.size),
        "failures": failures(j, done),
        "forms": [
            {"form": dict(o.candidate.form), "cost": done.base.cost - o.gain} for o in done.judged if o.tag == j.tag
        ],
        "amplitude": {"name": j.candidate.name, "value": j.amplitude, "std": j.std, "unit": spec.unit},
        "visible": j.candidate.visible,
        "free": _free((*rung.model, j.tag), d),
    }


def _not_ranked(tag: str, form: dict[str, str], note: str) -> dict[str, Any]:
    return {
        "effect": tag, "form": dict(form), "score": None, "refit": False, "note": note or "not tried in time",
        "heldout_gain": None, "amplitude": None,
    }  # fmt: skip


def nearest_text(j: Judged) -> str:
    """That an effect explains the data best, but not in its range, or not what all events have in common."""
    amount = shown(j.amplitude, catalogue.amplitude(catalogue.get(j.tag)).unit, 3)
    nearest = f"{j.tag} comes nearest, with {j.candidate.name} = {amount}"
    if j.inside:
        return (
            f"Something is missing that no effect of the catalogue explains alone: {nearest}, which raises the "
            "likelihood within events but predicts left-out events worse."
        )
    return (
        f"Something is missing that no effect of the catalogue explains in its range: {nearest}, at a bound or within "
        "one standard deviation of it."
    )


def failures(j: Judged, done: Round) -> list[str]:
    """Why an effect is not named, in words; nothing where it is."""
    if any(j is c for c in done.close):
        return [] if j is done.close[0] else [f"these data cannot distinguish it from {done.close[0].tag}"]
    out = []
    if j.chance >= CHANCE:
        out.append(f"a gain of this size occurs by chance with probability {j.chance:.2g}")
    if j.better <= ERRORS * j.error:
        out.append(f"unseen runs are not predicted better by more than {ERRORS:g} standard errors")
    if j.likely and not j.inside:
        out.append("its amplitude is not inside its bounds by more than its standard deviation")
    if j.likely and not j.no_farther:
        out.append(FARTHER)
    if out and j.odd:
        out.append(f"{' and '.join(j.odd)} would be outside {'its' if len(j.odd) == 1 else 'their'} usual range")
    beyond = done.beyond
    if not out and beyond is not None:
        reason = FARTHER if beyond.inside else "at its bound"
        out.append(f"{beyond.tag} makes unseen runs more likely, but {reason}")
    if not out and done.close:
        out.append(f"{done.close[0].tag} predicts unseen runs better")
    return out


def reasons(d: Diagnosis) -> list[str]:
    """What the naming of each effect rests on."""
    out = [d.level.reason] if d.level is not None and TAG in d.verdict.effects else []
    for done in d.named.values():
        if done.close:
            j = done.close[0]
            out.append(
                f"{j.tag}: the cost falls by {j.gain:.0f} (probability by chance {j.chance:.1g}), on unseen runs by "
                f"{float(j.unseen.sum()):.0f} +- {j.error:.0f}"
            )
    out += [
        f"{law.tag}: chi-square of the backbone falls by {law.gain:.0f} (probability by chance {law.chance:.1g})"
        for law in _of_shape(d)[:1]
    ]
    return out


def visible(d: Diagnosis) -> dict[str, dict[str, Any]]:
    """Tag -> the smallest amplitude of an effect that the last model would have shown (five standard deviations)."""
    out: dict[str, dict[str, Any]] = {}
    for c in d.rounds[-1].candidates:
        if c.visible is None:
            continue
        unit = catalogue.amplitude(catalogue.get(c.tag)).unit
        known = out.get(c.tag)
        if known is None or c.visible < known["amplitude"]:
            out[c.tag] = {"amplitude": c.visible, "unit": unit, "form": dict(c.form)}
    if d.shape.stated:
        out |= {
            law.tag: {"amplitude": law.shaped.visible, "unit": law.shaped.free.unit, "form": dict(law.shaped.form)}
            for law in d.shape.laws
            if law.shaped.visible is not None
        }
    return out


def verdict_text(d: Diagnosis) -> str:
    """The answer in a few sentences."""
    v, last, base = d.verdict, d.ladder[-1], d.ladder[1]
    if d.wrong:
        found = " ".join(finding.sentence for finding in d.wrong)
        if not any(done.candidates for done in d.rounds):
            return f"{found} Correct this first: no effect is tried, because it would only compensate the wrong entry."
        ambiguity = f" These data cannot distinguish this from {' or '.join(v.set)}." if v.set else ""
        return f"{found} No effect predicts unseen runs better than that.{ambiguity}"
    before, after = (error(r.unseen, d) for r in (base, last) if r.unseen is not None)
    parts = [] if d.level is None else [d.level.text]
    if d.named:
        amounts = []
        for tag in d.named:
            name = f"{tag}.{catalogue.get(tag).amplitude}"
            unit = catalogue.amplitude(catalogue.get(tag)).unit
            value, std = d.fit.values[name], d.fit.std()[name]
            amounts.append(f"{name} = {shown(value, unit, 3)} +- {shown(std, unit, 2)}")
        parts.append(
            f"Adding {' and '.join(d.named)} takes the error on unseen runs from {before:.3g} to {after:.3g} floors "
            f"({'; '.join(amounts)})."
        )
    if _of_shape(d):
        parts.append(named_text(d.shape))
    if v.kind == "ambiguous":
        parts.append("These data cannot distinguish " + "; nor ".join(" from ".join(s) for s in _sets(d)) + ".")
    if v.beyond is not None:
        parts.append(nearest_text(v.beyond))
    if v.kind == "unknown" and v.structure is not None:
        parts.append(
            f"Something is missing that no effect of the catalogue explains: the residual force depends on the "
            f"{v.structure.variable} (probability by chance {v.structure.chance:.1g})."
        )
    if v.misfit is not None:
        phase, share = v.misfit
        parts.append(
            f"Something is missing that no effect of the catalogue explains: in {phase} the model is off by "
            f"{100.0 * share:.2g} % of the strength, with correlated neighbouring points."
        )
    if v.kind in ("complete", "missing"):
        seen = sorted(visible(d).items(), key=lambda item: item[0])
        some = "; ".join(f"{tag} {shown(a['amplitude'], a['unit'], 2)}" for tag, a in seen[:LISTED])
        more = f"; and {len(seen) - LISTED} more in the report" if len(seen) > LISTED else ""
        parts.append(
            f"No {'other ' if v.effects else ''}effect above its detection limit (five standard deviations: "
            f"{some}{more})."
        )
    return " ".join(parts)


def _sets(d: Diagnosis) -> list[list[str]]:
    """Tags of effects that these data cannot distinguish."""
    every = [*([j.tag for j in r.close] for r in d.named.values()), [law.tag for law in _of_shape(d)]]
    return [tags for tags in every if len(tags) > 1]


def _of_shape(d: Diagnosis) -> tuple[Law, ...]:
    """What the backbone names, and what it cannot distinguish from it; nothing where the rig is too wrong."""
    return () if d.wrong else d.shape.close


def next_experiment(d: Diagnosis) -> dict[str, Any] | None:
    """For effects that these data cannot distinguish: what the catalogue knows to separate them."""
    sets, made = _sets(d), []
    for close in sets:
        a, b = close[:2]
        known = catalogue.confused(a).get(b)
        text = known or "add what this campaign lacks: another velocity (a factor of 4), holds of 1 s and 10 s"
        made.append({"text": text, "separates": close})
    made += [] if d.level is None or d.level.experiment is None else [d.level.experiment]
    if not made:
        return None
    return {**made[0], "others": made[1:]} if len(made) > 1 else made[0]


def _structure(d: Diagnosis) -> dict[str, Any] | None:
    s = d.verdict.structure
    if s is None:
        return None
    return {
        "variable": s.variable, "unit": s.unit, "chance": s.chance, "at": s.at.tolist(), "force": s.force.tolist(),
    }  # fmt: skip


def parameters(fit: Fit, found: Fitted, rig: Rig) -> dict[str, dict[str, Any]]:
    """Value, standard deviation, unit and meaning of every parameter, fixed ones that were given included."""
    out: dict[str, dict[str, Any]] = {}
    values, std = found.values, found.std
    for f, z in zip(found.composition.free, found.z, strict=True):
        if run_of(f.name) is not None:
            continue
        low, high = f.bounds
        note = ""
        left, unsure = min(z - low, high - z), std[f.name] / abs(f.slope(float(z)))
        if np.isfinite([low, high]).all() and left < 1e-3 * (high - low) and left <= unsure:
            note = "at its bound"
        elif f.name.startswith("contact.") and f.name != "contact.strength":
            note = "of the law fitted to the measured backbone"
        elif np.isfinite(f.width) and unsure > 0.8 * f.width:
            note = "not determined by the data: this is its prior"
        note = "; ".join(filter(None, [note, f.unusual(values[f.name], std[f.name])]))
        out[f.name] = {"value": values[f.name], "std": std[f.name], "unit": f.unit, "doc": f.doc, "note": note}
    for name, value in found.composition.fixed.items():
        unit = "N/m" if name.endswith("stiffness") else "1"
        out[name] = {"value": value, "std": 0.0, "unit": unit, "doc": "", "note": "given"}
    mass = {"value": found.composition.mass, "std": 0.0, "unit": "kg", "doc": "mass of the block", "note": "given"}
    out.setdefault("rig.mass", mass)
    for name in placeholders(fit.problem, rig):
        del out[name]
    assert PULL not in out
    return out


def variables(d: Diagnosis) -> Variables:
    """Arrays of the pictures: measured and model force at the points of every run, the backbone."""
    out: Variables = {}
    problem = d.fit.problem
    base = d.ladder[1].fit
    assert base is not None
    where = coordinates(d.fit)
    for r, run in enumerate(d.prepared.runs):
        own = problem.run == r
        dim = f"force{r}_point"
        held = d.fit.forces.held[own]
        for name, values, unit in (
            ("time", problem.at[own], "s"),
            ("model", held, "N"),
            ("measured", held + d.fit.residual[own], "N"),
            ("residual", d.fit.marginal[own], "N"),
            ("base_residual", base.marginal[own], "N"),
            ("floor", d.floor[own], "N"),
            ("phase", problem.phase[own], "1"),
            ("event", run.of, "1"),
            ("displacement", where["displacement"][own], "m"),
            ("velocity", where["velocity"][own], "m/s"),
            ("spring_force", where["spring force"][own], "N"),
            ("time_in_contact", where["time in contact"][own], "s"),
        ):
            out[f"force{r}_{name}"] = (dim, np.asarray(values), {"units": unit})
    curve, line = d.shape.curve, d.shape.line
    for name, values, unit in (
        ("displacement", curve.displacement, "m"), ("force", curve.force, "N"), ("std", curve.std, "N"),
        ("law", d.shape.power.force, "N"), *([] if line is None else [
            ("line", line.force, "N"), ("line_later", line.scatter[0], "N"), ("line_sooner", line.scatter[1], "N"),
        ]),
    ):  # fmt: skip
        out[f"backbone_{name}"] = ("backbone_point", values, {"units": unit})
    return out | free_variables(d.confirmation, d.prepared, d.ladder[1].model, d.ladder[-1].model)
