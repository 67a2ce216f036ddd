"""A series of runs in which one key takes one value after another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import InputError
from .events import UNITS
from .load import Scenario
from .overrides import is_bare, sweep_values
from .schema import SweepTable

if TYPE_CHECKING:
    import xarray

    from .recording import Recording

KEY_UNITS = {
    "drive.velocity": "m/s",
    "block.mass": "kg",
    "block.spring_stiffness": "N/m",
    "block.damping": "N s/m",
    "contact.normal_force": "N",
    "contact.h_rms": "m",
    "contact.u_max": "m",
    "weakening.slip_distance": "m",
    "weakening.healing_time": "s",
}
SUMMED = ("recurrence", "slip", "peak_velocity", "creep_before_slip")
NUMBERS = {  # of a run -> unit
    "events": "1",
    "critical_velocity": "m/s",
    **{f"{name}{end}": UNITS[name] for name in SUMMED for end in ("", "_std")},
}


def scenarios_of(scenario: Scenario, sweep: SweepTable) -> list[tuple[float, Scenario]]:
    """Every value of the series and the scenario with it, all checked before the first runs.

    Raises:
        InputError: the key is unknown, or a value or its unit is not allowed.
    """
    table, _, name = sweep.key.rpartition(".")
    if not table:
        what = "the key of a series is that of a table"
        raise InputError(what, key="sweep.key", value=sweep.key, allowed="table.key")
    for written in (sweep.start, sweep.stop, *(sweep.values or ())):
        if isinstance(written, str) and not is_bare(written):
            scenario.with_changes([(sweep.key, written)])  # the schema knows the unit; what follows is plain numbers
    values = sweep_values(sweep.key, sweep.start, sweep.stop, sweep.points, sweep.values)
    found = []
    for value in values:
        number = int(value) if name in _INTEGERS and float(value).is_integer() else value
        found.append((value, scenario.with_changes([(sweep.key, number)])))
    return found


_INTEGERS = {"springs", "bins", "contacts", "seed", "lines", "events", "counter_steps"}


def summary(
    scenario: Scenario, key: str, values: list[float], runs: Sequence[xarray.Dataset | Recording]
) -> xarray.Dataset:
    """Means and spreads of the events of every run, those after the first, virgin one where there are more.

    Returns:
        On the dimension ``run``: value, events, critical_velocity, and recurrence (s), slip (m), peak_velocity (m/s)
        and creep_before_slip (m), each with ``..._std``; nan where a run has no event.
    """
    import xarray

    rows = [numbers(run) for run in runs]
    columns: dict[str, tuple] = {
        "value": ("run", np.array(values[: len(runs)]), {"units": KEY_UNITS.get(key, "1"), "long_name": key}),
        **{name: ("run", np.array([row[name] for row in rows]), {"units": unit}) for name, unit in NUMBERS.items()},
    }
    return xarray.Dataset(columns, attrs={"key": key, "title": scenario.title})


def numbers(run: xarray.Dataset | Recording) -> dict[str, float]:
    """Number of events of a run, critical velocity (m/s), and ``SUMMED`` with their spreads, as of :func:`summary`."""
    found: dict[str, float] = {"events": run.sizes["event"], "critical_velocity": run.attrs["critical_velocity"]}
    for name in SUMMED:
        later = _later(run[name].values)
        for end, number in (("", np.mean), ("_std", np.std)):
            found[f"{name}{end}"] = float(number(later)) if later.size else np.nan
    return found


def _later(values: np.ndarray) -> np.ndarray:
    values = values[1:] if values.size > 1 else values
    return values[np.isfinite(values)]
