"""The workbench: a campaign and its model in the browser, skins over :mod:`stickslip.objects`.

``stickslip.workbench(campaign)`` shows the same pages in a notebook, ``stickslip.workbench.view(fit)`` one fit.
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

    def view(self, fit: Any) -> Any:
        """Interactive pictures of a fit, as an object of Panel: for a notebook, a dashboard or a page of one's own.

        Force and residual of a cycle, the creep before its onset, the residual of all runs against a variable of
        choice, and the backbone (not of a model that was set by hand). No server is begun. A notebook shows them after
        ``panel.extension()``; ``.save("fit.html", resources=bokeh.resources.INLINE)`` writes a page, in which cycle and
        variable cannot be chosen.

        Args:
            fit: a :class:`stickslip.Fit`.

        Returns:
            A ``panel.Column``.

        Raises:
            ArgumentError: something else than such a fit.
            InputError: packages that the pages are made with are not installed.
        """
        need_pages()
        from .fit_view import fit_view

        return fit_view(fit)


sys.modules[__name__].__class__ = CallableModule
