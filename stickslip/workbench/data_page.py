"""*Data*: runs with their events, signals to pan and zoom, one event beside the others, and a run more by a drop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn

from ..data.segment import Segmentation
from ..objects.campaign import Campaign
from ..system.units import shown
from .background_work import BackgroundWork, Show, Tell, background
from .event_view import EventView
from .figures import label, unit_of
from .new_run_form import adding
from .page_parts import Sentences, Table, progress
from .selection import chosen, select
from .session import Session, watch
from .signals import Signals

if TYPE_CHECKING:
    from ..objects.inspection import Inspection

MEASURES = {
    "t_onset": "onset", "recurrence": "recurrence", "hold_time": "hold", "slip": "slip",
    "peak_velocity": "peak velocity", "rise_time": "rise", "overshoot": "overshoot", "ring_frequency": "ringing",
    "decay_time": "decay",
}  # fmt: skip


@dataclass(frozen=True)
class Looked:
    """What was found in the data.

    Attributes:
        campaign: that was looked at.
        events: of its runs.
        inspection: the whole of it, None while it is being made.
    """

    campaign: Campaign
    events: tuple[Segmentation, ...]
    inspection: Inspection | None = None


def page(session: Session) -> Any:
    """The page of a session."""
    work = background(session, "inspection")
    signals, event = Signals(session), EventView(session)
    bar = progress(work, stopping=False)

    def look_at() -> None:
        campaign = session.data
        known = work.found is not None and work.found.campaign is campaign
        if not known and not session.busy:
            work.do("analysing the data", lambda tell, show: looked(campaign, tell, show))

    watch(session, ["campaign", "busy"], look_at)
    watch(work, ["doing"], look_at, now=True)
    return pn.Column(
        pn.Row(pn.Column(_runs(session), bar), _told(session, work)), signals.whole, *signals.figures.values(),
        pn.Row(*event.figures.values()), _events(session, work), adding(session), margin=(8, 0, 24, 0),
    )  # fmt: skip


def looked(campaign: Campaign, tell: Tell, show: Show) -> Looked:
    """Events first, which are there soon, then what else there is to say."""
    tell("finding the events", 0.0)
    show(Looked(campaign, campaign.events))
    tell("analysing the events", 0.3)
    return Looked(campaign, campaign.events, campaign.inspect())


def run_rows(campaign: Campaign) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the table of runs."""
    columns = ["run", "slips", "drive", "length", "sampling", "signal", "contact at the start"]
    rows = []
    for trace, found in zip(campaign.traces, campaign.events, strict=True):
        drive = trace.drive_velocity
        rows.append([
            trace.name, str(len(found.events)), "not known" if drive is None else shown(drive, "m/s", 3),
            shown(trace.duration, "s", 3), shown(trace.sampling_rate, "Hz", 3), trace.leading.replace("_", " "),
            "virgin" if trace.virgin else "used",
        ])  # fmt: skip
    return columns, rows


def event_rows(found: Looked, run: str) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the table of events of a run: what is known of them so far.

    A column's head holds its unit, and the standard deviation of its values by the sensor's noise once that is known.
    """
    number = found.campaign.names.index(run)
    sensor: dict[str, float] = {}
    if found.inspection is None:
        unit = found.events[number].settings.unit
        units = {"t_onset": "s", "recurrence": "s", "hold_time": "s", "slip": unit, "peak_velocity": f"{unit}/s"}
        events = [{key: getattr(e, key) for key in units} for e in found.events[number].events]
    else:
        trace = found.inspection.result["traces"][number]
        units, events = trace["units"], trace["events"]
        sensor = {key: f["sensor"] for key, f in trace["features"].items() if _finite(f["sensor"])}
        if "recurrence" in sensor:  # of two onsets
            sensor["t_onset"] = sensor["recurrence"] / np.sqrt(2.0)
    known = [key for key in MEASURES if key in units and any(_finite(e[key]) for e in events)]
    columns = [_column(MEASURES[key], [e[key] for e in events], sensor.get(key), units[key]) for key in known]
    rows = [list(row) for row in zip(*(cells for _, cells in columns), strict=True)]
    return ["event", *(head for head, _ in columns)], [[str(i + 1), *row] for i, row in enumerate(rows)]


def _finite(value: Any) -> bool:
    return value is not None and bool(np.isfinite(float(value)))


def _column(name: str, values: Sequence[Any], std: float | None, unit: str) -> tuple[str, list[str]]:
    """Head and cells of a column in one unit, to the place of the values' standard deviation (SI) where it is known."""
    known = np.array([float(v) if _finite(v) else np.nan for v in values])
    k, shown_unit = unit_of(known, unit)
    if not std:
        return label(name, shown_unit), [f"{v * k:.4g}" if np.isfinite(v) else "-" for v in known]
    places = max(1 - int(np.floor(np.log10(std * k))), 0)  # two digits of the deviation
    cells = [f"{v * k:.{places}f}" if np.isfinite(v) else "-" for v in known]
    return f"{label(name, shown_unit)} ± {std * k:.{places}f}", cells


def groups(found: Looked | None) -> list[dict[str, Any]]:
    """Repairs, what these data can and cannot tell, as sentences under headings."""
    if found is None or found.inspection is None:
        return [{"head": "What these data can tell", "items": ["being analysed"], "mark": ""}]
    i = found.inspection
    repaired = list(i.result["dropped"])
    notes = [f"{t['name']}: {text}" for t in i.result["traces"] for text in (*t["notes"], *t["warnings"])]
    every = (
        ("Contradicted by the motion", i.findings, "bad"),
        ("Can tell", i.can, "good"),
        ("Cannot tell", i.cannot, "bad"),
        ("Repaired or left out", repaired or ["nothing"], ""),
        ("Noticed", notes, ""),
    )
    return [{"head": head, "items": list(items), "mark": mark} for head, items, mark in every if items]


def _told(session: Session, work: BackgroundWork) -> Any:
    made = Sentences(tall=264, margin=(0, 0, 0, 16))

    def update() -> None:
        found = work.found
        made.groups = groups(found if found is not None and found.campaign is session.campaign else None)

    watch(work, ["found"], update)
    watch(session, ["campaign"], update, now=True)
    return made


def _runs(session: Session) -> Table:
    made = Table(lambda number: select(session, session.data.names[number], session.event), tall=230)

    def update() -> None:
        columns, rows = run_rows(session.data)
        made.param.update(columns=columns, rows=rows)
        mark()

    def mark() -> None:
        made.chosen = session.data.names.index(chosen(session)[0])

    watch(session, ["campaign"], update, now=True)
    watch(session, ["run"], mark)
    return made


def _events(session: Session, work: BackgroundWork) -> Table:
    made = Table(lambda number: select(session, chosen(session)[0], number), tall=260, margin=(8, 0, 0, 0))

    def update() -> None:
        run, event = chosen(session)
        found = work.found
        if found is None or found.campaign is not session.data:
            found = Looked(session.data, session.data.events)
        columns, rows = event_rows(found, run)
        made.param.update(columns=columns, rows=rows, chosen=event if rows else -1)

    watch(session, ["run", "event", "campaign"], update)
    watch(work, ["found"], update, now=True)
    return made
