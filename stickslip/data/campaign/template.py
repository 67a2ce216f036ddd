"""A campaign file to start from, and one written for runs made here."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from ..trace import Trace

_TEMPLATE = """\
# A campaign: measured runs of one apparatus. Quantities are numbers in SI or text with a unit.
schema = 1
title = "My rig"

[rig]
mass = "0.0894 kg"
# not measured? give a guess and bounds; the dynamic model fits it:
spring_stiffness = { guess = "1000 N/m", lower = "200 N/m", upper = "5000 N/m" }
contacts = 4
normal_force = "0.31 N"                # of one contact
friction_coefficient = 0.21
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
line_length = "20 um"                  # of the rough line
# springs = 4096                       # of the rough line
# H = 0.3                              # its Hurst exponent and
# h_rms = "2.5 um"                     # rms height, where measured: the prior of the contact
# temperature = "20 degC"

[[trace]]
file = "run1.csv"                      # beside this file; else  outside = true
# name = "run1"                        # default: the file's name
time = { column = "time", unit = "s" } # by name or number from 1; or  sampling_rate = "10 kHz"
# at least one of displacement, velocity, spring_force:
displacement = { column = "displacement", unit = "um", resolution = "8 nm" }
#   from a record of the block at rest:  walk = "0.3 nm/s^0.5", hum = "0.3 nm" (amplitude at the mains frequency)
#   counter that wraps:  wrap = "32.4 um"      counter that was cleared:  resets = ["2.3 s", "5.1 s"]  or  true
# spring_force = { column = "F", unit = "mN" }
# normal_load = { column = "N", unit = "N" }
drive_velocity = "0.05 mm/s"           # or  drive_position = { column = "drive", unit = "um" }
# or with holds and reversals, 'until' in the record's own time:
# drive = [ { until = "5 s", velocity = "50 um/s" }, { until = "10 s", velocity = 0 } ]
virgin = true                          # the contact was freshly set down
# role = "train"                       # or "held-out"; default: every run is fitted, and predicted from the others
# start = "1 s"                        # use only a part
# stop = "20 s"
# clock_error = "25 ppm"               # the recorder's clock runs fast by this
# spikes = false                       # leave single wild samples alone
# a trace may give any key of [rig] anew:
# spring_stiffness = "168 N/m"
"""


def campaign_template() -> str:
    """A commented campaign file."""
    return _TEMPLATE


def campaign_text(
    traces: Sequence[Trace], files: Sequence[str], rig: Mapping[str, object], title: str = "Simulated runs"
) -> str:
    """A campaign file for traces that lie in CSV files with columns time, displacement, velocity, spring_force (SI).

    Args:
        traces: the runs; their drive, name, role and virgin state are written.
        files: name of each one's CSV file, relative to the campaign.
        rig: keys of ``[rig]`` in SI.
    """
    lines = ["schema = 1", f"title = {_toml(title)}", "", "[rig]"]
    lines += [f"{key} = {_toml(value)}" for key, value in rig.items() if value is not None]
    for trace, file in zip(traces, files, strict=True):
        lines += ["", "[[trace]]", f"name = {_toml(trace.name)}", f"file = {_toml(file)}"]
        lines.append('time = { column = "time", unit = "s" }')
        for name, unit in (("displacement", "m"), ("velocity", "m/s"), ("spring_force", "N"), ("normal_load", "N")):
            if getattr(trace, name) is None:
                continue
            count = f", resolution = {trace.resolution!r}" if name == trace.leading and trace.resolution else ""
            if name == "displacement":
                slow = {"walk": trace.walk, "hum": trace.hum}
                count += "".join(f", {key} = {_toml(value)}" for key, value in slow.items() if value)
            lines.append(f'{name} = {{ column = "{name}", unit = "{unit}"{count} }}')
        if trace.drive is not None:
            times, positions = trace.drive.times, trace.drive.positions
            speeds = (positions[1:] - positions[:-1]) / (times[1:] - times[:-1])
            if len(speeds) == 1:
                lines.append(f"drive_velocity = {float(speeds[0])!r}")
            else:
                pieces = zip(times[1:].tolist(), speeds.tolist(), strict=True)
                lines.append(f"drive = [{', '.join(f'{{ until = {t!r}, velocity = {v!r} }}' for t, v in pieces)}]")
        lines.append(f"virgin = {_toml(trace.virgin)}")
        if trace.role:
            lines.append(f"role = {_toml(trace.role)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False, default=float)  # which writes texts and numbers as TOML does
