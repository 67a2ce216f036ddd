"""How objects look in a console and in a notebook: facts and tables, as text or as HTML."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from .units import ends, shown

if TYPE_CHECKING:
    import pandas

ROWS = 30  # of a table that are shown
STYLE = "border-left:3px solid #8d99ae;padding-left:0.8em;margin:0.4em 0"


class Shown(abc.ABC):
    """An object made of parts that can be shown: texts and tables."""

    @abc.abstractmethod
    def _parts(self) -> Sequence[Any]:
        """Texts (str) and tables (pandas)."""

    def __repr__(self) -> str:
        return "\n\n".join([f"<{type(self).__name__}>", *(_text(part) for part in self._parts())])

    def _repr_html_(self) -> str:
        head = f"<strong>{type(self).__name__}</strong>"
        return f'<div style="{STYLE}">{head}{"".join(_html(part) for part in self._parts())}</div>'


def table(rows: Mapping[str, Mapping[str, Any]], index: str) -> pandas.DataFrame:
    """A row for each key."""
    import pandas

    found = pandas.DataFrame.from_dict({k: dict(v) for k, v in rows.items()}, orient="index")
    return found.rename_axis(index)


def quantity(value: Any, unit: str = "1") -> str:
    """A number with its unit, of an array the least and the largest; ``traced`` where jit or a derivative passes."""
    import jax

    if isinstance(value, jax.core.Tracer):
        return "traced"
    if not isinstance(value, (int, float, np.ndarray, np.number, jax.Array)):
        return repr(value)
    found = np.asarray(value, float)
    if not found.size:
        return "none"
    return ends(found, unit) if found.ndim else shown(float(found), unit)


def facts(values: Mapping[str, Any]) -> str:
    """Facts on one line."""
    return "; ".join(f"{key}: {value}" for key, value in values.items() if value not in (None, "", []))


def _text(part: Any) -> str:
    if isinstance(part, str):
        return part
    return str(part.to_string(max_rows=ROWS, float_format=_number))


def _html(part: Any) -> str:
    if isinstance(part, str):
        first, *lines = part.split("\n")
        items = "".join(f"<li>{escape(line.removeprefix('- '))}</li>" for line in lines)
        return f"<p>{escape(first)}</p>" + (f"<ul>{items}</ul>" if items else "")
    return str(part.to_html(max_rows=ROWS, float_format=_number, border=0, escape=True))


def _number(value: float) -> str:
    return f"{value:.4g}"
