"""Restoring a session: from the history beside the campaign, or with the model of a run folder."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import StickslipError
from .history_steps import HAND, Step, complete

if TYPE_CHECKING:
    from ..objects.fitted_run import FittedRun
    from .history_file import HistoryFile
    from .session import Session

SAME = 0.01  # standard deviations by which a parameter that was fitted anew may be off


def history(session: Session, journal: HistoryFile) -> bool:
    """Show the history that was kept; whether there was any. One that is damaged is said to be."""
    try:
        rows, fits, more = journal.read()
        session.diagnosis = journal.diagnosed() or session.diagnosis
        if not rows:
            return False
        complete(fits[-1])
        steps = tuple(Step(**row, fit=fit) for row, fit in zip(rows, fits, strict=True))
        at = min(int(more.get("at", len(steps) - 1)), len(steps) - 1)
        locked = frozenset(map(str, more.get("locked", ())))
        run, event = str(more.get("run", "")), int(more.get("event", 0))
        view = dict(more.get("view", {}))
    except (StickslipError, OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        session.said = f"what was open before cannot be shown again ({error}); the history begins again"
        return False
    session.param.update(steps=steps, at=at, locked=locked, run=run, event=event, view=view)
    session.restored += 1
    return True


def model(session: Session, saved: FittedRun) -> None:
    """Fit a saved model anew, and set what was set by hand in it, as steps; none where it stands already."""
    fit, forms, name = session.fit, list(saved.effect_forms), saved.folder.name
    assert fit is not None
    aside = list(saved.result.get("kept_aside", ()))
    runs = {run.name for run in fit.force_fit.problem.runs}
    if sorted(fit.effect_forms) != sorted(forms) or runs & set(aside):
        session.busy = f"fitting the model of {name}"
        options: dict[str, Any] = {"holdout": aside} if aside else {}
        fit = complete(session.data.fit(forms, **options))
        asked = [f"--add {form}" for form in forms] + [f"--holdout {run}" for run in aside]
        code = f"fit = campaign.fit({forms!r}{f', holdout={aside!r}' if aside else ''})"
        session.take(Step(f"the model of {name}", fit, code, " ".join(["stickslip fit campaign.toml", *asked])))
    values, own = saved.parameters["value"], fit.values
    moved = {
        n: float(values[n]) for n, std in fit.std.items() if n in values and abs(values[n] - own[n]) > SAME * std
    }  # fmt: skip
    if moved:
        line = f"fit = fit.with_values({moved!r})"
        session.take(Step(f"{HAND}: as in {name}", fit.with_values(moved), line, "", moved))
