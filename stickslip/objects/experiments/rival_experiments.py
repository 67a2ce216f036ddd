"""Rival effects, each in the model in place of the others, and experiments simulated for each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import detrend

from ...data.segment import segment
from ...errors import InputError, StickslipError
from ...inference.diagnose.expected_information import information, margins
from ...inference.diagnose.prepare import Prepared
from ...inference.force.knots import Knots, knots
from ...inference.force.point import Point
from ...inference.force.scales import of_run
from ...simulation.conformance import blamed
from ...simulation.conformance.compile_check import first_line
from ...simulation.scenario.recording import Recording
from ...system.progress import Cancelled, part
from ..fit import Fit
from ..result_base import Tell
from .events import MEASURES, run, sensed
from .setting import Setting, changed, scenario, settled

READ, CREEP, SWING = "slip as read", "creep in the hold", "swing in the hold"
SEEN = 1e-9  # m, swing that a sensor may show


@dataclass(frozen=True)
class SimulatedExperiment:
    """An experiment simulated for each of some models.

    Attributes:
        words: what is done.
        setting: the same.
        model: in which the rivals stand in place of one another.
        fits: the models by their effects.
        recordings: of every model; empty where it cannot be simulated.
        information: that is expected of it about which model is true (nat).
        margin: logarithm of the likelihood ratio that is expected of the true model over another one, the least of all.
        measure, slip, share: where the models differ most, and by how much of the mean; slip 0 is the hold.
        note: why there is nothing.
        code: the lines of Python that lead to ``model``.
    """

    words: str
    setting: Setting
    model: Fit
    fits: Mapping[str, Fit]
    recordings: Mapping[str, Recording]
    information: float = 0.0
    margin: float = 0.0
    measure: str = ""
    slip: int = 0
    share: float = 0.0
    note: str = ""
    code: str = ""

    @property
    def odds(self) -> str:
        """How likely the true model is expected to become beside any other one, in words."""
        if self.margin < np.log(2.0):
            return "about as likely"
        power = self.margin / np.log(10.0)
        return f"{10.0**power:.2g} times as likely" if power < 3.0 else f"10^{power:.0f} times as likely"


def rivals(
    fit: Fit, tags: Sequence[str], forms: Mapping[str, Mapping[str, Any]], tell: Tell
) -> dict[str, Fit]:  # fmt: skip
    """The model with each of some effects in place of the others, fitted.

    Args:
        fit: the model, with one of them or none.
        tags: of the effects.
        forms: tag -> form of its law, where it is not the usual one.
        tell: told the progress.
    """
    inside = [tag for tag in tags if tag in fit.effects]
    base = fit
    for tag in inside:
        base = base.remove(tag)
    out = {}
    for i, tag in enumerate(tags):
        tell(f"fitting with {tag}", i / len(tags))
        form = ",".join(f"{k}={v}" for k, v in forms.get(tag, {}).items())
        out[tag] = fit if inside == [tag] else base.add(f"{tag}:{form}" if form else tag)
    return out


def simulate_rivals(
    model: Fit, fits: Mapping[str, Fit], options: Mapping[str, Setting], tell: Tell,
    show: Callable[[Sequence[SimulatedExperiment]], None] = lambda found: None, code: str = "",
    until: Callable[[], bool] = lambda: True, drawn: Mapping[str, Sequence[Point]] | None = None,
) -> list[SimulatedExperiment]:  # fmt: skip
    """Every experiment simulated for every model; the one first of which most information is expected.

    Args:
        model: in which the rivals stand in place of one another.
        fits: with each of them.
        options: the experiments.
        tell, show: told the progress, and what there is so far.
        code: the lines of Python that lead to the model.
        until: whether there is time for more; what is not simulated then is missing.
        drawn: draws of the posterior of every model; default the Gaussian of its fit.
    """
    out: list[SimulatedExperiment] = []
    for i, (words, setting) in enumerate(options.items()):
        if not until():
            break
        try:
            out.append(_told(words, setting, model, fits, part(tell, i, len(options), f"{words}, "), code, drawn))
        except Cancelled:
            raise
        except Exception as error:  # an effect of one's own may fail in any way
            said = error if isinstance(error, StickslipError) else blamed(error)
            note = str(said or first_line(error)).split("\n")[0]
            out.append(SimulatedExperiment(words, setting, model, fits, {}, note=note, code=code))
        out.sort(key=lambda t: (bool(t.note), -round(t.information, 3), -t.margin))
        show(list(out))
    return out


def _told(
    words: str, setting: Setting, model: Fit, fits: Mapping[str, Fit], tell: Tell, code: str,
    drawn: Mapping[str, Sequence[Point]] | None = None,
) -> SimulatedExperiment:  # fmt: skip
    setting = settled(model, setting)
    found, seen = {}, []
    for i, (tag, fit) in enumerate(fits.items()):
        made = scenario(fit, setting)
        found[tag] = run(made, part(tell, i, len(fits)), f"with {tag}")
        spring = made.file.block.spring_stiffness if setting.spring.strip() else None
        seen.append(seen_as(found[tag], fit.climbed.prepared, setting.run, spring))
    draws = None if drawn is None else [drawn[tag] for tag in fits]
    apart = margins([fit.force_fit for fit in fits.values()], seen, changed(model, setting), draws)
    least = float(apart[~np.eye(len(apart), dtype=bool)].min())
    measure, slip, share = farthest(found) or ("", -1, 0.0)
    return SimulatedExperiment(
        words, setting, model, fits, found, information(apart), least, measure, slip + 1, share, code=code
    )  # fmt: skip


def seen_as(recording: Recording, prepared: Prepared, run: str, spring: float | None = None) -> Knots:
    """A recording as the sensor of a measured run would have it, at its knots.

    Args:
        recording: simulated, from a virgin contact.
        prepared: of the campaign.
        run: the measured run.
        spring: that drives the block (N/m), where it is another one.

    Raises:
        InputError: no slip in it that the sensor would see.
    """
    like = next(t for t in prepared.traces if t.name == run)
    t = recording["time"].values
    rate = min(like.sampling_rate, (t.size - 1) / (t[-1] - t[0]))
    at = np.arange(t[0], t[-1], 1.0 / rate)
    read, drive = (np.interp(at, t, recording[name].values) for name in ("reading", "drive_position"))
    trace = sensed(like, at, read, drive, virgin=True, spring_stiffness=spring or like.spring_stiffness)
    found = segment(trace)
    if not found.events:
        raise InputError("no slip")
    return knots(trace, found, of_run(prepared.scales, trace, found))


def signs(recording: Recording) -> dict[str, np.ndarray]:
    """What is compared of a recording: measures of every slip, also as the sensor reads it, and of a hold."""
    out = {key: np.asarray(recording[key].values, float) for key in MEASURES}
    t, drive, read = (recording[name].values for name in ("time", "drive_position", "reading"))
    ends = [np.clip(np.searchsorted(t, recording[key].values), 0, t.size - 1) for key in ("onset", "arrest")]
    out[READ] = read[ends[1]] - read[ends[0]]
    still = np.flatnonzero(np.diff(drive) == 0.0)
    if still.size > 2:
        first, last = int(still[0]), int(still[-1]) + 1
        out[CREEP] = np.array([read[last] - read[first]])
        swing = np.ptp(detrend(read[(first + last) // 2 : last]))
        out[SWING] = np.array([swing if swing > SEEN else 0.0])
    return out


def farthest(found: Mapping[str, Recording]) -> tuple[str, int, float] | None:
    """Measure and slip (from 0) in which some models differ most, and by how much of the mean; None where in none."""
    best: tuple[str, int, float] | None = None
    every = [signs(r) for r in found.values()]
    for key in every[0] if every else ():
        lists = [own.get(key, np.array([])) for own in every]
        for number in range(min(v.size for v in lists)):
            values = np.array([v[number] for v in lists])
            if not np.isfinite(values).all() or np.abs(values).max() == 0.0:
                continue
            apart = float(np.ptp(values) / np.abs(values).mean())
            if apart > (0.0 if best is None else best[2]):
                best = (key, number, apart)
    return best


def where(measure: str, slip: int) -> str:
    """Where models differ, in words; slips are counted from 1."""
    words = measure.replace("_", " ")
    return words if measure in (CREEP, SWING) else f"{words} of slip {slip}"
