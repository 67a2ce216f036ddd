"""A commented scenario file to start from."""

from __future__ import annotations

from pathlib import Path


def scenario_template() -> str:
    """A commented scenario file: the rig of Grzemba 2014."""
    return Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
