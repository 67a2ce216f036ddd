"""A small rig that all tests of scenarios share, so that it is compiled once."""

from __future__ import annotations

import copy
from typing import Any

import pytest

RIG: dict[str, Any] = {
    "schema": 1,
    "title": "small rig",
    "block": {"mass": "89.4 g", "spring_stiffness": "1000 N/m", "damping": "10 N s/m"},
    "drive": {"velocity": "200 um/s", "events": 3},
    "contact": {
        "kind": "power-law",
        "contacts": 4,
        "normal_force": "0.31 N",
        "friction_coefficient": 0.21,
        "u_max": "0.95 um",
        "p": 3.3,
        "bins": 32,
    },
    "weakening": {"ratio": 0.85, "slip_distance": "1 um", "healing_time": "20 ms"},
    "output": {"sampling_rate": "5 kHz"},
}


def rig(**changes: Any) -> dict[str, Any]:
    """The rig with keys such as ``drive__velocity`` changed, or whole tables given anew."""
    content = copy.deepcopy(RIG)
    for key, value in changes.items():
        table, _, name = key.partition("__")
        if name:
            content.setdefault(table, {})[name] = value
        else:
            content[table] = value
    return content


def as_toml(content: dict[str, Any]) -> str:
    """Plain tables as TOML, lists of tables as arrays of tables."""

    def cell(value: Any) -> str:
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, str):
            return f'"{value}"'
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{k} = {cell(v)}" for k, v in value.items()) + " }"
        if isinstance(value, list):
            return "[" + ", ".join(map(cell, value)) + "]"
        return repr(value)

    lines = [f"{key} = {cell(value)}" for key, value in content.items() if not isinstance(value, (dict, list))]
    for key, value in content.items():
        for table in value if isinstance(value, list) else [value] if isinstance(value, dict) else []:
            lines.append(f"[[{key}]]" if isinstance(value, list) else f"[{key}]")
            lines += [f"{name} = {cell(part)}" for name, part in table.items()]
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="session")
def stick_slip():
    """Data set of the small rig."""
    from stickslip.simulation.scenario import make_scenario, simulate

    return simulate(make_scenario(rig()))
