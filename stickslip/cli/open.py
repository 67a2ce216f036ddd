"""``stickslip open``: the workbench in the browser."""

from __future__ import annotations

import ipaddress
from pathlib import Path

from ..errors import InputError
from ..workbench import need_pages
from .parameters import Files

LOOPBACK = "127.0.0.1"


def open(
    campaign: Path | None = None, *, port: int = 0, browser: bool = True, effect: Files = (), address: str = LOOPBACK
) -> int:
    """Open the workbench in the browser: compare, see where the model fails, add an effect, watch the error fall.

    Parameters
    ----------
    campaign:
        TOML file that describes the rig and its measured runs; or the run folder that a command made of one; or a
        scenario, which is simulated first, into NAME-simulated in this folder. Default: a page to choose from what lies
        in this folder, or to begin a campaign with a file that is dropped there.
    port:
        Of the server; 0 for any that is free.
    browser:
        Open the browser; --no-browser only prints the address.
    effect:
        A Python file with an effect of your own. Its code is run, and run again whenever the file is saved.
    address:
        Another address of this machine under which the server is reached, from other machines as well.
    """
    need_pages()
    from ..workbench.open_paths import offered, opened
    from ..workbench.serve import serve
    from ..workbench.session import Session

    def tell(url: str) -> None:
        print(f"stickslip workbench: {url}", flush=True)

    if campaign is None:
        if effect:
            what = "an effect of your own is tried on a campaign"
            raise InputError(what, key="--effect", hint="name the campaign too")
        session = Session(offers=tuple(offered(Path())), home=Path().resolve())
    else:
        session = opened(_simulated(campaign) if _is_scenario(campaign) else campaign, effect)
    if not _own(address):
        print(f"stickslip: the workbench is reached from other machines under {address}", flush=True)
    serve(session, port=port, address=address, browser=browser, tell=tell)
    return 0


def _own(address: str) -> bool:
    """Whether an address is that of this machine for itself."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def _is_scenario(path: Path) -> bool:
    """Whether a file describes a rig to simulate, and no measured runs."""
    from ..workbench.open_paths import is_campaign

    if path.suffix != ".toml" or not path.is_file() or is_campaign(path):
        return False
    text = path.read_text(encoding="utf-8", errors="replace")
    return any(line.strip() in ("[block]", "[drive]", "[contact]") for line in text.splitlines())


def _simulated(scenario: Path) -> Path:
    """The run folder with the measurement that a scenario gives; simulated only where it is not there yet."""
    from ..system.runstore import RESULT, file_record, read_result
    from .simulate import simulate

    folder = Path(f"{scenario.stem}-simulated")
    if (folder / RESULT).is_file():
        known = {record.get("sha256") for record in read_result(folder).get("inputs", ())}
        if file_record(scenario)["sha256"] in known:
            return folder
    simulate(str(scenario), out=folder, force=True)
    return folder
