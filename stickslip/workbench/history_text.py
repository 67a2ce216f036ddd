"""The history of steps as texts, and lines of Python and commands that do the same."""

from __future__ import annotations

from datetime import datetime
from shlex import quote
from typing import Any

from ..system.units import shown_with
from . import simulation_lines
from .background_work import background
from .session import Session

RIVALS = "rivals"
SIMULATIONS = ("simulation", "sweep", RIVALS)


def rows(session: Session) -> list[list[str]]:
    """A row for each step, those that were undone among them."""
    made = []
    for i, step in enumerate(session.steps):
        fit = step.fit
        unseen = "" if fit.by_hand else shown_with(fit.unseen_error, fit.unseen_error_std)
        undone = "undone" if i > session.at else "shown" if i == session.at else ""
        made.append([str(i + 1), step.text, when(step.when), shown_with(fit.error, fit.error_std), unseen, undone])
    return made


def told(session: Session) -> dict[str, Any]:
    """The same for a run folder: the steps to the model as it stands, and lines and commands that do the same."""
    steps = [{"step": step.text, "when": step.when, "error": step.fit.error} for step in session.taken]
    return {"steps": steps, "python": session.code().splitlines(), "commands": commands(session).splitlines()}


def when(text: str) -> str:
    """Day and time, without the day if that is today."""
    return text.removeprefix(datetime.now().strftime("%Y-%m-%d ")) if text else ""


def commands(session: Session) -> str:
    """Commands that come to the model as it stands, and to the diagnosis."""
    fit = session.fit
    file = quote(session.data.description.path.name)
    own = session.options()
    made, by_hand = [], False
    if fit is not None:
        by_hand = any("with_values" in step.code or "refit" in step.code for step in session.taken)
        added = "".join(f" --add {form}" for form in fit.effect_forms)
        made.append(f"stickslip fit {file}{added}{own} --out fit")
        if by_hand:
            made.append("# what was set by hand or locked has no command: the lines of Python have it")
    made.append(f"stickslip diagnose {file}{own} --out diagnosis")
    for name, found in simulated(session).items():
        if fit is None or by_hand or name == RIVALS or found.code != session.code():
            made.append(f"# {name}: saved as a run folder it holds its model, and the command in its result.json")
        else:
            made.append(simulation_lines.command(found, "fit", name, own))
    return "\n".join(made)


def python(session: Session) -> str:
    """Lines of Python that come to the model as it stands, and to what was simulated last."""
    code = session.code()
    made = [code]
    for name, found in simulated(session).items():
        first = found[0] if name == RIVALS else found
        made += ["", f"# {name}{'' if first.code == code else ', of the model that these lines lead to'}"]
        made += [] if first.code == code else [first.code]
        made += simulation_lines.python(found, 1)
    return "\n".join(made)


def simulated(session: Session) -> dict[str, Any]:
    """What was simulated last, for what there is."""
    found = {name: background(session, name).found for name in SIMULATIONS}
    return {name: each for name, each in found.items() if each}
