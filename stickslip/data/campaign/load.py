"""Loading a campaign file: checked, in SI, and with every file in its place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ...errors import InputError, nearest
from ..readers import beside
from .located_errors import readable
from .models import CHANNELS, CampaignFile, Rig, RigKeys, TraceEntry
from .toml_file import read_toml


@dataclass(frozen=True)
class Campaign:
    """A validated campaign.

    Args:
        path: of the file; traces are looked for beside it.
        sha256: of the file.
        title, note: free text.
        rig: what is known of the apparatus, SI.
        entries: one for each trace.
        filed: whether there are such files; else the traces were made of arrays.
    """

    path: Path
    sha256: str
    title: str
    note: str
    rig: Rig
    entries: tuple[TraceEntry, ...]
    filed: bool = True

    @property
    def folder(self) -> Path:
        """Where the campaign file lies."""
        return self.path.parent

    @property
    def names(self) -> list[str]:
        """Names of the traces, in order."""
        return [entry.label for entry in self.entries]

    @property
    def files(self) -> list[Path]:
        """All files with measured numbers, each once."""
        if not self.filed:
            return []
        names = [name for entry in self.entries for name in (entry.file, *(name for _, name in _further(entry)))]
        return [self.folder / name for name in dict.fromkeys(names)]

    def entry(self, name: str) -> TraceEntry:
        """The entry of a trace; `InputError` naming the nearest where there is none."""
        for entry in self.entries:
            if entry.label == name:
                return entry
        raise InputError(f"there is no trace '{name}'", file=self.path, hint=nearest(name, self.names))

    def rig_of(self, name: str) -> Rig:
        """The rig as it was in one trace: the campaign's, with what the trace gives anew."""
        entry = self.entry(name)
        own = {key: getattr(entry, key) for key in RigKeys.model_fields if getattr(entry, key) not in (None, "")}
        return self.rig.model_copy(update=own)


def load_campaign(path: str | Path) -> Campaign:
    """Read and check a campaign file (TOML; see `campaign_template`).

    Raises:
        InputError: the file is not there, not TOML or a scenario; unknown keys, missing units, values out of range, two
            traces of one name, a trace's file that is not there or lies outside its folder without ``outside``.
    """
    path = Path(path)
    read = read_toml(path, "campaign")
    try:
        file = CampaignFile.model_validate(read.content)
    except ValidationError as error:
        raise readable(error, CampaignFile, read.text, path) from None
    entries = tuple(file.trace)
    repeated = [name for name, count in Counter(entry.label for entry in entries).items() if count > 1]
    if repeated:
        numbers = [i for i, entry in enumerate(entries, start=1) if entry.label == repeated[0]]
        what = f"traces {', '.join(map(str, numbers))} have the same name '{repeated[0]}'"
        raise InputError(what, file=path, key=f"trace[{numbers[1]}].name", hint='give one of them another name = "..."')
    for number, entry in enumerate(entries, start=1):
        for key, name in (("file", entry.file), *_further(entry)):
            trace_file(path, name, outside=entry.outside, key=f"trace[{number}].{key}")
    return Campaign(path, read.sha256, file.title, file.note, file.rig, entries)


def described(names: Sequence[str], rig: Mapping[str, Any], title: str = "") -> Campaign:
    """A campaign whose traces are there already.

    Args:
        names: of the traces.
        rig: keys and values as under ``[rig]`` of a campaign file.
        title: free text.

    Raises:
        InputError: an unknown key, a missing unit, a value out of range, two traces of one name.
    """
    try:
        checked = Rig.model_validate(dict(rig))
    except ValidationError as error:
        raise readable(error, Rig, "", None) from None
    if repeated := [name for name, count in Counter(names).items() if count > 1]:
        raise InputError(f"two traces have the same name '{repeated[0]}'", hint="give one of them another name")
    entries = tuple(TraceEntry.model_construct(file=name, name=name) for name in names)
    return Campaign(Path(title or "campaign"), "", title, "", checked, entries, filed=False)


def trace_file(campaign: Path, name: str, *, outside: bool, key: str) -> tuple[Path, bool]:
    """Where a trace's file lies, and whether that is outside the campaign's folder (links followed).

    Raises:
        InputError: not there, not a file, or outside without leave.
    """
    where = campaign.parent / name
    try:
        real, home = where.resolve(), campaign.parent.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"the file's name cannot be used ({error})", file=campaign, key=key, value=name) from None
    beyond = not real.is_relative_to(home)
    if beyond and not outside:
        hint = "move it beside the campaign, or write  outside = true  in this trace"
        raise InputError("the file lies outside the campaign's folder", file=campaign, key=key, value=name, hint=hint)
    if not real.exists():
        others = beside(where)
        hint = nearest(where.name, others) if others else "names are relative to the campaign file's folder"
        raise InputError("the file is not there", file=campaign, key=key, value=name, hint=hint)
    if not real.is_file():
        raise InputError("not a file", file=campaign, key=key, value=name)
    return where, beyond


def _further(entry: TraceEntry) -> list[tuple[str, str]]:
    given = ((name, getattr(entry, name)) for name in CHANNELS)
    return [(f"{name}.file", channel.file) for name, channel in given if channel and channel.file]
