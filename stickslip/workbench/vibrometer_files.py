"""A setting as a vibrometer would record it."""

from __future__ import annotations

import shutil
from pathlib import Path

from ..objects.campaign import Campaign
from ..objects.experiments.events import run
from ..objects.experiments.setting import Setting, scenario
from ..objects.fit import Fit
from ..objects.result_base import Tell
from ..simulation.scenario.writers import write_campaign
from .file_names import new_folder

RATE = 10_000.0  # Hz at which a synthetic record is written
COUNT = 7.91e-9  # m, where the campaign's runs have no count of their own


def write(fit: Fit, setting: Setting, campaign: Campaign, name: str, tell: Tell) -> Path:
    """A setting as a vibrometer would record it: a folder in that of the campaign with a record and a campaign file.

    Raises:
        InputError: the name cannot be used or is there already; as of :func:`scenario`.
    """
    folder = new_folder(campaign, name, "name of the folder")
    counts = [t.resolution for t in campaign.traces if t.leading == "displacement" and t.resolution]
    sensor = {"resolution": float(counts[0]) if counts else COUNT}
    made = scenario(fit, setting).with_changes(
        [("sensor", sensor), ("output", {"trace": "record.csv", "sampling_rate": RATE})]
    )
    recording = run(made, tell, "simulating the record")
    aside = folder.with_name(f".{folder.name}.writing")
    shutil.rmtree(aside, ignore_errors=True)
    aside.mkdir()
    try:
        write_campaign(aside, [made], [recording])
        aside.rename(folder)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return folder
