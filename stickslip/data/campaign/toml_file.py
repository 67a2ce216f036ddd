"""Reading the TOML files people write: campaigns and scenarios, each told from the other."""

from __future__ import annotations

import difflib
import hashlib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ...errors import InputError, nearest

Kind = Literal["campaign", "scenario"]

_MOST_BYTES = 10_000_000
_SHOWN = 8  # files in a hint
_SIMILAR = 0.5  # ratio from which one name may have been meant by another
_COMMANDS = {"campaign": "inspect, fit and diagnose", "scenario": "simulate and creep"}


@dataclass(frozen=True)
class TomlFile:
    """What stands in a file: its tables, its text, and the SHA-256 of its bytes."""

    content: dict[str, Any]
    text: str
    sha256: str


def read_toml(path: Path, kind: Kind) -> TomlFile:
    """Read a file of one kind.

    Raises:
        InputError: not there, a folder, too large, not UTF-8, not TOML, or a file of the other kind.
    """
    raw = _bytes(path, kind)
    try:
        text = raw.decode("utf-8-sig")
        content = tomllib.loads(text)
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        if path.suffix != ".toml":
            raise InputError(f"not a {kind} file", file=path, hint=_wanted(path, kind)) from None
        if isinstance(error, tomllib.TOMLDecodeError):
            hint = "correct the line; text stands in quotes"
            raise InputError(f"not valid TOML: {error}", file=path, hint=hint) from None
        line = raw[: error.start].count(b"\n") + 1
        raise InputError("not a text file in UTF-8", file=path, key=f"line {line}", hint="save it as UTF-8") from None
    except RecursionError:
        raise InputError("tables and lists are nested too deeply", file=path) from None
    found = _kind(content)
    if found and found != kind:
        hint = f"a {found} file is for {_COMMANDS[found]}; stickslip new {kind} writes a {kind} file to start from"
        raise InputError(f"this is a {found} file, where a {kind} file is wanted", file=path, hint=hint)
    return TomlFile(content, text, hashlib.sha256(raw).hexdigest())


def _kind(content: dict[str, Any]) -> Kind | None:
    """Which kind of file has these tables; None where they tell neither."""
    measured = {"rig", "trace"} & content.keys()
    simulated = {"block", "contact", "drive"} & content.keys()
    if bool(measured) == bool(simulated):
        return None
    return "campaign" if measured else "scenario"


def _instead(path: Path, kind: str) -> str:
    """What was meant by a name that is not there: all such files have one ending, which says nothing."""
    beside = sorted(path.parent.glob("*.toml")) if path.parent.is_dir() else []
    close = [p.name for p in beside if difflib.SequenceMatcher(None, p.stem, path.stem).ratio() >= _SIMILAR]
    if close:
        return nearest(path.name, close)
    new = f"stickslip new {kind} FILE writes one to start from"
    names = [repr(p.name) for p in beside[:_SHOWN]] + ["..."] * (len(beside) > _SHOWN)
    return f"there is {', '.join(names)}; {new}" if names else new


def _wanted(path: Path, kind: Kind) -> str:
    """How to fix it where something else was named, such as a file of measurements."""
    if kind == "scenario":
        return "name a .toml file; stickslip new scenario writes one to start from"
    return f'name the .toml file; for measurements, stickslip new campaign writes one, and  file = "{path.name}"  in it'


def _bytes(path: Path, kind: Kind) -> bytes:
    try:
        if path.is_dir():
            raise InputError(f"not a {kind} file but a folder", file=path, hint="name the .toml file in it")
        with path.open("rb") as stream:  # no more is read than a file may have
            raw = stream.read(_MOST_BYTES + 1)
        if len(raw) > _MOST_BYTES:
            raise InputError(f"too large for a {kind} file", file=path, hint=_wanted(path, kind))
        return raw
    except FileNotFoundError:
        raise InputError(f"the {kind} file is not there", file=path, hint=_instead(path, kind)) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"the {kind} file cannot be opened ({reason})", file=path) from None
