"""The friction damper: a rig that rings in every stroke."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

import stickslip as ss

from .along_the_motion import told
from .campaigns import shipped


def friction_damper(data: Path, work: Path) -> dict[str, Any]:
    """The diagnosis, and how the force rings in every stroke."""
    campaign = shipped("friction-damper", data, work / "friction-damper")
    return {**told("friction-damper", campaign.diagnose()), "ringing": ringing(campaign)}


def ringing(campaign: ss.Campaign) -> list[list[float]]:
    """Of every stroke of 20 mm: its way (m), and frequency (Hz) and rms (N) of what the force swings between turns."""
    out = []
    for trace in campaign.traces:
        t, x, force = trace.time, trace.displacement, trace.spring_force
        assert x is not None
        assert force is not None
        step = t[1] - t[0]
        turns = np.flatnonzero(np.diff(np.sign(savgol_filter(x, 31, 2, deriv=1))))
        for a, b in pairwise(turns.tolist()):
            if abs(x[b] - x[a]) < 0.02:
                continue
            sliding = force[a + 100 : b - 40]
            swing = sliding - savgol_filter(sliding, 121, 2)
            f = np.fft.rfftfreq(8192, step)
            power = np.abs(np.fft.rfft(swing * np.hanning(swing.size), 8192)) * ((f > 8.0) & (f < 80.0))
            out.append([float(x[b] - x[a]), float(f[np.argmax(power)]), float(swing.std())])
    return out
