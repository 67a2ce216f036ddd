"""Parts of the pages that Panel has not: the frame, the sliders of a model, the catalogue. Each is drawn from rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel as pn
import param
from panel.custom import JSComponent

BUTTON = """
:host(.solid) .bk-btn.bk-btn-default, .bk-btn.bk-btn-default {
  border: 1px solid var(--wb-accent); border-radius: 4px; background: var(--wb-surface); color: var(--wb-accent);
  font-size: 14px;
}
:host(.solid) .bk-btn.bk-btn-default:hover:not([disabled]) { background: var(--wb-accent); color: var(--wb-surface); }
:host(.solid) .bk-btn.bk-btn-default[disabled] { border-color: var(--wb-line); color: var(--wb-soft); opacity: 0.6; }
:host(.solid) .bk-btn-group .bk-btn.bk-btn-default.bk-active { background: var(--wb-accent); color: var(--wb-surface); }
"""
GAP = (0, 10, 0, 0)  # pixels beside what stands in a row
NATURAL = {"sizing_mode": None}  # of a row or column: as large as its parts; "fixed" would need a width and a height
Message = dict[str, Any]


def button(name: str, call: Callable[[], Any], width: int, **more: Any) -> pn.widgets.Button:
    """A button of that width (pixels) that calls a function; ``more`` as of Panel's own."""
    made = pn.widgets.Button(name=name, width=width, stylesheets=[BUTTON], **more)
    made.on_click(lambda event: call())
    return made


def field(kind: type, name: str, width: int, **more: Any) -> Any:
    """A widget of a kind of Panel's, of that width (pixels); ``more`` as of its own."""
    return kind(name=name, width=width, **{"margin": GAP, **more})


def static(*names: str) -> str:
    """The text of files of the pages, one after the other."""
    return "\n".join((Path(__file__).parent / "static" / name).read_text(encoding="utf-8") for name in names)


_STYLE = [static("parts.css")]


class Spoken(JSComponent):
    """A part that tells what was done with it.

    Attributes:
        heard: is given every message.
    """

    heard = param.Parameter(None, precedence=-1)
    _rename = {"heard": None}

    def __init__(self, heard: Callable[[Message], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.heard = heard

    def _handle_msg(self, data: Any) -> None:
        """What a window tells; anything that is not a table of the expected form is left alone."""
        if self.heard is not None and isinstance(data, dict):
            self.heard(data)


class Words(JSComponent):
    """A line of text, shown as it is."""

    text = param.String("")

    _esm = """
    export function render({ model }) {
      const line = document.createElement("div")
      line.className = "line"
      const update = () => { line.textContent = model.text }
      model.on("text", update)
      update()
      return line
    }
    """
    _stylesheets = _STYLE


class Signs(JSComponent):
    """What the signs of several figures stand for, once for all of them.

    Attributes:
        rows: tables with ``sign`` (a character), ``colour`` and ``text``.
    """

    rows = param.List([])

    _esm = """
    export function render({ model }) {
      const line = document.createElement("div")
      line.className = "line"
      const update = () => line.replaceChildren(...model.rows.flatMap((row) => {
        const sign = document.createElement("span")
        sign.style.color = row.colour
        sign.textContent = row.sign
        return [sign, ` ${row.text}\u2003`]
      }))
      model.on("rows", update)
      update()
      return line
    }
    """
    _stylesheets = _STYLE


class Frame(Spoken):
    """The head of the window: title, model, errors, what is going on, what must be read; and the keyboard.

    Attributes:
        well: whether what is said is a note, and nothing wrong.
        keyed: whether the arrows are told as ``{"kind": "key", "key": name}``.
    """

    title = param.String("")
    model = param.String("")
    errors = param.String("")
    busy = param.String("")
    share = param.Number(0.0)
    searching = param.String("")
    searched = param.Number(0.0)
    said = param.String("")
    well = param.Boolean(False)
    keyed = param.Boolean(False)
    dark = param.Boolean(False)
    colours = param.Dict({})

    _esm = static("part.js", "frame.js")
    _stylesheets = _STYLE


class Knobs(Spoken):
    """A slider for every parameter.

    Attributes:
        rows: tables with ``name``, ``label``, ``group``, ``text``, ``prior``, ``place`` (0 to 1), ``band``,
            ``low``, ``high`` and ``locked``.
        given: tables with ``label``, ``text`` and ``doc`` of what no hand moves.
        closed: whether none can be moved at present.
    """

    rows = param.List([])
    given = param.List([])
    closed = param.Boolean(False)

    _esm = static("part.js", "knobs.js")
    _stylesheets = _STYLE


class Catalogue(Spoken):
    """Effects by their evidence, each with its signature, what it gains, and a switch.

    Attributes:
        rows: tables with ``tag``, ``words``, ``share`` (0 to 1), ``gain``, ``unseen``, ``amplitude``, ``similar``,
            ``picture`` (two lists of points, 0 to 1), ``on`` and ``chosen``.
        closed: whether none can be switched at present.
    """

    rows = param.List([])
    closed = param.Boolean(False)

    _esm = static("part.js", "catalogue.js")
    _stylesheets = _STYLE
