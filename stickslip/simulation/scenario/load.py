"""Loading a scenario file: checked, in SI, with the changes asked for on the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ...data.campaign.located_errors import Place, key_lines, readable, shown_place
from ...data.campaign.toml_file import read_toml
from ...errors import InputError
from ...system.object_repr import Shown, facts
from .overrides import parse_assignment, with_overrides
from .schema import ScenarioFile, file_model

Parts = tuple[dict[str, Any], Path | None, str, Sequence[tuple[str, Any]]]


@dataclass(frozen=True, repr=False)
class Scenario(Shown):
    """A validated scenario.

    Args:
        file: everything that was written, in SI.
        path: of the file, or None where it was made in Python.
        sha256: of the file.
        content: what was read, with the changes in it, as plain tables.
        changes: key and value of every change, in order.
    """

    file: ScenarioFile
    path: Path | None
    sha256: str
    content: Mapping[str, Any]
    changes: tuple[tuple[str, Any], ...] = ()

    @property
    def folder(self) -> Path:
        """Where files named in the scenario are looked for."""
        return self.path.parent if self.path else Path()

    @property
    def title(self) -> str:
        """The title, or the file's name."""
        return self.file.title or (self.path.stem if self.path else "scenario")

    def changed(self, **changes: Any) -> Scenario:
        """A copy with keys set; dots of a key are written as two underscores (``contact__H=0.5``)."""
        return self.with_changes([(key.replace("__", "."), value) for key, value in changes.items()])

    def with_changes(self, changes: Sequence[tuple[str, Any]]) -> Scenario:
        """A copy with keys such as ``("contact.H", 0.5)`` set; checked as a file is."""
        return _checked(dict(self.content), self.path, self.sha256, (*self.changes, *changes), changes, "")

    @property
    def parts(self) -> Parts:
        """What :func:`from_parts` makes it from again, in another process."""
        return dict(self.content), self.path, self.sha256, self.changes

    def __reduce__(self) -> tuple[Any, ...]:
        # the class of its file is made for the kind of contact, so it is read again
        return from_parts, self.parts

    def _parts(self) -> list[str]:
        tables = [
            f"{name}: {facts(table)}"
            for name, content in self.content.items()
            for table in (content if isinstance(content, list) else [content])
            if isinstance(table, Mapping)
        ]
        changed = ", ".join(key for key, _ in self.changes)
        return [facts({"title": self.title, "file": self.path, "changed": changed}), *tables]


def load_scenario(path: str | Path, overrides: str | Sequence[str] = ()) -> Scenario:
    """Read and check a scenario file (TOML; ``stickslip new scenario`` writes a commented one).

    Args:
        path: of the file.
        overrides: a change such as ``"contact.H=0.5"``, or several.

    Raises:
        InputError: the file is not there, not TOML or a campaign; unknown keys, missing units, values out of range.
    """
    path = Path(path)
    changes = [parse_assignment(text) for text in ([overrides] if isinstance(overrides, str) else overrides)]
    read = read_toml(path, "scenario")
    return _checked(read.content, path, read.sha256, tuple(changes), changes, read.text)


def make_scenario(content: Mapping[str, Any], folder: str | Path | None = None) -> Scenario:
    """A scenario from nested dictionaries with the keys of the file.

    Args:
        content: as `tomllib` would read it from a file.
        folder: where files it names are looked for.
    """
    path = None if folder is None else Path(folder) / "scenario.toml"
    return _checked(dict(content), path, "", (), (), "")


def from_parts(content: dict[str, Any], path: Path | None, sha256: str, changes: Sequence[tuple[str, Any]]) -> Scenario:
    """The scenario that has these :attr:`Scenario.parts`, checked again; effects it names must be in the catalogue."""
    return _checked(content, path, sha256, changes, (), "")


def _checked(
    content: dict[str, Any],
    path: Path | None,
    digest: str,
    all_changes: Sequence[tuple[str, Any]],
    changes: Sequence[tuple[str, Any]],
    text: str,
) -> Scenario:
    content = with_overrides(content, changes)
    shown = path or Path("scenario")
    try:
        model = file_model(content)
        file = model.model_validate(content)
        if file.effect:  # made once, so that faults are found before anything runs
            from .effects import make_effects

            make_effects(file)
    except ValidationError as error:
        fault = readable(error, model, text, shown)
    except InputError as error:
        line = key_lines(text).get(_place(error.key or ""))
        fault = error.but(file=shown, key=f"line {line}: {error.key}" if line else error.key)
    else:
        return Scenario(file, path, digest, content, tuple(all_changes))
    raise _from_command_line(fault, all_changes)


def _from_command_line(fault: InputError, changes: Sequence[tuple[str, Any]]) -> InputError:
    """The same fault, placed on the command line where the value came from there."""
    key = (fault.key or "").split(": ")[-1]
    for name, _ in changes:
        if key in (name, shown_place(_place(name))):
            return fault.but(file="--set", key=name)
    return fault


def _place(key: str) -> Place:
    """``effect.1.beta`` as ``("effect", 0, "beta")``."""
    return tuple(int(part) - 1 if part.isdecimal() else part for part in key.split("."))
