"""What is searched in a process beside the server: the promises of all effects, and the whole diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import StickslipError
from ..inference.force.candidates import every_form
from ..inference.force.first_order import Promise, promise
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.signatures import Explained
from ..objects.campaign import Campaign, load_campaign
from ..objects.diagnosis import Diagnosis
from ..objects.fit import Fit
from ..physics.effects import catalogue
from ..simulation.conformance import blamed
from .worker import Search, Tell

FIRST = (
    "contact-ageing", "rate-and-state", "contact-damping", "viscoelastic-contact", "thermal-creep", "slip-weakening",
    "drive-ripple", "sensor-drift",
)  # fmt: skip


def promises(
    fit: Fit, files: Sequence[Path], found: Callable[[Sequence[Promise], float], None],
    failed: Callable[[str], None],
) -> Search:  # fmt: skip
    """Look at every effect on top of a model; ``found`` is told the promises as they come, and the share done."""
    tags = [t for t in catalogue.tags() if t not in fit.effects]

    def told(item: Any, share: float) -> None:
        found([item], min(share, 0.999))

    return Search(partial(_promises, fit.force_fit, tags), files, told, lambda _: found([], 1.0), failed)


def _promises(base: ForceFit, tags: Sequence[str], tell: Callable[[Promise, float], None]) -> None:
    explained = Explained(base)
    forms = sorted(every_form(tags), key=lambda job: job[0] not in FIRST)
    for i, (tag, form) in enumerate(forms):
        try:
            tell(promise(base, explained, tag, form), (i + 1) / len(forms))
        except StickslipError:
            continue
        except Exception as error:
            if blamed(error) is None:
                raise


def diagnosis(
    campaign: Campaign, files: Sequence[Path], out: Path | None, tell: Tell, done: Callable[[Diagnosis], None],
    failed: Callable[[str], None],
) -> Search:  # fmt: skip
    """The whole search; its run folder is ``out``."""
    filed = campaign.description.filed
    source: Any = campaign.description.path if filed else campaign
    work = partial(_diagnosed, source, tuple(files), out)

    def made(found: tuple[dict[str, Any], dict[str, Any]]) -> None:
        done(Diagnosis(campaign, None, *found, folder=out))

    return Search(work, files, tell, made, failed)


def _diagnosed(
    source: Path | Campaign, files: Sequence[Path], out: Path | None, tell: Tell
) -> tuple[dict[str, Any], dict[str, Any]]:
    campaign = source if isinstance(source, Campaign) else load_campaign(source, files)
    if out is not None:
        out.parent.mkdir(exist_ok=True)
    found = campaign.diagnose(out=out, force=True, progress=tell)
    return found.result, found.variables
