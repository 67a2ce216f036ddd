"""What is selected: a cycle of a run, by the keyboard, a click or by name; all windows of a session select together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .picked import chosen, select
from .session import Session

if TYPE_CHECKING:
    from ..objects.fit import Fit


def follow(session: Session, key: str) -> None:
    """The keyboard: left and right go through the cycles of a run, up and down through the runs."""
    if session.campaign is None:
        return
    fitted = cycles(session)
    modelled = bool(fitted) and (session.run in fitted or not session.run)
    (run, event), choice = (selected(session), choose) if modelled else (chosen(session), select)
    names = list(fitted) if modelled else list(session.campaign.names)
    if key in ("ArrowUp", "ArrowDown"):
        at = (names.index(run) + (1 if key == "ArrowDown" else -1)) % len(names)
        choice(session, names[at], event)
    elif key in ("ArrowLeft", "ArrowRight"):
        choice(session, run, event + (1 if key == "ArrowRight" else -1))


def cycles(session: Session) -> dict[str, int]:
    """Run -> number of its cycles in the fit."""
    fit = session.fit
    if fit is None:
        return {}
    problem = fit.force_fit.problem
    return {k.name: k.events for k in problem.runs}


def choose(session: Session, run: str, event: int) -> None:
    """Select a cycle, or the nearest there is."""
    count = cycles(session).get(run, 1)
    session.param.update(run=run, event=min(max(event, 0), max(count - 1, 0)))
    session.later()


def selected(session: Session) -> tuple[str, int]:
    """The cycle that is selected; the middle one of the first run where none was."""
    counts = cycles(session)
    if session.run in counts:
        return session.run, min(max(session.event, 0), counts[session.run] - 1)
    name = next(iter(counts), "")
    return name, counts.get(name, 1) // 2


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
