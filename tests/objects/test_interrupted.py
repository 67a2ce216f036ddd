"""An interruption ends long work at once; nothing half done is left or read as a result."""

from __future__ import annotations

import itertools
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss
from stickslip.objects import posterior
from tests.scenario.conftest import rig

pytestmark = pytest.mark.slow

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


def stopping(heard: list[str], at: int):
    """Progress that is interrupted when it is told for the ``at``-th time."""

    def tell(text: str, share: float | None = None) -> None:
        heard.append(text)
        if len(heard) == at:
            raise KeyboardInterrupt

    return tell


@pytest.mark.parametrize("at", [1, 3])
@pytest.mark.parametrize(
    "work",
    [
        lambda tell: ss.load_campaign(SHIPPED).fit(progress=tell),
        lambda tell: ss.simulate(ss.make_scenario(rig()), progress=tell),
    ],
    ids=["fit", "simulate"],
)
def test_work_ends_at_once_and_leaves_nothing(work, at, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before, heard = sorted(SHIPPED.parent.iterdir()), []
    with pytest.raises(KeyboardInterrupt):
        work(stopping(heard, at))
    assert len(heard) == at
    assert list(tmp_path.iterdir()) == [] and sorted(SHIPPED.parent.iterdir()) == before


class Normal:
    """A density that takes no time, in place of a fit's; the process is interrupted at one of its evaluations."""

    size = 2

    def __init__(self, interrupted: int = 0) -> None:
        self.calls, self.interrupted = itertools.count(1), interrupted

    def at(self, x: np.ndarray) -> tuple[None, float, np.ndarray]:
        if next(self.calls) == self.interrupted:
            os.kill(os.getpid(), signal.SIGINT)
        return None, -0.5 * float(x @ x), -x


def drawn(monkeypatch, density: Normal, tell, draws: int = 50):
    pytest.importorskip("nutpie")
    monkeypatch.setattr(posterior, "posterior_density", lambda _: density)
    monkeypatch.setattr(posterior, "_expanded", lambda way, names, x: {posterior.STRENGTH: np.asarray(x[0])})
    fit = SimpleNamespace(force_fit=None, free=[], campaign=SimpleNamespace(title="none"), parts=[])
    return posterior.sample(fit, draws, 10, 2, 0, tell)


def test_a_sample_is_whole_and_told_draw_by_draw(monkeypatch):
    heard = []
    found = drawn(monkeypatch, Normal(), lambda text, share: heard.append(share))
    assert dict(found.posterior.sizes) == {"chain": 2, "draw": 50}
    assert heard == pytest.approx(np.arange(1, 121) / 120)


def test_a_sample_that_is_interrupted_while_it_tells_is_none(monkeypatch):
    heard = []
    with pytest.raises(KeyboardInterrupt):
        drawn(monkeypatch, Normal(), stopping(heard, 3))
    assert len(heard) == 3


def test_a_sample_that_is_interrupted_while_it_draws_is_none(monkeypatch):
    """As by Ctrl-C, which reaches the thread that waits: no shorter sample, as nutpie by itself gives."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # what is begun in the background ignores it
    try:
        with pytest.raises(KeyboardInterrupt):
            drawn(monkeypatch, Normal(200), lambda text, share: None, draws=1_000_000)
    finally:
        signal.signal(signal.SIGINT, before)
