"""Traces whose onsets and arrests are known in closed form."""

from dataclasses import dataclass

import numpy as np
import pytest

from stickslip.errors import InputError


@dataclass(frozen=True)
class StickSlip:
    """A block that creeps at a hundredth of the drive's speed and slips along half a cosine.

    Each slip takes ``duration`` s and ``size`` m; its velocity is (size/2) w sin(w (t - t_k)), w = pi/duration, so
    onset (through a threshold) and arrest (zero) are known exactly. After it the block rings, decaying.
    """

    v0: float = 50e-6
    period: float = 1.0
    duration: float = 0.03
    events: int = 6
    ring: float = 0.0
    ring_frequency: float = 400.0

    @property
    def w(self) -> float:
        return np.pi / self.duration

    @property
    def creep(self) -> float:
        return 0.01 * self.v0

    @property
    def size(self) -> float:
        return self.v0 * self.period - self.creep * (self.period - self.duration)

    @property
    def starts(self) -> np.ndarray:
        return self.period * np.arange(1, self.events + 1) - self.duration

    @property
    def arrests(self) -> np.ndarray:
        return self.starts + self.duration

    @property
    def stop(self) -> float:
        return self.period * (self.events + 0.5)

    def onsets(self, threshold: float) -> np.ndarray:
        return self.starts + np.arcsin(threshold / (0.5 * self.size * self.w)) / self.w

    def position(self, t: np.ndarray) -> np.ndarray:
        x = np.zeros_like(t)
        edge = 0.0
        for start in self.starts:
            x += self.creep * np.clip(t - edge, 0, start - edge)
            x += 0.5 * self.size * (1 - np.cos(self.w * np.clip(t - start, 0, self.duration)))
            edge = start + self.duration
            after = np.clip(t - edge, 0, None)
            ringing = -self.ring * np.exp(-after / 0.01) * np.sin(2 * np.pi * self.ring_frequency * after)
            x += np.where(after < self.period / 2, ringing, 0.0)
        return x + self.creep * np.clip(t - edge, 0, None)


@pytest.fixture
def stick_slip():
    return StickSlip


@pytest.fixture
def refuses():
    """Check that something raises an `InputError` whose message holds all these words."""

    def check(action, *words):
        with pytest.raises(InputError) as caught:
            action()
        assert caught.value.exit_code == 2
        for word in words:
            assert word in str(caught.value), f"{word!r} is not in: {caught.value}"
        return caught.value

    return check


@pytest.fixture
def campaign(tmp_path):
    """Write a campaign with one trace of a small CSV file; the parts can be replaced."""

    def write(trace="", *, rig="", rows=None, name="c.toml", header="time,x"):
        if rows is not None:
            np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=header, comments="", fmt="%.12g")
        path = tmp_path / name
        path.write_text(f'schema = 1\n[rig]\n{rig}\n[[trace]]\nfile = "a.csv"\n{trace}\n', encoding="utf-8")
        return path

    return write
