"""Which pictures a result has, in which section of the report they stand, and what is said under them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from .figures import ripple_picture, series, trace_picture
from .fit_figures import creep_grid, ladder_picture, profile_picture, ramp_grid
from .force_figures import backbone_picture, cycle_picture, residual_picture, runs_of
from .forecast_figures import calibration_picture, levels_picture
from .free_figures import free_picture

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

MOST_TRACES = 12


def pictures(result: dict[str, Any], data: xarray.Dataset) -> Iterator[tuple[str, str, Figure]]:
    """(section, caption, figure) of everything this result can show."""
    if len(result.get("ladder") or []) > 1:
        unseen = any(step.get("heldout_error") is not None for step in result["ladder"])
        runs = "on fitted and on unseen runs" if unseen else "on fitted runs; no run was held out"
        yield "ladder", f"Error of every model by phase, {runs}.", ladder_picture(result["ladder"])
    if runs_of(data):
        names = list((result.get("ladder") or [{}])[-1].get("by_run") or [])
        yield (
            "force",
            "One cycle of every run: force that the contact held, and the model's.",
            cycle_picture(data, names),
        )
        caption = "Residual force of the base model against possible variables; lines: running medians."
        yield "force", caption, residual_picture(data, names)
    if "backbone_force" in data and result.get("backbone"):
        caption = "Backbone of the contact as the motion shows it, and the laws of a rough contact."
        yield "force", caption, backbone_picture(data, result["backbone"])
    if "free_run_measured_time" in data and "free_recurrence_measured" in data:
        caption = (
            "Free simulations from arrest to arrest through runs left out of their fit: the run where the base errs "
            "most, one of its onsets, and every recurrence."
        )
        yield "free", caption, free_picture(data)
    if result.get("methods") and "pit" in data:
        yield (
            "forecast",
            "Level of every slip, and that at onset against that at the arrest before.",
            levels_picture(data),
        )
        yield (
            "forecast",
            "Forecast against measured time to the next slip, and calibration of the forecasts.",
            calibration_picture(data),
        )
    if result.get("static") and "creep0_time" in data:
        yield (
            "static",
            "Creep before slips (dark) and the static model (dashed); residuals below.",
            creep_grid(data, result["static"]["fits"]),
        )
    if result.get("ramps") and "ramp0_tau" in data:
        yield (
            "ramps",
            "Displacement against force up to break-away (dark) and the static curve (dashed).",
            ramp_grid(data, result["ramps"]["fits"]),
        )
    for p in result.get("profiles") or []:
        yield "parameters", p.get("text", ""), profile_picture(p)
    traces = result.get("traces") or []
    for i, facts in enumerate(traces[:MOST_TRACES]):
        if series(data, f"trace{i}_whole", "time") is not None:
            yield (
                "traces",
                f"{facts['name']}: the whole, one stick, one slip and what follows it.",
                trace_picture(data, i, facts),
            )
        if (facts.get("ripple") or {}).get("lines") and series(data, f"trace{i}_ripple", "frequency") is not None:
            caption = f"{facts['name']}: {facts['ripple'].get('text', '')}"
            yield "traces", caption, ripple_picture(data, i, {**facts["ripple"], "name": facts["name"]})
