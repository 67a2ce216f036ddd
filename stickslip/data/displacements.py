"""The block's displacement where it was not measured: from its velocity, or the spring's force at its true scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .checks.spring_force import gain_is_wrong, stick_gain
from .prescribed import prescribed
from .readers.repair import from_load_point
from .segment import Segmentation, block_motion, segment
from .trace import Trace


def true_gains(traces: Sequence[Trace], found: Sequence[Segmentation]) -> tuple[list[Segmentation], list[str]]:
    """Events of traces of spring force, with the force's scale set right where the sticks show that it is wrong.

    A force that rises too slowly is left as it is: a block that creeps along makes the same.

    Returns:
        The events of every trace, and a sentence that names all whose scale was set right.
    """
    out: list[Segmentation] = []
    wrong: dict[str, dict[str, float]] = {}
    for trace, old in zip(traces, found, strict=True):
        gain = stick_gain(trace, old)
        if gain is None or trace.spring_stiffness is None or not gain_is_wrong(gain):
            out.append(old)
            continue
        out.append(segment(trace, spring_stiffness=trace.spring_stiffness * gain["value"]))
        wrong[trace.name] = gain
    if not wrong:
        return out, []
    sizes = ", ".join(f"{100 * (g['value'] - 1):+.1f} % (+-{100 * g['std']:.1f} %, {n})" for n, g in wrong.items())
    return out, [
        f"sensor-gain of {sizes}: while the block sticks, the force rises faster than stiffness times drive by this "
        "much. The force was divided by the gain; stiffness or drive velocity may be what is wrong instead."
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
        given = trace.replace(displacement=np.array(position), noise=noise, resolution=count, drive=drive)
        out.append(from_load_point(given))
    return out, notes
