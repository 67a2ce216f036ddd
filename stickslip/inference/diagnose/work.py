"""How a diagnosis is carried out, apart from what it is about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...system.progress import Tell, silent
from .checkpoints import Store


def _endless() -> bool:
    return True


@dataclass(frozen=True)
class Work:
    """How a diagnosis is carried out.

    Attributes:
        jobs: processes.
        tell: told the stage and the share of it done (0 to 1).
        in_time: whether there is time for more; what is not tried then is missing from the answer.
        store: keeps what is finished; None keeps nothing.
    """

    jobs: int = 1
    tell: Tell = silent
    in_time: Callable[[], bool] = _endless
    store: Store | None = None
