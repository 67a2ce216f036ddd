"""What is selected: an event of a run, or a cycle of the fit; all windows of a session select together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .session import Session

if TYPE_CHECKING:
    from ..objects.fit import Fit


def follow(session: Session, key: str) -> None:
    """The keyboard: left and right go through the cycles of a run, up and down through the runs."""
    if session.campaign is None:
        return
    fitted = cycles(session)
    modelled = bool(fitted) and (session.run in fitted or not session.run)
    counts = fitted if modelled else slips(session)
    names, (run, event) = list(counts), _selected(session, counts)
    if key in ("ArrowUp", "ArrowDown"):
        _select(session, names[(names.index(run) + (1 if key == "ArrowDown" else -1)) % len(names)], event, counts)
    elif key in ("ArrowLeft", "ArrowRight"):
        _select(session, run, event + (1 if key == "ArrowRight" else -1), counts)


def slips(session: Session) -> dict[str, int]:
    """Run -> number of its events in the data, whether there is a model yet or not."""
    return {t.name: len(s.events) for t, s in zip(session.data.traces, session.data.events, strict=True)}


def cycles(session: Session) -> dict[str, int]:
    """Run -> number of its cycles in the fit."""
    return {} if session.fit is None else {k.name: k.events for k in session.fit.force_fit.problem.runs}


def select(session: Session, run: str, event: int) -> None:
    """Select an event of a run, or the nearest there is."""
    _select(session, run, event, slips(session))


def choose(session: Session, run: str, event: int) -> None:
    """Select a cycle, or the nearest there is."""
    _select(session, run, event, cycles(session))


def chosen(session: Session) -> tuple[str, int]:
    """The event that is selected; the middle one of the first run where none was."""
    return _selected(session, slips(session))


def selected(session: Session) -> tuple[str, int]:
    """The same of the cycles in the fit."""
    return _selected(session, cycles(session))


def _select(session: Session, run: str, event: int, counts: dict[str, int]) -> None:
    if run in counts:
        session.param.update(run=run, event=min(max(event, 0), max(counts[run] - 1, 0)))
        session.later()


def _selected(session: Session, counts: dict[str, int]) -> tuple[str, int]:
    name = session.run if session.run in counts else next(iter(counts), "")
    count = counts.get(name, 0)
    return name, min(max(session.event if name == session.run else count // 2, 0), max(count - 1, 0))


def worst(fit: Fit, run: str, phase: str) -> tuple[str, int] | None:
    """The cycle with the largest error in a phase of a run; "all" stands for any."""
    data = fit.force
    use = ~data.left_out.values
    use &= (data.run.values == run) | (run == "all")
    use &= (data.phase.values == phase) | (phase == "all")
    found: dict[tuple[Any, int], list[float]] = {}
    z = data.residual.values / data.floor.values
    for i in np.flatnonzero(use):
        found.setdefault((data.run.values[i], int(data.event.values[i])), []).append(z[i] ** 2)
    if not found:
        return None
    name, event = max(found, key=lambda key: float(np.mean(found[key])))
    return str(name), event
