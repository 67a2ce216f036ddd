"""The static model's part of a ``result.json``, and its arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import shorten
from typing import Any

import numpy as np

from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import InputError
from ...inference.features.measurement import doubts
from ...inference.fit.creep_process import CreepProcess, creep_processes
from ...inference.fit.normalised import Ramp, break_away, fit_ramps, is_ramp
from ...inference.fit.static import SATISFYING, Align, CreepFit, Form, StaticFit, fit_static, tied_quantities
from ...inference.fit.static_table import StaticRig
from ...system.units import shown
from .excerpts import Variables

MOST_SHOWN = 60
_APART = 0.2  # of H, a third of the range that surfaces have


def static_result(
    traces: Sequence[Trace],
    segmentations: Sequence[Segmentation],
    rig_of: Callable[[Trace], StaticRig],
    *,
    align: Align,
    form: Form,
    v_lim: float,
    sampling: str,
    springs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, Any], Variables]:
    """Creep processes fitted one by one, break-away ramps in normalised form; numbers and arrays for pictures.

    Args:
        traces, segmentations: the runs and their events.
        rig_of: what is known of the rig in a run.
        align, form: of the fit (see `fit_static`).
        v_lim: speed at which a creep process ends, m/s.
        sampling: "log" or "uniform" (see `creep_processes`).
        springs: springs of a line for ramps.
        progress: told how many creep processes are fitted, and of how many.

    Raises:
        InputError: nothing in the traces can be compared with the static model.
    """
    processes: list[CreepProcess] = []
    rigs: list[StaticRig] = []
    ramps: list[Ramp] = []
    dropped: list[str] = []
    coarse = False
    for trace, found in zip(traces, segmentations, strict=True):
        if is_ramp(trace):
            ramp = break_away(trace, found)
            if isinstance(ramp, Ramp):
                ramps.append(ramp)
            else:
                dropped.append(str(ramp))
            continue
        kept, lost = creep_processes(trace, found, v_lim=v_lim, sampling=sampling)  # type: ignore[arg-type]
        dropped += [str(d) for d in lost]
        coarse |= any(d.coarse for d in lost)
        if kept:
            rigs += [rig_of(trace)] * len(kept)
            processes += kept
    if not processes and not ramps:
        why = shorten("; ".join(dict.fromkeys(dropped)) or "no trace holds a slip", 600, placeholder=" ...")
        larger = ". A coarse sensor needs a larger --v-lim" if coarse else ""
        raise InputError(
            "nothing here can be compared with the static model", value=None, hint=f"{why}{larger}{doubts(traces)}"
        )
    result: dict[str, Any] = {"dropped": dropped}
    variables: Variables = {}
    if processes:
        fit = fit_static(processes, rigs, align=align, form=form, progress=progress)
        result["static"] = _creep_part(fit, v_lim, rigs)
        result["identifiability"] = _words(fit)
        for i, one in enumerate(fit.fits[:MOST_SHOWN]):
            key, p = f"creep{i}", one.process
            variables[f"{key}_time"] = (key, p.time, {"units": "s"})
            variables[f"{key}_displacement"] = (key, p.displacement, {"units": "m"})
            variables[f"{key}_model"] = (key, one.model, {"units": "m"})
    if ramps:
        part, more = _ramp_part(ramps, springs)
        result["ramps"] = part
        variables |= more
    return result, variables


def _creep_part(fit: StaticFit, v_lim: float, rigs: Sequence[StaticRig]) -> dict[str, Any]:
    numbers, rig = fit.summary(), fit.rig
    guessed = f"; guessed, not measured: {', '.join(rig.guessed)}" if rig.guessed else ""
    mean = (
        f"over these H = {numbers['hurst']:.2f} +- {numbers['hurst_std']:.2f}, "
        f"h_rms = {numbers['h_rms'] * 1e6:.3g} +- {numbers['h_rms_std'] * 1e6:.2g} µm (mean and standard deviation)"
        f"{_range(fit)}"
        if fit.good
        else "so there is no mean to give"
    )
    text = (
        f"{len(fit.good)} of {len(fit.fits)} creep processes ({100 * fit.share:.0f} %) are described to within 2 % of "
        "their "
        f"creep; {mean}. Lines of N = {rig.n_springs} springs and L = {shown(rig.length, 'm')}, mean of {rig.lines} "
        f"lines: H and h_rms hold for this N and L only. Alignment '{fit.align}', virtual time '{fit.form}', "
        f"v_lim = {shown(v_lim, 'm/s')}{guessed}. Median residual {100 * numbers['median_nrmse']:.2g} % of the creep."
    )
    if len({(r.n_springs, r.length) for r in rigs}) > 1:
        text += " Traces have rigs of their own; N and L are those of the first."
    hidden = sum(_noise_share(f) > 0.5 * SATISFYING for f in fit.fits)
    if hidden:
        text += f" In {hidden} processes counts and noise of the sensor alone make 1 % of the creep or more."
    return {
        "text": text,
        "align": fit.align,
        "form": fit.form,
        "v_lim": v_lim,
        "N": rig.n_springs,
        "L": rig.length,
        "lines": rig.lines,
        "seed": rig.seed,
        "guessed": list(rig.guessed),
        "satisfying": len(fit.good),
        "processes": len(fit.fits),
        **numbers,
        "fits": [_one(f) for f in fit.fits],
    }


def _range(fit: StaticFit) -> str:
    """The smallest and largest H; that one surface has but one H, where they are far apart."""
    values = [f.hurst for f in fit.good]
    low, high = min(values), max(values)
    if len(values) < 2 or high - low < 0.05:
        return ""
    apart = ", though one surface has one H" if high - low > _APART else ""
    return f", H from {low:.2f} to {high:.2f}{apart}"


def _one(f: CreepFit) -> dict[str, Any]:
    notes = ["virgin"] if f.process.virgin else []
    notes += [f"at the edge of its range: {', '.join(f.at_bound)}"] if f.at_bound else []
    same = ("hurst", "hurst_std", "h_rms", "h_rms_std", "u_max", "nrmse", "satisfying")
    return {
        "trace": f.process.trace,
        "event": f.process.event + 1,
        **{name: getattr(f, name) for name in same},
        "creep": f.process.amplitude,
        "noise": _noise_share(f),
        "note": "; ".join(notes),
    }


def _noise_share(f: CreepFit) -> float:
    return float(np.sqrt(np.mean(np.square(f.process.noise)))) / max(f.process.amplitude, 1e-300)


def _words(fit: StaticFit) -> list[str]:
    best = min(fit.fits, key=lambda f: f.nrmse)
    lines = [
        tied_quantities(best, fit.rig),
        "H depends on the number of springs N, and less the larger H is (from about 0.5 on it does not)",
    ]
    loose = [f for f in fit.fits if not np.isfinite(f.hurst_std) or f.hurst_std > 0.3]
    if loose:
        lines.append(
            f"H is not determined in {len(loose)} of {len(fit.fits)} processes (at a bound, or +-0.3 and more)"
        )
    return lines


def _ramp_part(ramps: list[Ramp], springs: int | None) -> tuple[dict[str, Any], Variables]:
    fits = fit_ramps(ramps, springs or 4096)
    good = [f for f in fits if f.satisfying]
    at_edge = sum(bool(f.at_bound) for f in fits)
    text = (
        f"{len(good)} of {len(fits)} break-away ramps ({100 * len(good) / len(fits):.0f} %) follow the static model's "
        f"normalised curve to within 2 % of their displacement at break-away; median residual "
        f"{100 * float(np.median([f.nrmse for f in fits])):.2g} %. Lines of N = {fits[0].n_springs} springs."
    )
    if at_edge:
        text += f" In {at_edge} the curve is more bent than that of any such line (H at the edge of its range)."
    variables: Variables = {}
    for i, f in enumerate(fits[:MOST_SHOWN]):
        key = f"ramp{i}"
        variables[f"{key}_tau"] = (key, f.ramp.tau, {"units": "1"})
        variables[f"{key}_displacement"] = (key, f.ramp.displacement, {"units": "m"})
        variables[f"{key}_model"] = (key, f.model, {"units": "m"})
    same = ("hurst", "hurst_std", "u_max", "u_max_std", "friction_force", "nrmse", "satisfying")
    rows = [
        {
            "trace": f.ramp.trace,
            **{name: getattr(f, name) for name in same},
            "force": f.ramp.force,
            "note": "H at the edge of its range" if f.at_bound else "",
        }
        for f in fits
    ]
    part = {
        "text": text,
        "N": fits[0].n_springs,
        "share": len(good) / len(fits),
        "satisfying": len(good),
        "ramps": len(fits),
        "median_nrmse": float(np.median([f.nrmse for f in fits])),
        "fits": rows,
    }
    return part, variables
