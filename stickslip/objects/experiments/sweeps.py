"""Events of a model over the velocity of the drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...simulation.scenario.recording import Recording
from ...simulation.scenario.schema import SweepTable
from ...simulation.scenario.series import scenarios_of
from ...system.progress import part
from ...system.units import to_si
from ..fit import Fit
from ..result_base import Tell
from .events import Spread, run, simulated
from .setting import Setting, scenario

FEWEST, MOST = 2, 40  # runs of a sweep


@dataclass(frozen=True)
class Swept:
    """Events of a model over the velocity of the drive.

    Attributes:
        fit: the model.
        setting: at the lowest velocity.
        series: the velocities that were asked for.
        velocities: m/s, as far as they are simulated.
        recordings: of each of them.
        events: the same, as of :func:`simulated`.
        code: the lines of Python that lead to the model.
    """

    fit: Fit
    setting: Setting
    series: SweepTable
    velocities: tuple[float, ...] = ()
    recordings: tuple[Recording, ...] = ()
    events: tuple[dict[str, Spread], ...] = ()
    code: str = ""

    def mean(self, key: str) -> np.ndarray:
        """Means of one of :data:`MEASURES`, shape (n,); nan where there is no event."""
        return np.array([values[key][0] for values in self.events])


def sweep(
    fit: Fit, setting: Setting, low: str, high: str, points: int, tell: Tell, show: Callable[[Swept], None],
    code: str = "",
) -> Swept:  # fmt: skip
    """Events of the model over the velocity of the drive; shown as far as they are there.

    Args:
        fit: the model.
        setting: its spring, mass, load and number of events, and the run whose sensor sees them.
        low, high: ends of the velocities, with units.
        points: how many.
        tell, show: told the progress, and what there is so far.
        code: the lines of Python that lead to the model.

    Raises:
        InputError: a velocity that cannot be read, or too many of them.
    """
    ends = [to_si(text, "m/s", key="velocities") for text in (low, high)]
    if not 0.0 < ends[0] < ends[1]:
        raise InputError("the velocities must increase", key="velocities", value=f"{low} to {high}")
    if not FEWEST <= points <= MOST:
        raise InputError("out of range", key="number of velocities", value=points, allowed=f"{FEWEST} to {MOST}")
    steady = replace(setting, velocity=low, hold="", step="", back=False)
    series = SweepTable(key="drive.velocity", start=ends[0], stop=ends[1], points=points)
    done = Swept(fit, steady, series, code=code)
    for i, (value, member) in enumerate(scenarios_of(scenario(fit, steady), series)):
        found = run(member, part(tell, i, points), f"{i + 1} of {points}: {1e6 * value:.4g} µm/s")
        done = replace(
            done, velocities=(*done.velocities, value), recordings=(*done.recordings, found),
            events=(*done.events, simulated(found, fit.campaign[setting.run])),
        )  # fmt: skip
        show(done)
    return done
