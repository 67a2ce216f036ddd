"""A method whose function stands in another module, which is imported when it is first asked for."""

from __future__ import annotations

import importlib
from functools import update_wrapper
from types import FunctionType
from typing import Any


class LazyMethod:
    """Stands in a class for the function of the same name of another module, written beside what it returns.

    Type checkers take the function itself (an import under ``TYPE_CHECKING``), and the class has it as a method once it
    was asked for: signature and text are written once.

    The class keeps the function as it is when it is first asked for; what is put in its place in the module later
    is not seen.

    Args:
        module: where the function is, absolute.
    """

    def __init__(self, module: str) -> None:
        self.module = module

    def __set_name__(self, owner: type, name: str) -> None:
        self.owner, self.name = owner, name

    def __get__(self, instance: object | None, owner: type) -> Any:
        function = getattr(importlib.import_module(self.module), self.name)
        method = FunctionType(
            function.__code__, function.__globals__, self.name, function.__defaults__, function.__closure__
        )
        update_wrapper(method, function)
        method.__kwdefaults__ = function.__kwdefaults__
        method.__module__ = self.owner.__module__
        method.__qualname__ = f"{self.owner.__qualname__}.{self.name}"  # as errors call it
        setattr(self.owner, self.name, method)
        return method.__get__(instance, owner)
