"""A method whose function stands in another module, which is imported when it is first asked for."""

from __future__ import annotations

import importlib
from typing import Any


class LazyMethod:
    """Stands in a class for the function of the same name of another module, written beside what it returns.

    Type checkers take the function itself (an import under ``TYPE_CHECKING``), and so does the class once it was
    asked for: signature and text are written once.

    Args:
        module: where the function is, absolute.
    """

    def __init__(self, module: str) -> None:
        self.module = module

    def __set_name__(self, owner: type, name: str) -> None:
        self.owner, self.name = owner, name

    def __get__(self, instance: object | None, owner: type) -> Any:
        function = getattr(importlib.import_module(self.module), self.name)
        setattr(self.owner, self.name, function)
        return function.__get__(instance, owner)
