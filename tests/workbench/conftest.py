"""A campaign with something hidden, and its base model, fitted once."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import stickslip as ss

SCENARIO = Path(__file__).parents[2] / "scenarios" / "hidden-effect"


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """A copy of the shipped campaign, in which histories may be written."""
    made = tmp_path_factory.mktemp("campaign")
    for path in SCENARIO.iterdir():
        if path.is_file():
            shutil.copy(path, made)
    return made


@pytest.fixture(scope="session")
def campaign(folder):
    return ss.load_campaign(folder / "campaign.toml")


@pytest.fixture(scope="session")
def base(campaign):
    return campaign.fit()


@pytest.fixture(scope="session")
def aged(base):
    """The base model with the hidden effect, fitted once."""
    return base.add("contact-ageing")
