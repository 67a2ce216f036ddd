"""The form by which a run is added: a file is dropped, its columns are guessed, and whoever dropped it confirms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import panel as pn

from ..data.readers import Columns
from ..errors import InputError
from ..objects.campaign import Campaign
from ..system.units import to_si
from .background_work import Show, Tell, background
from .file_names import new_place
from .new_run import CHANNELS, FOLDER, NONE, VELOCITY, Choice, add, create, entry_text, guess, look
from .page_parts import Table, head, progress
from .session import Session, watch
from .widgets import NATURAL, Words, button, field

LARGEST = 500  # MB of a file
ROWS = 3  # of the file that are shown
DROP = """
.filepond--panel-root { background-color: var(--wb-surface); }
.filepond--drop-label, .filepond--drop-label label { color: var(--wb-text); }
"""
WORDS = {
    "time": "time", "displacement": "displacement of the block", "velocity": "velocity of the block",
    "spring_force": "force of the spring", "drive_position": "position of the load point",
    "normal_load": "normal load",
}  # fmt: skip


BESIDE = (5, 10)  # pixels around a field
_text: Any = partial(field, pn.widgets.TextInput, width=210, margin=BESIDE)


class Dropper(pn.widgets.FileDropper):
    """Takes a file whose size is counted here too, for a request need not come from a page that keeps to its bound.

    Args:
        refused: told the name of a file that is too large, of which nothing is held.
        given: as of Panel's own.
    """

    def __init__(self, refused: Callable[[str], None], **given: Any) -> None:
        super().__init__(multiple=False, max_file_size=f"{LARGEST}MB", chunk_size=4_000_000, **given)
        self._refused, self._size = refused, 0

    def _process_event(self, event: Any) -> None:
        data, whole = event.data, self._file_buffer
        if event.event_name == "upload_event":
            if data["chunk"] == 1:
                for held in (whole, self.value, self.mime_type):  # of a file before, or one that was given up
                    held.clear()
                self._size = 0
            elif data["name"] not in whole:  # refused before
                return
            self._size += len(data["data"])
            if self._size > LARGEST * 1_000_000:
                whole.clear()
                self._refused(data["name"])
                return
        super()._process_event(event)


@dataclass(frozen=True)
class Read:
    """A file that was dropped, and what was found in it.

    Attributes:
        form: into which it was dropped; other windows have their own.
        name: of the file.
        columns: of it, None where it cannot be read.
        said: why it cannot be.
    """

    form: Form
    name: str
    columns: Columns | None
    said: str = ""


class Form:
    """What is asked for of a file that was dropped, which becomes a run of the campaign.

    Attributes:
        view: to be shown.
        dropped: name and content of the file, None before there is one.
    """

    asking = "Add a run: drop its file here, or choose one"
    doing = "adding the run"

    def __init__(self, session: Session) -> None:
        self._session, self._work, self._reading = (
            session,
            background(session, "adding"),
            background(session, "reading"),
        )
        self.dropped: tuple[str, bytes] | None = None
        self._given = b""
        self._found: Read | None = None
        self._columns: Columns | None = None
        self.drop = Dropper(self._refuse, height=90, margin=(4, 0), stylesheets=[DROP])
        self.columns = {
            name: field(pn.widgets.Select, words, 190, options=[NONE], margin=BESIDE) for name, words in WORDS.items()
        }
        self.units = {name: _text(name="unit", placeholder=si, width=80) for name, si in CHANNELS.items()}
        self.rate = _text(name="sampling rate, without a column of times", placeholder="10 kHz")
        self.velocity = _text(name=VELOCITY, placeholder="50 um/s, or 50 um/s until 5 s, ...")
        self.resolution = _text(name="one count of the displacement, if known", placeholder="8 nm")
        self.stored = _text(name="stored beside the campaign as")
        self.run = _text(name="name of the run, if another")
        self.virgin = field(pn.widgets.Checkbox, "the contact was freshly set down", 210, margin=BESIDE)
        self.add = button("Add the run", self.send, 140, margin=(12, 0))
        self.said = Words()
        self._first = Table()
        rows = [pn.Row(self.columns[n], self.units[n], **NATURAL) for n in CHANNELS]
        more = (self.rate, self.velocity, self.resolution, self.virgin)
        last = (*self._asked_besides(), self.stored, self.run, self.add)
        self._asked = pn.Column(
            self._first,
            pn.FlexBox(*(pn.Column(*part, **NATURAL) for part in (rows[:3], rows[3:], more, last)), gap="0 12px"),
            visible=False,
        )  # fmt: skip
        self.view = pn.Column(
            head(self.asking), self.drop, self.said, self._asked, progress(self._reading),
            progress(self._work, stopping=False),
        )  # fmt: skip
        self.drop.param.watch(self._dropped, "value")
        watch(self._work, ["doing", "found"], self._update)
        watch(self._reading, ["found"], self._read)

    def _dropped(self, event: Any) -> None:
        files = dict(event.new or {})
        if not files:
            return
        name, content = list(files.items())[-1]
        self.take(str(name), content.encode() if isinstance(content, str) else bytes(content))

    def _refuse(self, name: str) -> None:
        self.dropped, self._asked.visible = None, False
        self.said.text = (
            f"{name} is larger than {LARGEST} MB, the most that is taken here: put it beside the campaign's file "
            "and write its [[trace]] table there"
        )

    def take(self, name: str, content: bytes) -> None:
        """Look into a file, beside all else, and show what its columns seem to be."""
        self._asked.visible = False
        self.dropped = None
        if self._reading.doing:
            self.said.text = "another file is being read: drop this one again when that is done"
            return

        def make(tell: Tell, show: Show) -> Read:
            tell(f"reading {name}", 0.0)
            try:
                return Read(self, name, look(name, content))
            except (InputError, OSError, ValueError) as error:
                return Read(self, name, None, str(error))

        self._given = content
        self._reading.do(f"reading {name}", make)

    def _read(self) -> None:
        """Show what was found in a file that was dropped here."""
        found: Read | None = self._reading.found
        if found is None or found.form is not self or found is self._found:
            return
        self._found = found
        self._columns, name = found.columns, found.name
        if self._columns is None:
            self.said.text = found.said
            return
        self.dropped = (name, self._given)
        self.stored.value = name
        self.fill(guess(self._columns, self._session.campaign))
        made = self._columns
        names = list(made.data)
        written = [f"{n} [{made.units[n]}]" if n in made.units else n for n in names]
        rows = [[f"{made.data[n][i]:.7g}" if i < made.data[n].size else "" for n in names] for i in range(ROWS)]
        self._first.param.update(columns=written, rows=rows)
        count = max((v.size for v in made.data.values()), default=0)
        notes = "".join(f"; {text}" for text in (*made.notes, *(f"{n}: {why}" for n, why in made.ignored.items())))
        self.said.text = f"{name}: {count} rows, read by {made.reader}{notes}. Are these the columns?"
        self._asked.visible = True

    def fill(self, choice: Choice) -> None:
        """Show a choice, to be confirmed."""
        assert self._columns is not None
        options = [NONE, *self._columns.data]
        for name in CHANNELS:
            self.columns[name].param.update(options=options, value=choice.columns.get(name, NONE))
            self.units[name].value = choice.units.get(name, "")
        self.rate.value, self.velocity.value = choice.sampling_rate, choice.drive_velocity
        self.resolution.value, self.run.value, self.virgin.value = choice.resolution, choice.name, choice.virgin

    def choice(self) -> Choice:
        """What was confirmed."""
        columns = {n: str(w.value) for n, w in self.columns.items() if w.value not in (NONE, None)}
        return Choice(
            columns, {n: self.units[n].value.strip() for n in columns}, self.rate.value.strip(),
            self.velocity.value.strip(), self.resolution.value.strip(), self.run.value.strip(), bool(self.virgin.value),
        )  # fmt: skip

    def send(self) -> None:
        """Store what was dropped and show the campaign with it."""
        if self.dropped is None or self._columns is None:
            return
        name, content = self.stored.value.strip(), self.dropped[1]
        try:
            self._check(name)
            text = entry_text(name, self.choice(), self._columns.units)
        except InputError as error:
            self.said.text = str(error)
            return
        if self._session.busy:
            self.said.text = f"{self._session.busy}: add the run when that is done, or cancel it"
            return

        def make(tell: Tell, show: Show) -> Campaign:
            tell(self.doing, 0.0)
            return self._store(name, content, text)

        self._work.do(self.doing, make)

    def _asked_besides(self) -> tuple[Any, ...]:
        return ()

    def _check(self, name: str) -> None:
        new_place(self._session.data.description.folder, name, "stored as")

    def _store(self, name: str, content: bytes, text: str) -> Campaign:
        """Store the file and put its table into the campaign."""
        made = add(self._session.data, name, content, text)
        self._session.reopen(made)
        self._work.said = f"{name} is stored beside the campaign, which has {len(made)} runs now"
        return made

    def _update(self) -> None:
        self.add.disabled = bool(self._work.doing)
        if self._work.found is not None and self._work.found is self._session.campaign and self.dropped is not None:
            self.dropped, self._asked.visible, self.said.text = None, False, ""


class FirstRun(Form):
    """The same where nothing is open: the file becomes the first run of a campaign in a new folder."""

    asking = "Or begin a campaign: drop the file of a run here, or choose one"
    doing = "making the campaign"

    def _asked_besides(self) -> tuple[Any, ...]:
        self.folder = _text(name=FOLDER, placeholder="my-rig")
        self.mass = _text(name="mass of the block", placeholder="89.4 g")
        self.spring = _text(name="stiffness of the spring", placeholder="980 N/m")
        self.add.name, self.stored.name = "Make the campaign", "name of the file in it"
        return self.folder, self.mass, self.spring

    def _check(self, name: str) -> None:
        assert self._session.home is not None
        new_place(self._session.home, self.folder.value, FOLDER)
        for asked, unit in ((self.mass, "kg"), (self.spring, "N/m")):
            if asked.value.strip():
                to_si(asked.value, unit, key=asked.name)

    def _store(self, name: str, content: bytes, text: str) -> Campaign:
        assert self._session.home is not None
        rig = {"mass": self.mass.value, "spring_stiffness": self.spring.value}
        made = create(self._session.home, self.folder.value.strip(), name, content, text, rig)
        self._session.show_first(made)
        return made


def adding(session: Session) -> Any:
    """The form of a session; a line of words where the campaign has no file."""
    if not session.data.description.filed:
        return Words(text="Runs can be added to a campaign that has a file.")
    return Form(session).view
