"""The block's displacement where it was not measured: from its velocity, or the spring's force at its true scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .checks.spring_force import common_gain, gain_is_wrong, stick_gain
from .prescribed import prescribed
from .readers.repair import from_load_point
from .segment import Segmentation, block_motion, segment
from .trace import Trace


def true_gains(traces: Sequence[Trace], found: Sequence[Segmentation]) -> tuple[list[Segmentation], list[str]]:
    """Events of traces of spring force, with the force's scale set right where the sticks show that it is wrong.

    All runs were read by one sensor, so its scale is that of all sticks together. A force that rises too slowly is left
    as it is: a block that creeps along makes the same.

    Returns:
        The events of every trace, and a sentence that says by how much the scale was set right.
    """
    gains = {i: stick_gain(t, s) for i, (t, s) in enumerate(zip(traces, found, strict=True))}
    told = [gain for gain in gains.values() if gain is not None]
    if not told:
        return list(found), []
    gain = common_gain(told)
    if not gain_is_wrong(gain):
        return list(found), []
    out, names = list(found), []
    for i, trace in enumerate(traces):
        if trace.leading == "spring_force" and trace.spring_stiffness is not None and trace.drive is not None:
            out[i] = segment(trace, spring_stiffness=trace.spring_stiffness * gain["value"])
            names.append(trace.name)
    return out, [
        f"sensor-gain of {100 * (gain['value'] - 1):+.1f} % (+-{100 * gain['std']:.1f} %; {', '.join(names)}): while "
        "the block sticks, the force rises faster than stiffness times drive by this much. The force was divided by "
        "the gain; stiffness or drive velocity may be what is wrong instead. A fit of the dynamic model finds the "
        "scale together with all other parameters (sensor.force_scale)."
    ]


def with_displacements(traces: Sequence[Trace], found: Sequence[Segmentation]) -> tuple[list[Trace], list[str]]:
    """Traces of velocity or spring force with the displacement (m) they imply; others as they are.

    Where the motion is prescribed it stays what it is, and so does the force beside it.

    Returns:
        The traces, and a sentence for each that was given a displacement.
    """
    out, notes = [], []
    for trace, events in zip(traces, found, strict=True):
        position, drive, gain, unit = block_motion(trace, gain=events.settings.gain)
        aside = gain is not None and prescribed(trace, events)
        if trace.displacement is not None or unit != "m" or aside:
            out.append(trace)
            continue
        notes.append(f"{trace.name}: the displacement is {'drive - F/c_s' if gain else 'the integral of the velocity'}")
        count = None if trace.resolution is None or gain is None else trace.resolution / gain
        noise = events.settings.noise
        scale = None if gain is None else gain / (trace.spring_stiffness or gain)
        given = trace.replace(
            displacement=np.array(position), noise=noise, resolution=count, drive=drive, force_scale=scale
        )
        out.append(from_load_point(given))
    return out, notes
