"""The files of a campaign: one CSV of integer counts per run and the TOML that says what they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .forms import Setup
from .recorder import Recorded
from .runs import Run


def write_campaign(
    folder: Path,
    title: str,
    setup: Setup,
    shown: dict[str, Any],
    traces: list[tuple[Run, Recorded, list[tuple[float, float]]]],
    rate: float,
    virgin: bool,
) -> None:
    """Write ``campaign.toml`` and the traces; ``shown`` holds the mass and the spring as the user knows them."""
    rig = setup.rig
    surface = setup.surface
    lines = [
        "schema = 1",
        f'title = "{title}"',
        "",
        "[rig]",
        f'mass = "{shown["mass"]:.6g} kg"',
        f"spring_stiffness = {_spring(shown['spring'])}",
        f"contacts = {len(rig.loads)}",
        f'normal_force = "{sum(rig.loads) / len(rig.loads):.6g} N"',
        "friction_coefficient = { guess = 0.21, lower = 0.15, upper = 0.3 }",
        f'youngs_modulus = "{surface.youngs_modulus / 1e9:.6g} GPa"',
        f"poisson_ratio = {surface.poisson_ratio:.6g}",
        f'line_length = "{surface.length * 1e6:.6g} um"',
    ]
    count = f"{setup.sensor.count * 1e9:.6g} nm"
    # what a user reads off a record of the block at rest
    slow = f', walk = "{setup.sensor.walk * 1e9:.1g} nm/s^0.5", hum = "{setup.sensor.hum * 1e9:.1g} nm"'
    for run, recorded, pieces in traces:
        read = recorded.counts
        np.savetxt(
            folder / f"{run.name}.csv", read, fmt="%d" if read.dtype == int else "%.0f", header="counts", comments=""
        )
        more = _recorder(recorded.keys, setup.sensor.count)
        lines += [
            "",
            "[[trace]]",
            f'file = "{run.name}.csv"',
            f'sampling_rate = "{rate / 1e3:g} kHz"',
            f'displacement = {{ column = "counts", unit = "{count}", resolution = "{count}"{slow}{more} }}',
        ]
        if pieces:
            told = ", ".join(
                f'{{ until = "{until:g} s", velocity = "{velocity * 1e6:g} um/s" }}' for until, velocity in pieces
            )
            lines.append(f"drive = [{told}]")
        else:
            lines.append(f'drive_velocity = "{run.velocity * 1e6:g} um/s"')
        if virgin:
            lines.append("virgin = true")
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _recorder(keys: dict[str, Any], count: float) -> str:
    if "wrap" in keys:
        return f', wrap = "{keys["wrap"] * count * 1e9:.8g} nm"'
    if "resets" in keys:
        told = keys["resets"]
        return f", resets = {'true' if told is True else [f'{moment:.4f} s' for moment in told]}".replace("'", '"')
    return ""


def _spring(value: float | tuple[float, float, float]) -> str:
    if isinstance(value, float):
        return f'"{value:.6g} N/m"'
    guess, lower, upper = value
    return f'{{ guess = "{guess:.4g} N/m", lower = "{lower:.4g} N/m", upper = "{upper:.4g} N/m" }}'
