"""The dynamic model's part of a ``result.json``, and its arrays: parameters, misfit, overlays, residuals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..features.layout import PHASES
from ..features.measurement import Measurement
from ..fit.composition import Composition, run_of
from ..fit.effective import EffectiveLine, effective_line
from ..fit.inertial import Fit
from ..fit.overlay import ModelledRun, modelled_runs
from ..fit.parameters import to_si
from ..fit.problem import Problem
from ..fit.static_table import StaticRig
from ..fit.surface import sensitivity, surface_prior
from ..residual import Misfit, misfit
from ..segment import Segmentation, thin
from ..trace import Trace
from ..uncertainty import flat_directions, null_directions, relative
from ..units import shown
from .describe import describe_trace
from .pieces import ZOOM, Variables, middle_event, trace_pieces
from .sentences import misfit_sentence, phase_table

CONTACT = ("contact.u_max", "contact.p", "contact.spread")


def parameters(composition: Composition, fit: Fit) -> dict[str, dict[str, Any]]:
    """Value, standard deviation, unit and meaning of every parameter, fixed ones included."""
    values, std = fit.values, fit.std()
    out: dict[str, dict[str, Any]] = {}
    for f, z in zip(fit.free, fit.z, strict=True):
        low, high = f.bounds
        note = ""
        if min(z - low, high - z) < 1e-3 * (high - low):
            note = "at its bound"
        elif np.isfinite(f.width) and std[f.name] / max(abs(f.slope(float(z))), 1e-300) > 0.8 * f.width:
            note = "not determined by the data: this is its prior"
        note = "; ".join(filter(None, [note, f.unusual(values[f.name], std[f.name])]))
        out[f.name] = {"value": values[f.name], "std": std[f.name], "unit": f.unit, "doc": f.doc, "note": note}
    for name, value in composition.fixed.items():
        out[name] = {
            "value": value,
            "std": 0.0,
            "unit": "N/m" if name.endswith("stiffness") else "1",
            "doc": "",
            "note": "given",
        }
    given = {"value": composition.mass, "std": 0.0, "unit": "kg", "doc": "mass of the block", "note": "given"}
    out.setdefault("rig.mass", given)
    return out


def identifiability(fit: Fit, rig: Any, line: dict[str, Any] | None) -> list[str]:
    """The identifiability table in words: directions that the fit leaves open, and what is behind u_max and p.

    Args:
        fit: its covariance, and so its words, are those of the data and the priors together.
        rig: of the campaign.
        line: (H, h_rms) that the fit implies, from `effective`.
    """
    shared = [i for i, f in enumerate(fit.free) if run_of(f.name) is None]
    free, z = [fit.free[i] for i in shared], [float(fit.z[i]) for i in shared]
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


def effective(fit: Fit, rig: Any, contacts: int) -> dict[str, Any] | None:
    """(H, h_rms) implied by the fitted (u_max, p, spread); None where load or friction is not known at all.

    Standard deviations are those of the fit alone: how other lines of the same surface would differ is not in them.
    """
    values = fit.values
    try:
        known = StaticRig.of(rig, spring_stiffness=1.0)
    except InputError:
        return None
    known = replace(known, contacts=contacts)
    fitted = known.guessed == ("friction_coefficient",)
    if fitted:
        known = replace(known, friction=values["contact.strength"] / (contacts * known.normal_force))

    def line_of(values: dict[str, float]) -> EffectiveLine:
        u_max, p, spread = (values.get(name, 0.0) for name in CONTACT)
        return effective_line(u_max, p, known, spread)

    line = line_of(values)
    hurst_std, rms_std = _line_std(fit, line_of)
    unequal = f", spread over {contacts} contacts by {values[CONTACT[2]]:.2g}" if CONTACT[2] in values else ""
    text = (
        f"Effective rough line of a contact with u_max = {shown(values['contact.u_max'], 'm', 3)} and p = "
        f"{values['contact.p']:.3g}{unequal}: H = {line.hurst:.2f} +- {hurst_std:.2f}, h_rms = "
        f"{shown(line.h_rms, 'm', 3)} +- {shown(rms_std, 'm', 2)}, for L = {shown(line.length, 'm')}, "
        f"N = {line.n_springs}, F_n = {known.normal_force:.3g} N and friction {known.friction:.3g}"
        f"{' (from the fitted strength)' if fitted else ' (guessed)' if known.guessed else ''}; {line.note}."
        " The deviations are of the fit alone: other lines of the same surface differ by more."
    )
    prior = surface_prior(rig)
    return {
        "text": text if prior is None else f"{text} {prior.text}",
        "H": line.hurst,
        "H_std": hurst_std,
        "h_rms": line.h_rms,
        "h_rms_std": rms_std,
        "N": line.n_springs,
        "L": line.length,
        "mismatch": line.mismatch,
        "contacts": contacts,
    }


def _line_std(fit: Fit, line_of: Callable[[dict[str, float]], EffectiveLine]) -> tuple[float, float]:
    """Standard deviations of H and h_rms (m): differences one deviation to either side on the covariance's axes."""
    at = [i for i, f in enumerate(fit.free) if f.name in CONTACT]
    low, high = np.array([fit.free[i].bounds for i in at]).T
    variances, axes = np.linalg.eigh(fit.covariance[np.ix_(at, at)])
    total = np.zeros(2)
    for variance, axis in zip(np.maximum(variances, 0.0), axes.T, strict=True):
        ends = []
        for sign in (-1.0, 1.0):
            z = np.array(fit.z, float)
            z[at] = np.clip(z[at] + sign * np.sqrt(variance) * axis, low, high)
            line = line_of(to_si(fit.free, z))
            ends.append((line.hurst, line.h_rms))
        total += (0.5 * (np.array(ends[1]) - ends[0])) ** 2
    return float(np.sqrt(total[0])), float(np.sqrt(total[1]))


def misfit_part(measurement: Measurement, model: np.ndarray, floor: np.ndarray, found: Misfit) -> dict[str, Any]:
    """Table phase by velocity and the sentence."""
    velocities = dict(zip(measurement.names, (float(v) for v in measurement.velocities), strict=True))
    return {
        "total": found.total,
        "by_phase": found.by_phase,
        "by_run": found.by_run,
        "table": phase_table(found.by_run, velocities),
        "sentence": misfit_sentence(measurement, model, floor, found.by_phase),
    }


def fit_sections(
    problem: Problem,
    fit: Fit,
    traces: Sequence[Trace],
    segmentations: Sequence[Segmentation],
    floor: np.ndarray,
    use: np.ndarray,
    rig: Any,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a report shows of one fitted model: entries of ``result.json``, and the variables behind its pictures.

    Args:
        problem, fit: the model and its optimum.
        traces, segmentations: all of the campaign, those without a slip among them.
        floor: of the features, shape (R, n, F).
        use: cycles that were fitted, shape (R, n).
        rig: of the campaign.
    """
    m, composition = problem.measurement, problem.composition
    seen = replace(m, valid=m.valid & use[..., None])
    stiffness = float(composition.fixed.get("rig.spring_stiffness", fit.values.get("rig.spring_stiffness", np.nan)))
    line = effective(fit, rig, composition.contacts)
    result: dict[str, Any] = {
        "misfit": misfit_part(seen, fit.features, floor, misfit(seen, fit.features, floor)),
        "identifiability": identifiability(fit, rig, line),
        "effective": line,
        "traces": [describe_trace(t, s) for t, s in zip(traces, segmentations, strict=True)],
    }
    variables: dict[str, Any] = {}
    for i, (t, s) in enumerate(zip(traces, segmentations, strict=True)):
        variables |= trace_pieces(t, s, i)
    runs = modelled_runs(problem, fit.z, fit.events)
    variables |= overlay(problem, runs, traces, segmentations)
    cut = [f"{name}, cycle {n + 1}" for name, run in zip(m.names, runs, strict=True) for n in run.cut]
    result["misfit"]["cut"] = cut
    result["misfit"]["unseen"] = _kept_aside(m, use)
    if cut:
        result["misfit"]["sentence"] += (
            f" In {len(cut)} cycle{'s' * (len(cut) > 1)} the model could not be integrated to the arrest "
            f"({'; '.join(cut[:4])}{' ...' if len(cut) > 4 else ''}; at most {composition.most_steps} steps), so their "
            "errors and those of the cycles after them say nothing; a fit with --most-steps "
            f"{4 * composition.most_steps} goes further."
        )
    found = {t.name: s for t, s in zip(traces, segmentations, strict=True)}
    variables |= residual_arrays(seen, fit.features, floor, found, stiffness, {t.name: t for t in traces})
    variables["coordinates"] = {"phase": list(PHASES), "feature": list(m.layout.names), "run": list(m.names)}
    return result, variables


def _kept_aside(m: Measurement, use: np.ndarray) -> list[str]:
    """Runs, and cycles of runs (counted from 1), that were not fitted."""
    out = []
    for name, there, seen in zip(m.names, np.asarray(m.cycles.used), use, strict=True):
        aside = np.flatnonzero(there & ~seen) + 1
        if aside.size:
            cycles = f"cycle{'s' * (aside.size > 1)} {', '.join(map(str, aside))} of {name}"
            out.append(name if aside.size == there.sum() else cycles)
    return out


def overlay(
    problem: Problem, modelled: Sequence[ModelledRun], traces: Sequence[Trace], segmentations: Sequence[Segmentation]
) -> Variables:
    """The model beside the measured zooms, and through the whole trace; arrays as of `trace_pieces`."""
    m = problem.measurement
    runs = dict(zip(m.names, modelled, strict=True))
    out: Variables = {}
    for i, (trace, found) in enumerate(zip(traces, segmentations, strict=True)):
        if trace.name not in runs or trace.displacement is None:
            continue
        run, r = runs[trace.name], m.names.index(trace.name)
        starts = np.asarray(m.cycles.start[r])[: len(run.times)]
        key = f"trace{i}_model"
        t, y = (np.concatenate(part) for part in (run.times, run.readings))
        order = np.argsort(t, kind="stable")
        t, y = thin(t[order], y[order], ZOOM)
        out[f"{key}_time"] = (key, t, {"units": "s"})
        out[f"{key}_position"] = (key, y, {"units": "m"})
        within = found.events[: len(run.times)]
        if not within:
            continue
        # the zooms show an event that the model was run through
        event = middle_event(within[:-1] if len(within) > 2 else within)
        before = found.events[event.index - 1].t_arrest if event.index else float(trace.time[0])
        for piece, start, stop in (
            ("creep", before, event.t_onset),
            ("slip", event.t_onset - 0.3 * event.duration, event.t_arrest + 1.5 * event.duration),
        ):
            low, high = np.searchsorted(trace.time, [start, stop])
            t, y = thin(trace.time[low:high], trace.displacement[low:high], ZOOM)
            name = f"trace{i}_{piece}"
            out[f"{name}_time"] = (name, t, {"units": "s"})
            out[f"{name}_position"] = (name, y, {"units": "m"})
            out[f"{name}_model"] = (name, run.reading(t, starts), {"units": "m"})
    return out


def residual_arrays(
    measurement: Measurement,
    model: np.ndarray,
    floor: np.ndarray,
    segmentations: dict[str, Segmentation],
    stiffness: float,
    traces: dict[str, Trace],
) -> Variables:
    """Residual over floor of every feature, and of every cycle by phase beside what might explain it."""
    m, phase = measurement, measurement.layout.phase_index()
    z = np.where(m.valid, (m.values - model) / floor, np.nan)
    used = np.argwhere(np.asarray(m.cycles.used))
    rows: list[list[float]] = []
    columns: dict[str, list[float]] = {
        name: [] for name in ("position", "velocity", "start", "contact_time", "load", "event")
    }
    for r, n in used:
        event = segmentations[m.names[r]].events[n]
        trace = traces[m.names[r]]
        with np.errstate(invalid="ignore"):
            rows.append([_rms(z[r, n, phase == k]) for k in range(len(PHASES))])
        own = float(np.asarray(m.cycles.stiffness)[r])
        drive = float(trace.drive.position(event.t_onset)) if trace.drive is not None else np.nan
        columns["position"].append(event.x_onset)
        columns["velocity"].append(float(m.velocities[r]))
        columns["start"].append(event.t_onset)
        columns["contact_time"].append(event.stick_time)
        columns["load"].append((own if np.isfinite(own) else stiffness) * (drive - event.x_onset))
        columns["event"].append(float(n + 1))
        if trace.normal_load is not None:
            begin = segmentations[m.names[r]].events[n - 1].i_arrest if n else 0
            columns.setdefault("normal_load", [np.nan] * (len(rows) - 1))
            columns["normal_load"].append(float(np.mean(trace.normal_load[begin : event.i_arrest + 1])))
        elif "normal_load" in columns:
            columns["normal_load"].append(np.nan)
    units = {"position": "m", "velocity": "m/s", "start": "s", "contact_time": "s", "load": "N", "event": "1"}
    units["normal_load"] = "N"
    out: Variables = {
        "residual": (("cycle", "phase"), np.array(rows), {"units": "1"}),  # type: ignore[dict-item]
        "feature_residual": (("run", "cycle_of_run", "feature"), z, {"units": "1"}),  # type: ignore[dict-item]
    }
    for name, values in columns.items():
        out[f"cycle_{name}"] = ("cycle", np.array(values), {"units": units[name]})
    return out


def _rms(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")
