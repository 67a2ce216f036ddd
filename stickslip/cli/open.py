"""``stickslip open``: the workbench in the browser."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import InputError

NEEDED = ("panel", "bokeh", "watchfiles")
LOOPBACK = "127.0.0.1"


def open(
    campaign: Path,
    *,
    port: int = 0,
    browser: bool = True,
    effect: Annotated[tuple[Path, ...], Parameter(negative="", show_default=False)] = (),
    address: str = LOOPBACK,
) -> int:
    """Open the workbench in the browser: compare, see where the model fails, add an effect, watch the error fall.

    The server runs on this machine until Ctrl-C. Only those who have the printed address, with its random token, reach
    it. What was done is kept in a folder .stickslip-workbench beside the campaign's file, and comes back when the same
    campaign is opened again.

    Parameters
    ----------
    campaign:
        TOML file that describes the rig and its measured runs.
    port:
        Of the server; 0 for any that is free.
    browser:
        Open the browser; --no-browser only prints the address.
    effect:
        A Python file with an effect of your own. Its code is run, and run again whenever the file is saved.
    address:
        Another address of this machine under which the server is reached, from other machines as well.
    """
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(
            f"the workbench needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed",
            hint="pip install 'stickslip[workbench]'",
        )
    from ..workbench.serve import serve, session_of

    def tell(url: str) -> None:
        print(f"stickslip workbench: {url}", flush=True)

    if address != LOOPBACK:
        print(f"stickslip: the workbench is reached from other machines under {address}", flush=True)
    serve(session_of(campaign, effect), port=port, address=address, browser=browser, tell=tell)
    return 0
