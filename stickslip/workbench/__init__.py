"""The workbench: a campaign and its model in the browser, skins over :mod:`stickslip.objects`.

``stickslip.workbench(campaign)`` shows the same pages in a notebook.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from ..system.extras import need


def need_pages() -> None:
    """Refuse to begin without the packages that the pages are made with.

    Raises:
        InputError: some are not installed.
    """
    need("the workbench", "workbench", "panel", "bokeh", "tsdownsample", "watchfiles")


class CallableModule(ModuleType):
    """A package that can be called: its name is the function's."""

    def __call__(self, campaign: Any, *, tall: int = 1000, proxy: str | None = None) -> Any:
        """The pages of a campaign, for a notebook: a frame onto a server in its kernel, on that machine only.

        Args:
            campaign: a :class:`stickslip.Campaign`; its base model is fitted beside (seconds).
            tall: pixels of the frame.
            proxy: path of Jupyter under which ``jupyter-server-proxy`` forwards ports, such as ``"/proxy"``, for a
                browser on another machine; "" for none. Default: that of the JupyterHub that runs the kernel, if any.

        Returns:
            A :class:`stickslip.workbench.serve.Window`, which ends the server with ``close()`` or a ``with`` block.

        Raises:
            InputError: the server cannot listen, or packages that the pages are made with are not installed.
        """
        need_pages()
        import os

        from .serve import Window
        from .session import Session

        if proxy is None:
            hub = os.environ.get("JUPYTERHUB_SERVICE_PREFIX", "")
            proxy = f"{hub.rstrip('/')}/proxy" if hub else ""
        return Window(Session(campaign=campaign, effect_files=campaign.effect_files), tall, proxy)


sys.modules[__name__].__class__ = CallableModule
