"""A fitted model run freely through measured cycles: beside what was measured in one run, and its errors in all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, nearest
from ..inference.diagnose.free_errors import errors
from ..inference.diagnose.free_measures import simulated
from ..inference.diagnose.free_simulation import Confirmation
from ..inference.diagnose.prepare import Prepared
from ..inference.force.fit import Fit
from ..system.object_repr import table

if TYPE_CHECKING:
    import pandas
    import xarray

Array = NDArray[np.float64]
WIDER = 1.5  # duration of a slip before its arrest within which it is measured, over that between onset and arrest


def free_run_errors(confirmation: Confirmation, parts: Sequence[str]) -> pandas.DataFrame:
    """See :meth:`stickslip.Fit.predict`; of the model with these parts."""
    free = confirmation.models.get(tuple(parts))
    if free is None:
        raise InputError("the free simulation of the model failed", hint="; ".join(confirmation.notes))
    found = errors(confirmation, free)
    rows = {"all": found, **found["by_run"]}
    measures = ("recurrence", "slip", "creep")
    return table(
        {
            name: {**{m: row[m]["relative"] for m in measures}, "missed": row["missed"], "events": row["events"]}
            for name, row in rows.items()
        },
        "run",
    )


def simulated_cycles(prepared: Prepared, fit: Fit, run: str) -> xarray.Dataset:
    """See :meth:`stickslip.Fit.simulate_cycles`."""
    import xarray

    m, names = prepared.measurement, [k.name for k in prepared.runs]
    if run not in m.names:
        raise InputError(
            "no run of that name can be simulated freely", key="run", value=run, hint=nearest(run, m.names)
        )
    r, number = m.names.index(run), names.index(run)
    track, _, broken = simulated(m, fit.problem, fit.point, r, number)
    used = np.flatnonzero(np.asarray(m.cycles.used)[r])
    longest = int(track.steps[used].max())
    time, reading = track.t[used, :longest], track.reading[used, :longest]
    slipped = track.arrested[used] & ~broken[used]
    trace, events = prepared.traces[number], prepared.segmentations[number].events
    found = {"half": np.full(used.size, np.nan), "slip": np.full(used.size, np.nan)}
    measured = {name: values.copy() for name, values in found.items()}
    assert trace.displacement is not None
    for i, n in enumerate(used):
        event = events[n]
        ago = WIDER * (event.t_arrest - event.t_onset)
        own = trace.time <= event.t_arrest
        measured["half"][i], measured["slip"][i] = _slip(trace.time[own], trace.displacement[own], ago)
        if slipped[i]:
            found["half"][i], found["slip"][i] = _slip(np.asarray(time[i]), np.asarray(reading[i]), ago)
    data = {
        "time": (("cycle", "step"), time, {"units": "s"}),
        "displacement": (("cycle", "step"), reading, {"units": "m"}),
        "arrest": ("cycle", np.where(slipped, track.arrest[used], np.nan), {"units": "s"}),
    }
    for end in ("onset", "arrest"):
        moments = np.array([getattr(events[n], f"t_{end}") for n in used])
        data[f"measured_{end}"] = ("cycle", moments, {"units": "s"})
    data["measured_place"] = ("cycle", np.array([events[n].x_onset for n in used]), {"units": "m"})
    for prefix, values in (("", found), ("measured_", measured)):
        data[f"{prefix}half"] = ("cycle", values["half"], {"units": "s", "long_name": "half of the slip is done"})
        data[f"{prefix}slip"] = ("cycle", values["slip"], {"units": "m"})
    return xarray.Dataset(data, coords={"cycle": used}, attrs={"run": run})


def _slip(t: Array, x: Array, ago: float) -> tuple[float, float]:
    """When half of the way of the last ``ago`` seconds is done (s), and that way (m)."""
    own = slice(int(np.searchsorted(t, t[-1] - ago)), None)
    t, x = t[own], x[own]
    share = np.maximum.accumulate((x - x[0]) / (x[-1] - x[0] or 1.0))
    return float(np.interp(0.5, share, t)), float(abs(x[-1] - x[0]))
