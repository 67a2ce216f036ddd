"""What a window shows besides the model: fields as they were filled in, which come back after a reload or a restart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from .session import Session, watch


class SavedFields:
    """Fields of a page.

    Args:
        session: which keeps their values.
        key: of these fields in ``session.view``.
        fields: name -> widget with a ``value``.
    """

    def __init__(self, session: Session, key: str, fields: Mapping[str, Any]) -> None:
        self._session, self._key, self._fields, self._own = session, key, fields, False
        for field in fields.values():
            field.param.watch(self._changed, "value")
        watch(session, ["restored"], self.restore)
        self.restore()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """What is filled in within it is nobody's wish, and not kept."""
        before, self._own = self._own, True
        try:
            yield
        finally:
            self._own = before

    def _changed(self, event: Any) -> None:
        if not self._own:
            self._session.remember(self._key, {name: field.value for name, field in self._fields.items()})

    def restore(self) -> None:
        """Fill in what was kept, as far as it can be chosen now."""
        kept = self._session.view.get(self._key)
        if not isinstance(kept, dict):
            return
        with self.aside():
            for name, field in self._fields.items():
                if name in kept and _fits(field, kept[name]):
                    with suppress(ValueError, TypeError):  # of another version
                        field.value = kept[name]


def _fits(field: Any, value: Any) -> bool:
    if field.value is not None and type(value) is not type(field.value):
        return False
    low, high = getattr(field, "start", None), getattr(field, "end", None)
    if (low is not None and value < low) or (high is not None and value > high):
        return False
    options = getattr(field, "options", None)
    if options is None:
        return True
    known = list(options.values()) if isinstance(options, dict) else list(options)
    return all(each in known for each in value) if isinstance(value, list) else value in known
