"""The workbench: a campaign and its model in the browser, skins over :mod:`stickslip.objects`.

``stickslip.workbench(campaign)`` shows the same pages in a notebook.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A package that can be called: its name is the function's."""

    def __call__(self, campaign: Any) -> Any:
        """The pages of a campaign, for a notebook on this machine: a frame onto a server in its kernel.

        Args:
            campaign: a :class:`stickslip.Campaign`; its base model is fitted beside (seconds).
        """
        from .serve import Window
        from .session import Session

        return Window(Session(campaign=campaign, effects=campaign.effects))


sys.modules[__name__].__class__ = _Callable
