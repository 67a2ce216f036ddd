"""*Keep*: what stands as a run folder, the steps that led to it, and the same in Python and as a command."""

from __future__ import annotations

import re
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import panel as pn

from ..errors import InputError, RunFolderError
from ..runstore import RESULT, read_result
from .controls import BUTTON
from .session import Session, watch

TITLE = "Keep"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}")
MOST = 40  # run folders that are listed


def page(session: Session) -> Any:
    """The page of a session."""
    return pn.Row(
        pn.Column(_saving(session), _folders(session), sizing_mode="stretch_width", margin=(8, 24, 0, 0)),
        pn.Column(_history(session), _lines(session), sizing_mode="stretch_width", margin=(8, 0, 0, 0)),
        sizing_mode="stretch_width",
    )


def target(session: Session, name: str) -> Path:
    """The run folder of this name beside the campaign's file.

    Raises:
        InputError: not a plain name, or the campaign has no folder.
    """
    if not NAME.fullmatch(name) or name.endswith((".", " ")):
        raise InputError(
            "not a name for a run folder",
            value=name[:80],
            allowed="letters, digits, blanks, points, - and _, no folders",
        )
    if session.campaign is None or not session.campaign.description.filed:
        raise InputError("the campaign has no folder", hint="save it from Python: fit.save(folder)")
    return Path(session.campaign.description.folder) / name


def save(session: Session, name: str, what: str, replace: bool) -> str:
    """Write the model or the diagnosis as a run folder, as the command does; what to say of it.

    Args:
        session: of the workbench.
        name: of the folder, which lies beside the campaign's file.
        what: "model" or "diagnosis".
        replace: an existing run folder.
    """
    found = session.diagnosis if what == "diagnosis" else session.fit
    try:
        folder = target(session, name)
        if found is None:
            raise InputError(f"there is no {what} yet")
        if what == "model" and found.by_hand:
            raise InputError("parameters were set by hand", hint="Fit first: what is kept has deviations of a fit")
        found.save(folder, force=replace)
    except (InputError, RunFolderError) as error:
        return str(error)
    return f"written to {folder.name}: report.html, result.json, arrays.nc"


def kept(folder: Path) -> list[dict[str, Any]]:
    """Run folders beside a campaign's file, the newest first: name, what, unseen error, report."""
    rows = []
    for path in folder.glob(f"*/{RESULT}"):
        try:
            result = read_result(path.parent)
            ladder = result.get("ladder") or [{}]
            verdict, model = result.get("verdict") or {}, " + ".join(ladder[-1].get("model", ()))
            rows.append(
                {
                    "name": path.parent.name,
                    "what": f"{result.get('kind', '')}: {verdict.get('kind') or model}",
                    "unseen": ladder[-1].get("heldout_error"),
                    "when": path.stat().st_mtime,
                }
            )
        except (RunFolderError, OSError, AttributeError, TypeError, KeyError):
            continue
    return sorted(rows, key=lambda row: -row["when"])[:MOST]


def _saving(session: Session) -> Any:
    name = pn.widgets.TextInput(name="Name of the run folder, beside the campaign's file", value="kept", width=320)
    what = pn.widgets.RadioButtonGroup(options=["model", "diagnosis"], value="model", width=200)
    replace = pn.widgets.Checkbox(name="replace an existing run folder")
    button = pn.widgets.Button(name="Save", stylesheets=[BUTTON], width=90, sizing_mode="fixed")
    said = pn.pane.HTML("")

    def done(text: str) -> None:
        said.object = f"<p>{escape(text)}</p>"
        session.param.trigger("steps")

    def press(event: Any) -> None:
        said.object = "<p>simulating freely and writing ...</p>"
        doc, chosen = pn.state.curdoc, (str(name.value), str(what.value), bool(replace.value))

        def job() -> None:
            text = save(session, *chosen)
            if doc is None or doc.session_context is None:
                done(text)
            else:
                doc.add_next_tick_callback(partial(done, text))

        session.worker("", job)

    button.on_click(press)
    return pn.Column("### Save", name, what, replace, button, said)


def _folders(session: Session) -> Any:
    made = pn.pane.HTML("", sizing_mode="stretch_width")

    def update() -> None:
        campaign = session.campaign
        rows = [] if campaign is None or not campaign.description.filed else kept(Path(campaign.description.folder))
        if not rows:
            made.object = "<p>No run folder is beside the campaign's file yet.</p>"
            return
        cells = "".join(
            f"<tr><td>{escape(row['name'])}</td><td>{escape(str(row['what']))}</td>"
            f"<td style='text-align:right'>{'' if row['unseen'] is None else format(row['unseen'], '.3f')}</td></tr>"
            for row in rows
        )
        made.object = (
            "<table><thead><tr><th>run folder</th><th>what</th><th>unseen error / floor</th></tr></thead>"
            f"<tbody>{cells}</tbody></table><p>Each holds <code>report.html</code>; two are compared by "
            "<code>stickslip compare A B</code>.</p>"
        )

    watch(session, ["steps", "diagnosis", "campaign"], update)
    update()
    return pn.Column("### Run folders here", made)


def _history(session: Session) -> Any:
    place = pn.Column(sizing_mode="stretch_width")

    def go(number: int, event: Any) -> None:
        session.show(number)

    def update() -> None:
        rows: list[Any] = []
        for i, step in enumerate(session.steps):
            error = f"{step.fit.error:.3f}"
            button = pn.widgets.Button(
                name=f"{i + 1}. {step.text}: error {error}" + ("  ◀" if i == session.at else ""), stylesheets=[BUTTON],
                width=460, sizing_mode="fixed", margin=(0, 0, 4, 0),
            )  # fmt: skip
            button.on_click(partial(go, i))
            rows.append(button)
        place[:] = rows or [pn.pane.Str("no step yet")]

    watch(session, ["steps", "at"], update)
    update()
    return pn.Column("### Steps (a click goes there)", place)


def _lines(session: Session) -> Any:
    python = pn.widgets.TextAreaInput(
        name="The same in Python", disabled=False, height=180, sizing_mode="stretch_width"
    )
    command = pn.widgets.TextInput(name="The same as a command", sizing_mode="stretch_width")

    def update() -> None:
        if session.campaign is None:
            return
        python.value = session.code()
        command.value = next((s.command for s in reversed(session.taken) if s.command), "")

    watch(session, ["steps", "at", "campaign"], update)
    update()
    return pn.Column(python, command, sizing_mode="stretch_width")
