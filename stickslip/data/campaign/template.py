"""A campaign file to start from, and one written for runs made here."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..trace import Trace


def campaign_template() -> str:
    """A commented campaign file."""
    return Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")


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
            speeds = trace.drive.velocities
            if len(speeds) == 1:
                lines.append(f"drive_velocity = {float(speeds[0])!r}")
            else:
                pieces = zip(trace.drive.times[1:].tolist(), speeds.tolist(), strict=True)
                lines.append(f"drive = [{', '.join(f'{{ until = {t!r}, velocity = {v!r} }}' for t, v in pieces)}]")
        lines.append(f"virgin = {_toml(trace.virgin)}")
        if trace.role:
            lines.append(f"role = {_toml(trace.role)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False, default=float)  # which writes texts and numbers as TOML does
