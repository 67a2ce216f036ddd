"""What can be opened: a campaign file, a run folder made from one, and what lies in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..objects.campaign import load_campaign
from ..objects.example import example
from ..system.runstore import RESULT, read_result
from .session import Session

CAMPAIGN = "campaign.toml"
TRACES = "[[trace]]"
MOST = 40  # campaigns that are offered
LARGEST = 1 << 20  # bytes of a campaign file


def opened(path: Path, effects: Sequence[Path] = ()) -> Session:
    """A session on a campaign file or a run folder, with the model that was saved there.

    Raises:
        InputError: as of :func:`stickslip.load_campaign`; a run folder whose campaign or effect is not found.
    """
    own = tuple(p.resolve() for p in effects)
    file = path / CAMPAIGN if path.is_dir() else path
    if file.is_file() or not path.is_dir():
        return Session(campaign=load_campaign(file, own), effect_files=own)
    from ..inference.fit.serialised import KEY
    from ..objects.diagnosis import Diagnosis
    from ..objects.fitted_run import load_run

    result = read_result(path)
    campaign = load_campaign(campaign_of(path, result), own)
    session = Session(campaign=campaign, effect_files=own)
    if result.get("kind") == "diagnose":
        session.diagnosis = Diagnosis(campaign, None, result, {}, path)
    if KEY in result:
        session.saved = load_run(path)
    return session


def campaign_of(folder: Path, result: dict[str, Any]) -> Path:
    """The campaign file that a run folder was made from.

    Raises:
        InputError: there is none, or it is not there any more.
    """
    named = [Path(str(i.get("file", ""))) for i in result.get("inputs", ()) if isinstance(i, dict)]
    campaigns = [path for path in named if path.suffix == ".toml"]
    for path in campaigns:
        for base in (Path(), folder, *folder.resolve().parents):
            if (base / path).is_file() and is_campaign(base / path):
                return base / path
    raise InputError(
        "the campaign that this run folder was made from is not found", file=folder / RESULT,
        value=str(campaigns[0]) if campaigns else None,
        hint="open the campaign file itself: stickslip open campaign.toml",
    )  # fmt: skip


def is_campaign(path: Path) -> bool:
    """Whether a TOML file describes measured runs."""
    try:
        return path.stat().st_size < LARGEST and TRACES in path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False


def offered(folder: Path) -> list[Path]:
    """Campaigns in a folder and in those in it, and the example that is shipped."""
    near = sorted({*folder.glob("*.toml"), *folder.glob("*/*.toml"), *folder.glob("scenarios/*/*.toml")})
    found = [path for path in near if is_campaign(path)][:MOST]
    shipped = example()
    if shipped is None or any(path.resolve() == shipped.resolve() for path in found):
        return found
    return [*found, shipped]
