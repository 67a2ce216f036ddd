"""A run more for a campaign: its columns guessed from the header, its file stored, its table put into the campaign."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..data import campaign as files
from ..data.readers import Columns, read_columns
from ..errors import InputError
from ..objects.campaign import Campaign, load_campaign
from ..system.runstore import alone, write_aside
from ..system.units import factor_to_si, to_si
from .file_names import new_place

NONE = "-"  # no column
VELOCITY = "velocity of the load point"
CHANNELS = {
    "time": "s", "displacement": "m", "velocity": "m/s", "spring_force": "N", "drive_position": "m", "normal_load": "N",
}  # fmt: skip
_NAMES = {
    "time": r"^(t|time|times|zeit|elapsed|seconds?|sec)$|time",
    "drive_position": r"drive|stage|motor|load.?point|actuator",
    "normal_load": r"normal|^n$|^fn$",
    "displacement": r"disp|position|^pos$|^x$|weg|reading|counts?$|vibrom|deflection|^s$",
    "velocity": r"^v$|vel|speed",
    "spring_force": r"force|^f$|^ft$|kraft|load.?cell|friction",
}
_FIRST = ("time", "drive_position", "normal_load")  # whose names tell most
_TOML = ".toml"
CAMPAIGN = "campaign.toml"
FOLDER = "name of the new folder"


@dataclass
class Choice:
    """What a run's file holds, as it was guessed or confirmed.

    Attributes:
        columns: channel (see :data:`CHANNELS`) -> name of its column, for those there are.
        units: channel -> unit text; "" for the one that the file says.
        sampling_rate: such as "10 kHz", where no column is the time.
        drive_velocity: such as "50 um/s", or "50 um/s until 5 s, 0 um/s until 10 s", where the load point is not
            measured; "" where the force is.
        resolution: of the displacement, such as "8 nm", or "".
        name: of the run; "" for that of the file.
        virgin: whether the contact was freshly set down.
    """

    columns: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    sampling_rate: str = ""
    drive_velocity: str = ""
    resolution: str = ""
    name: str = ""
    virgin: bool = False


def look(name: str, content: bytes) -> Columns:
    """The columns of a file that was dropped; nothing is stored.

    Raises:
        InputError: it cannot be read.
    """
    with tempfile.TemporaryDirectory() as aside:
        path = Path(aside) / f"dropped{Path(name).suffix.lower()}"
        path.write_bytes(content)
        try:
            return read_columns(path)
        except InputError as error:
            raise _of(error, name) from None


def _of(error: InputError, file: str) -> InputError:
    """The same error in another file: in place of one that was written aside, the one that somebody knows."""
    return type(error)(error.what, file=file, key=error.key, value=error.value, allowed=error.allowed, hint=error.hint)


def guess(columns: Columns, campaign: Campaign | None = None) -> Choice:
    """What the columns are, by those of the campaign's other runs, by their names and by their units."""
    made = _as_before(columns, campaign)
    taken = set(made.columns.values())
    for channel in (*_FIRST, *(c for c in CHANNELS if c not in _FIRST)):
        si = CHANNELS[channel]
        if channel in made.columns or (channel == "time" and made.sampling_rate):
            continue
        scores = {n: _score(channel, n, columns.units.get(n), si) for n in columns.data if n not in taken}
        best = max(scores, key=lambda n: scores[n], default=None)
        if best is not None and scores[best] > 0:
            made.columns[channel] = best
            taken.add(best)
    if "time" in made.columns and not _increases(columns.data[made.columns["time"]]):
        del made.columns["time"]
    for channel, name in made.columns.items():
        made.units.setdefault(channel, columns.units.get(name, ""))
    if not {"displacement", "velocity", "spring_force"} & set(made.columns):
        left = [n for n in columns.data if n not in made.columns.values()]
        if len(left) == 1:
            made.columns["displacement"] = left[0]
            made.units["displacement"] = columns.units.get(left[0], "")
    return made


def _as_before(columns: Columns, campaign: Campaign | None) -> Choice:
    """As the last run of the campaign whose columns are all here."""
    if campaign is None or not campaign.description.filed:
        return Choice()
    for entry in reversed(campaign.description.entries):
        specs = {name: getattr(entry, name) for name in CHANNELS if getattr(entry, name) is not None}
        found = {}
        for name, spec in specs.items():
            try:
                found[name] = columns.find(spec.column)
            except InputError:
                break
        if len(found) < len(specs) or any(isinstance(s.column, int) for s in specs.values()):
            continue
        units = {name: spec.unit or columns.units.get(found[name], "") for name, spec in specs.items()}
        rate = "" if entry.sampling_rate is None else f"{entry.sampling_rate:.12g} Hz"
        count = entry.displacement.resolution if entry.displacement is not None else None
        return Choice(found, units, rate, resolution="" if count is None else f"{count:.12g} m", virgin=entry.virgin)
    return Choice()


def _score(channel: str, name: str, unit: str | None, si: str) -> int:
    named = bool(re.search(_NAMES[channel], name.strip().lower()))
    if unit is None:
        return 2 if named else 0
    try:
        factor_to_si(unit, si)
    except InputError:
        return 0
    if channel in ("drive_position", "normal_load") and not named:
        return 0
    return 3 if named else 1


def _increases(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return known.size > 1 and float(np.mean(np.diff(known) > 0)) > 0.99


def entry_text(file: str, choice: Choice, said: Mapping[str, str] | None = None) -> str:
    """The ``[[trace]]`` table of a run.

    Args:
        file: name of its file.
        choice: what its columns are.
        said: column -> unit that the file itself says.

    Raises:
        InputError: a unit, a velocity or a rate cannot be read, or something is missing or given twice.
    """
    said = said or {}
    lines = ["[[trace]]", f"file = {_text(file)}"]
    if choice.name.strip():
        lines.append(f"name = {_text(choice.name.strip())}")
    if "time" not in choice.columns:
        if not choice.sampling_rate.strip():
            raise InputError("neither a column of times nor a sampling rate is given", key="sampling rate",
                             allowed="such as 10 kHz")  # fmt: skip
        to_si(choice.sampling_rate, "Hz", key="sampling rate")
        lines.append(f"sampling_rate = {_text(choice.sampling_rate.strip())}")
    for channel, si in CHANNELS.items():
        column = choice.columns.get(channel)
        if column is None:
            continue
        unit = choice.units.get(channel, "").strip() or said.get(column, "")
        words = channel.replace("_", " ")
        if not unit:
            raise InputError("the unit is missing", key=words, allowed=f"a unit of {si}, or a count such as 7.91 nm")
        factor_to_si(unit, si, key=words)
        parts = [f"column = {_text(column)}", f"unit = {_text(unit)}"]
        if channel == "displacement" and choice.resolution.strip():
            to_si(choice.resolution, "m", key="resolution")
            parts.append(f"resolution = {_text(choice.resolution.strip())}")
        lines.append(f"{channel} = {{ {', '.join(parts)} }}")
    _check(choice)
    if choice.drive_velocity.strip():
        lines.append(_drive(choice.drive_velocity))
    lines.append(f"virgin = {'true' if choice.virgin else 'false'}")
    return "\n".join(lines) + "\n"


def _check(choice: Choice) -> None:
    """What the campaign's file asks of a run, in the words of the form."""
    if not {"displacement", "velocity", "spring_force"} & set(choice.columns):
        raise InputError("no column is the displacement, the velocity or the force", key="columns")
    given, measured = bool(choice.drive_velocity.strip()), "drive_position" in choice.columns
    if given and measured:
        raise InputError("given beside a column of its position", key=VELOCITY, hint="keep one of them")
    if not (given or measured or "spring_force" in choice.columns):
        raise InputError("neither it nor a column of its position is given", key=VELOCITY, allowed="such as 50 um/s")


def _drive(text: str) -> str:
    """One velocity, or velocities with the times until which they last."""
    key = VELOCITY
    if "until" not in text:
        to_si(text.strip(), "m/s", key=key)
        return f"drive_velocity = {_text(text.strip())}"
    pieces = []
    for piece in filter(None, (part.strip() for part in re.split(r"[,;]", text))):
        velocity, until, end = (part.strip() for part in piece.partition("until"))
        if not until or not end:
            raise InputError("a velocity without its end", key=key, value=piece, allowed="such as 50 um/s until 5 s")
        to_si(velocity, "m/s", key=key)
        to_si(end, "s", key=key)
        pieces.append(f"{{ until = {_text(end)}, velocity = {_text(velocity)} }}")
    return f"drive = [{', '.join(pieces)}]"


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def appended(old: bytes, text: str) -> bytes:
    """A campaign file with a table more at its end; what was there stays byte for byte, with its own line ends."""
    end = "\r\n" if b"\r\n" in old else "\n"
    gap = "" if old.endswith(b"\n") or not old else end
    return old + (gap + end + text.replace("\n", end)).encode()


def create(home: Path, folder: str, name: str, content: bytes, text: str, rig: Mapping[str, str]) -> Campaign:
    """A campaign of one run in a new folder; all of it or nothing.

    Args:
        home: in which the folder is made.
        folder: its name, and the campaign's title.
        name, content: of the run's file.
        text: the run's table, of :func:`entry_text`.
        rig: key -> value with its unit, for what is known: ``mass``, ``spring_stiffness``.

    Raises:
        InputError: a name cannot be used or is there already, or the campaign cannot be loaded.
    """
    place = new_place(home, folder, FOLDER)
    known = [f"{key} = {_text(value.strip())}" for key, value in rig.items() if value.strip()]
    whole = "\n".join(["schema = 1", f"title = {_text(place.name)}", "", "[rig]", *known, "", text])
    with tempfile.TemporaryDirectory(prefix=".stickslip-", dir=home) as aside:
        made = Path(aside) / "made"
        made.mkdir()
        write_aside(new_place(made, run_name(name), "file"), content)
        write_aside(made / CAMPAIGN, whole)
        try:
            described = files.load_campaign(made / CAMPAIGN)
            files.load_trace(described, described.entries[-1])
        except InputError as error:
            raise _of(error, CAMPAIGN) from None
        made.rename(place)
    return load_campaign(place / CAMPAIGN)


def run_name(name: str) -> str:
    """A name for a run's file.

    Raises:
        InputError: it is the name of a campaign file.
    """
    if Path(name).suffix.lower() == _TOML:
        raise InputError("a run is a file of measurements", key="file", value=name, hint="give it another ending")
    return name


def add(campaign: Campaign, name: str, content: bytes, text: str) -> Campaign:
    """Store a run's file beside the campaign and put its table into it; both or neither.

    Args:
        campaign: with a file.
        name: of the run's file.
        content: of it.
        text: its table, of :func:`entry_text`.

    Returns:
        The campaign, loaded anew.

    Raises:
        InputError: the name cannot be used or is there already, or the campaign with it cannot be loaded.
    """
    described = campaign.description
    if not described.filed:
        raise InputError("this campaign has no file", hint="only a campaign of a file can be given a run more")
    run_name(name)
    toml, folder = described.path, described.folder
    trial = folder / f".{toml.stem}.adding{_TOML}"
    with alone(toml):
        stored = new_place(folder, name, "file")
        whole = appended(toml.read_bytes(), text)
        try:
            write_aside(stored, content)
            write_aside(trial, whole)
            changed = files.load_campaign(trial)
            files.load_trace(changed, changed.entries[-1])
            trial.replace(toml)
        except BaseException as error:
            stored.unlink(missing_ok=True)
            if isinstance(error, InputError) and error.file is not None:
                raise _of(error, toml.name) from None
            raise
        finally:
            trial.unlink(missing_ok=True)
    return load_campaign(toml, campaign.effect_files)
