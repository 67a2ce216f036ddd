"""A campaign with something hidden, and its base model, fitted once."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

import stickslip as ss

SCENARIO = Path(__file__).parents[2] / "scenarios" / "hidden-effect"


def campaign_in(folder: Path) -> Path:
    """The shipped campaign's file in a folder, with all that it names."""
    for path in SCENARIO.iterdir():
        if path.is_file():
            shutil.copy(path, folder)
    return folder / "campaign.toml"


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """A copy of the shipped campaign, in which histories may be written."""
    return campaign_in(tmp_path_factory.mktemp("campaign")).parent


@pytest.fixture(scope="session")
def campaign(folder):
    return ss.load_campaign(folder / "campaign.toml")


@pytest.fixture(scope="session")
def base(campaign):
    return campaign.fit()


@pytest.fixture
def session(campaign, base):
    """A session with the base model."""
    from stickslip.workbench.session import Session

    made = Session(campaign=campaign)
    made.first(base)
    return made


@pytest.fixture(scope="session")
def aged(base):
    """The base model with the hidden effect, fitted once."""
    return base.add("contact-ageing")


def numbers(thing: Any, where: str = "") -> dict[str, float]:
    """Every number of a result, by the way to it."""
    if isinstance(thing, dict):
        return {k: v for key, value in thing.items() for k, v in numbers(value, f"{where}/{key}").items()}
    if isinstance(thing, list):
        return {k: v for i, value in enumerate(thing) for k, v in numbers(value, f"{where}/{i}").items()}
    return {where: thing} if isinstance(thing, (int, float)) else {}
