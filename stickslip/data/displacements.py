"""The block's displacement where it was not measured: from its velocity, or the spring's force at its true scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .checks.spring_force import common_gain, gain_is_wrong, gains_agree, stick_gain
from .prescribed import prescribed
from .readers.repair import from_load_point
from .segment import Segmentation, block_motion, segment
from .trace import Trace


def true_gains(traces: Sequence[Trace], found: Sequence[Segmentation]) -> tuple[list[Segmentation], list[str]]:
    """Events of traces of spring force, with the force's scale set right where the sticks show that it is wrong.

    All runs were read by one sensor, so its scale is that of all sticks together. Where runs differ by more than their
    errors, each that is wrong is set right by its own. A force that rises too slowly is left as it is: a block that
    creeps along makes the same.

    Returns:
        The events of every trace, and a sentence that says by how much the scale was set right.
    """
    gains = {i: stick_gain(t, s) for i, (t, s) in enumerate(zip(traces, found, strict=True))}
    told = [gain for gain in gains.values() if gain is not None]
    if not told:
        return list(found), []
    common = common_gain(told) if gains_agree(told) else None
    out, wrong = list(found), {}
    for i, trace in enumerate(traces):
        gain, stated = gains[i] if common is None else common, trace.spring_stiffness
        if trace.leading != "spring_force" or stated is None or trace.drive is None:
            continue
        if gain is not None and gain_is_wrong(gain):
            out[i] = segment(trace, spring_stiffness=stated * gain["value"])
            wrong[trace.name] = gain
    if not wrong:
        return out, []
    if common is not None:
        sizes = f"{_size(common)}; {', '.join(wrong)})"
    else:
        sizes = ", ".join(f"{_size(gain)}; {name})" for name, gain in wrong.items())
    return out, [
        f"sensor-gain of {sizes}: while the block sticks, the force rises faster than stiffness times drive by this "
        "much. The force was divided by the gain; stiffness or drive velocity may be what is wrong instead. A fit of "
        "the dynamic model finds the scale together with all other parameters (sensor.force_scale)."
    ]


def _size(gain: Mapping[str, float]) -> str:
    return f"{100 * (gain['value'] - 1):+.1f} % (+-{100 * gain['std']:.1f} %"


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
        stated = trace.spring_stiffness
        scale = None if gain is None or stated is None else gain / stated
        given = trace.replace(
            displacement=np.array(position), noise=noise, resolution=count, drive=drive, force_scale=scale
        )
        out.append(from_load_point(given))
    return out, notes
