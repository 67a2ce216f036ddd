"""Levels of every slip: the spring's force at onset and at arrest, and when and where it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...data.segment import Event, Segmentation, block_motion, position_at
from ...data.trace import Trace
from ...errors import InputError

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """What turns an elongation of the spring into a level.

    Args:
        factor: level for each metre (or second of loading) of elongation.
        unit: of the level: ``"N"``, or ``"m"`` where the spring is not known.
    """

    factor: float
    unit: str


def scale_of(trace: Trace, found: Segmentation) -> Scale:
    """The unit in which levels of a run are told.

    N where the spring is known or its force was measured, else metres of elongation.

    Raises:
        InputError: neither the load point nor the force is known, so that no level can be told.
    """
    force = trace.leading == "spring_force"
    if trace.drive is None and not force:
        raise InputError(
            f"trace '{trace.name}': the level of a slip is the force of the spring, and neither it nor the load point "
            "is known",
            hint="give 'drive_velocity', 'drive_position' or 'spring_force' in the campaign file",
        )
    if trace.spring_stiffness is not None and found.settings.unit == "m":
        return Scale(trace.spring_stiffness, "N")
    if force and found.settings.gain is not None:
        return Scale(found.settings.gain, "N")
    return Scale(1.0, found.settings.unit)


def level_arrays(events: Sequence[Event], factor: float, load_point: Callable[[Array], Array]) -> dict[str, Array]:
    """Levels and coordinates of slips as plain arrays, shape (n,) each; see :func:`levels`.

    Args:
        events: in order.
        factor: level for each length of elongation.
        load_point: position of the load point at given times (s).
    """

    def of(name: str) -> Array:
        return np.array([getattr(e, name) for e in events], float)

    way = of("direction")
    out = {"time_onset": of("t_onset"), "time_arrest": of("t_arrest"), "direction": way}
    out |= {"place_onset": of("x_onset"), "place_arrest": of("x_arrest")}
    for end in ("onset", "arrest"):
        out[end] = factor * way * (load_point(out[f"time_{end}"]) - out[f"place_{end}"])
    steps = np.abs(np.diff(np.stack([out["place_onset"], out["place_arrest"]], axis=1).ravel()))
    path = np.concatenate([[0.0], np.cumsum(steps)])[: 2 * len(events)]
    out["path_onset"], out["path_arrest"] = path[0::2], path[1::2]
    return out | {"slip": of("slip"), "recurrence": of("recurrence")}


def levels(trace: Trace, found: Segmentation) -> xarray.Dataset:
    """Levels of every slip of a run, from its motion and its events alone.

    Args:
        trace: the run.
        found: its events; those of :attr:`Campaign.scaled` have the scale of a measured force set right.

    Returns:
        Over ``slip_number``, shape (n,): ``onset`` and ``arrest``, the force c_s (d - x) of the spring there, positive
        along the slip (N; metres of elongation where the spring is not known); ``slip`` (m) and ``recurrence`` (s);
        ``time_onset``, ``time_arrest`` (s), ``place_onset``, ``place_arrest`` (m), ``path_onset``, ``path_arrest`` (m,
        length of the block's way since the first onset) and ``direction`` (1 or -1). Lengths are in seconds of loading
        where neither drive nor spring is known.

    Raises:
        InputError: no slip, or neither the load point nor the force is known.
    """
    import xarray

    if not found.events:
        raise InputError(
            f"trace '{trace.name}' has no slip ({found.reason})",
            hint="choose another run, or set 'minimum_slip' where small slips were left out",
        )
    scale, length = scale_of(trace, found), found.settings.unit
    _, drive, _, _ = block_motion(trace, gain=found.settings.gain)
    half = max(1, round(found.settings.window * trace.sampling_rate) // 3)

    def load_point(moments: Array) -> Array:
        # a measured load point as the events' own positions; a force's was in the motion that they are of
        if trace.drive_position is not None and trace.leading != "spring_force":
            return np.array([position_at(trace.time, trace.drive_position, t, half) for t in moments])
        assert drive is not None
        return np.asarray(drive.position(moments))

    units = {"onset": scale.unit, "arrest": scale.unit, "direction": "1", "recurrence": "s"}
    data: dict[str, Any] = {}
    for name, values in level_arrays(found.events, scale.factor, load_point).items():
        own = units.get(name, "s" if name.startswith("time") else length)
        data[name] = ("slip_number", values, {"units": own})
    numbers = np.arange(1, len(found.events) + 1)
    return xarray.Dataset(data, coords={"slip_number": numbers}, attrs={"title": trace.name})


@dataclass(frozen=True)
class Wandering:
    """How levels of successive slips hang together.

    Attributes:
        variation: standard deviation of the level at onset over its mean.
        carried_over: correlation of the level at onset with that of the next slip, less a running mean.
        with_arrest: correlation of the levels at onset and arrest of the same slip, less a running mean.
        arrest_to_next: correlation of the level at arrest with that at the next onset, less a running mean.
        with_waiting: correlation of the level at onset with the time since the onset before, less a running mean.
        window: slips in the running mean.
    """

    variation: float
    carried_over: float
    with_arrest: float
    arrest_to_next: float
    with_waiting: float
    window: int


def wandering(data: xarray.Dataset, window: int = 31) -> Wandering:
    """Correlations of levels (:func:`levels`), less a running mean over ``window`` slips.

    Raises:
        InputError: fewer than three slips.
    """
    n = data.sizes["slip_number"]
    if n < 3:
        raise InputError(f"{n} slips are too few for a correlation", allowed="three slips or more")
    window = min(window, n)

    def less(values: Array) -> Array:
        ones = np.convolve(np.ones(n), np.ones(window), "same")
        return values - np.convolve(values, np.ones(window), "same") / ones

    onset, arrest = data.onset.values, data.arrest.values
    on, ar = less(onset), less(arrest)

    def tied(a: Array, b: Array) -> float:
        return float(np.corrcoef(a, b)[0, 1])

    return Wandering(
        float(onset.std() / abs(onset.mean())), tied(on[:-1], on[1:]), tied(on, ar), tied(ar[:-1], on[1:]),
        tied(on[1:], data.recurrence.values[1:]), window,
    )  # fmt: skip
