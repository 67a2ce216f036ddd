"""One slip of the model as it stands, run freely from the measured arrest before it, over the measured one."""

from __future__ import annotations

import numpy as np

from ..system.units import shown
from .figures import FEW, compared, figure, label, legend, source, unit_of
from .overview import reduced
from .selection import selected
from .session import Session, watch
from .widgets import Words

AROUND = (2.0, 3.0)  # durations of the slip that are shown before and after it
POINTS = 800


class Free:
    """The panel of a session: ``figure`` and ``words``."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._measured, self._model = source(t=[], x=[]), source(t=[], x=[])
        self._model.name = "free"
        self.figure = figure("free simulation of the slip from the arrest before", height=300, output_backend=FEW)
        compared(self.figure, self._measured, self._model, ("x", "x"), "model, to its arrest")
        legend(self.figure, steady=True)
        self.words = Words(margin=(0, 0, 8, 70))
        watch(session, ["free"], self.update)
        watch(session, ["steps", "at", "run", "event"], self.ask, now=True)

    def ask(self) -> None:
        """Have it run again where model or run are others; draw what is there."""
        if self._session.fit is not None:
            self._session.run_freely(selected(self._session)[0])
            self.update()

    def update(self) -> None:
        """Draw the selected cycle."""
        fit, run, found = self._session.free
        name, number = selected(self._session)
        if fit is not self._session.fit or run != name:  # not yet
            self.words.text = "simulated when the sliders are at rest"
            if len(self._model.data["t"]):
                self._model.data = {"t": [], "x": []}
            return
        if found is None or number not in found.cycle.values:
            self._measured.data = self._model.data = {"t": [], "x": []}
            self.words.text = "this cycle cannot be simulated freely"
            return
        cycle = found.sel(cycle=number)
        trace = next(t for t in self._session.data.displaced[0] if t.name == name)
        duration, half = float(cycle.measured_arrest - cycle.measured_onset), float(cycle.measured_half)
        place = float(cycle.measured_place)
        late = float(cycle.half) - half
        off = 0.0 if np.isnan(late) else late
        span = half + min(off, 0.0) - AROUND[0] * duration, half + max(off, 0.0) + AROUND[1] * duration
        t, x = reduced(trace.time, np.asarray(trace.displacement), *span, points=POINTS)
        own = (cycle.time.values >= span[0]) & (cycle.time.values <= span[1])
        k, unit = unit_of(x - place, "m")
        m, second = unit_of(np.array(span) - half, "s")
        self._measured.data = {"t": (t - half) * m, "x": (x - place) * k}
        self._model.data = {
            "t": (cycle.time.values[own] - half) * m, "x": (cycle.displacement.values[own] - place) * k,
        }  # fmt: skip
        self.figure.xaxis.axis_label = label("time since half of the measured slip", second)
        self.figure.yaxis.axis_label = label("displacement", unit)
        self.words.text = _told(late, float(cycle.slip) - float(cycle.measured_slip), float(cycle.measured_slip))


def _told(late: float, longer: float, slip: float) -> str:
    if np.isnan(late):
        return "the model does not slip in time"
    when = f"{shown(abs(late), 's', 2)} {'late' if late > 0.0 else 'early'}"
    more = "longer" if longer > 0.0 else "shorter"
    return f"{when}; the slip is {shown(abs(longer), 'm', 2)} ({100.0 * abs(longer) / slip:.2g} %) {more}"
