"""Packages that only some work needs: an extra of the installation each."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from ..errors import InputError


def need(what: str, extra: str, *modules: str, file: Path | None = None, instead: str = "") -> None:
    """Refuse work whose packages are not installed, before any of it is done.

    Args:
        what: the work.
        extra: of the installation, which has them.
        modules: that are imported for it.
        file: that it is done on.
        instead: what else would do.

    Raises:
        InputError: names those that are missing, and how to install them.
    """
    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        are = "is" if len(missing) == 1 else "are"
        hint = f"pip install 'stickslip[{extra}]'{f', or {instead}' if instead else ''}"
        raise InputError(f"{what} needs {', '.join(missing)}, which {are} not installed", file=file, hint=hint)
