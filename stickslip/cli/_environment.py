"""Options from the environment: ``STICKSLIP_DIAGNOSE_JOBS=4`` is ``stickslip diagnose --jobs 4``."""

from __future__ import annotations

import os
from inspect import Parameter

from cyclopts import App
from cyclopts.argument import ArgumentCollection
from cyclopts.config import Env

from ..errors import InputError, nearest

PREFIX = "STICKSLIP_"


class Environment(Env):
    """What cyclopts takes from the environment: only options, and none that the command does not have.

    Attributes:
        taken: option of the command that was called -> the variable that it is from.
    """

    taken: dict[str | None, str]

    def __init__(self) -> None:
        super().__init__(PREFIX, source="the environment", show=False)  # else the help is of twice the length
        self.taken = {}

    def __call__(self, app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
        """Give the options of a command that are not on its line the values of their variables.

        Raises:
            InputError: a variable begins as those of the command, and goes on with no option of it.
        """
        options = arguments.filter_by(kind=Parameter.KEYWORD_ONLY)
        prefix = f"{PREFIX}{'_'.join(commands).upper()}_"
        variables = {prefix + option.name.strip("-").replace("-", "_").upper(): option for option in options}
        known = list(variables)
        for name in os.environ:
            if commands and name.startswith(prefix) and name not in variables:
                what = f"the command '{' '.join(commands)}' has no such option"
                raise InputError(what, key=name, hint=nearest(name, known))
        # one that is empty is not set: of a path it would be the present folder
        options = ArgumentCollection(option for name, option in variables.items() if os.environ.get(name) != "")
        super().__call__(app, commands, options)
        self.taken = {o.name: str(token.keyword) for o in options for token in o.tokens if token.source == self.source}
