"""Plug-in points: named things that installed packages can add to through entry points."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import entry_points
from typing import TypeVar

from ..errors import InputError, nearest

T = TypeVar("T")


class Registry(Mapping[str, T]):
    """Things by name, a mapping: those registered here and those other packages offer in an entry point group.

    Args:
        group: the entry point group, e.g. ``"stickslip.readers"``.
        what: how messages call one of them, e.g. ``"reader"``.
        prepare: makes the thing from what an entry point loads (e.g. calls a class); default: as loaded.
        name: what a thing calls itself, by which a plug-in is then found; default: the name of its entry point.

    A plug-in that fails to load, or whose name is taken, is left out with a warning that names its package; it cannot
    stop the program.
    """

    def __init__(
        self,
        group: str,
        what: str,
        prepare: Callable[[object], T] | None = None,
        name: Callable[[T], str] | None = None,
    ) -> None:
        self.group, self.what = group, what
        self._prepare, self._name = prepare, name
        self._own: dict[str, T] = {}
        self._plugged: dict[str, T] | None = None

    def register(self, name: str, thing: T) -> T:
        """Add a thing under a name that must be free; what is defined anew (a cell run again) is replaced."""
        if name in self._own and _definition(self._own[name]) != _definition(thing):
            raise InputError(f"the name is taken by another {self.what}", value=name)
        self._own[name] = thing
        return thing

    def find(self, name: str) -> T:
        """The thing of that name; `InputError` naming the nearest where there is none."""
        if name not in self:
            raise InputError(f"there is no {self.what} '{name}'", hint=nearest(name, self))
        return self[name]

    def _all(self) -> dict[str, T]:
        """Own ones first; an own name wins over a plug-in's."""
        if self._plugged is None:
            self._plugged = self._load()
        return self._own | {name: thing for name, thing in self._plugged.items() if name not in self._own}

    def __getitem__(self, name: str) -> T:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def names(self) -> list[str]:
        """All names, own ones first."""
        return list(self)

    def packages(self) -> list[tuple[str, str]]:
        """Name and version of every installed distribution that offers something in the group, sorted."""
        found = (point.dist for point in entry_points(group=self.group))
        return sorted({(dist.name, dist.version) for dist in found if dist is not None})

    def _load(self) -> dict[str, T]:
        found: dict[str, T] = {}
        for point in entry_points(group=self.group):
            package = point.dist.name if point.dist else point.value
            try:
                loaded = point.load()
                thing: T = self._prepare(loaded) if self._prepare else loaded
                name = self._name(thing) if self._name else point.name
            except Exception as error:  # whatever a foreign package raises on import
                warnings.warn(f"the {self.what} '{point.name}' of {package} cannot be loaded: {error!r}", stacklevel=3)
                continue
            taken = self._own.get(name, found.get(name, thing))
            if taken is thing:
                found[name] = thing
            else:
                warnings.warn(f"the {self.what} '{name}' of {package} is left out: the name is taken", stacklevel=3)
        return found


def _definition(thing: object) -> tuple[str, str]:
    """Where a class, or that of an object, is defined."""
    cls = thing if isinstance(thing, type) else type(thing)
    return cls.__module__, cls.__qualname__
