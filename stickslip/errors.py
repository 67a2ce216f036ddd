"""The errors a user can meet, each one message that says what, where and how to fix it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

_TIED = 0.1  # spellings hardly less similar than the closest are named with it


class StickslipError(Exception):
    """Base of every error this program raises on purpose."""

    exit_code = 1


class InputError(StickslipError):
    """Something a person wrote cannot be used.

    Args:
        what: the fault, in one sentence.
        file: the file it stands in.
        key: the key, column or line in that file (``"rig.mass"``, ``"line 12"``).
        value: the offending value.
        allowed: the range or the list of what would be accepted.
        hint: how to fix it.
    """

    exit_code = 2

    def __init__(
        self,
        what: str,
        *,
        file: str | Path | None = None,
        key: str | None = None,
        value: object = None,
        allowed: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.what, self.file, self.key, self.value, self.allowed, self.hint = what, file, key, value, allowed, hint
        super().__init__(str(self))

    def at(self, *, file: str | Path | None = None, key: str | None = None) -> InputError:
        """The same error with the place filled in where it was not known yet."""
        return self.but(file=self.file or file, key=self.key or key)

    def with_hint(self, first: str) -> InputError:
        """The same error with a further line on how to fix it, before the others."""
        return self.but(hint="\n  ".join(line for line in (first, self.hint) if line))

    def but(self, **parts: Any) -> InputError:
        """The same error with some of its parts changed."""
        names = ("what", "file", "key", "value", "allowed", "hint")
        own = {name: getattr(self, name) for name in names} | parts
        return type(self)(own.pop("what"), **own)

    def __str__(self) -> str:
        where = ": ".join(str(p) for p in (self.file, self.key) if p)
        text = f"{where}: {self.what}" if where else self.what
        if self.value is not None:
            text += f" (got {self.value!r})"
        if self.allowed:
            text += f"\n  allowed: {self.allowed}"
        if self.hint:
            text += f"\n  to fix: {self.hint}"
        return text


class ArgumentError(InputError):
    """An argument that cannot be used; ``key`` is its name. A command says the option that stands for it."""


class SolveError(StickslipError):
    """The equation of motion could not be integrated; says at what time and what to change.

    Attributes:
        trajectory: of `integrate`: the motion up to there, in which the fault can be looked for; else None.
    """

    trajectory: Any = None


class FitError(StickslipError):
    """A fit did not reach a usable optimum."""


class RunFolderError(InputError):
    """A run folder cannot be written or read (exists, read-only, full, incomplete)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint that names the valid spelling closest to ``name``, those about as close, or lists all; empty for none."""
    known = sorted(known)
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    if not close:
        return f"one of: {', '.join(known)}" if known else ""
    best = difflib.SequenceMatcher(None, close[0], name).ratio()
    close = [c for c in close if difflib.SequenceMatcher(None, c, name).ratio() > best - _TIED]
    return f"did you mean {' or '.join(repr(c) for c in close)}?"
