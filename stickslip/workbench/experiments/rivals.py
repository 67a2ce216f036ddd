"""Rival effects, each in the model in place of the others, and experiments simulated for each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import StickslipError
from ...objects import Campaign, Fit
from ...simulation.scenario.recording import Recording
from .events import MEASURES, Tell, run, steady_runs
from .setting import Setting, scenario, settled
from .synthetic import COUNT

EXACT = 1e-3  # scatter of an event, of its mean, below which none is believed
READ = "slip as read"
CREEP, SWING = "creep in the hold", "swing in the hold"


@dataclass(frozen=True)
class Telling:
    """An experiment simulated for each of some models.

    Attributes:
        words: what is done.
        setting: the same.
        model: in which the rivals stand in place of one another.
        fits: the models by their effects.
        recordings: of every model; empty where it cannot be simulated.
        measure, slip, share: where the models differ most, and by how much of the mean; slip 0 is the hold.
        scatters: the same in scatters of one such event.
        note: why there is nothing.
        code: the lines of Python that lead to ``model``.
    """

    words: str
    setting: Setting
    model: Fit
    fits: Mapping[str, Fit]
    recordings: Mapping[str, Recording]
    measure: str = ""
    slip: int = 0
    share: float = 0.0
    scatters: float = 0.0
    note: str = ""
    code: str = ""


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
        tell(f"fitting with {tag}", 0.5 * i / len(tags))
        out[tag] = fit if inside == [tag] else base.add(formed(tag, forms))
    return out


def formed(tag: str, forms: Mapping[str, Mapping[str, Any]]) -> str:
    """An effect as :meth:`stickslip.Fit.add` takes it, with its form where that is not the usual one."""
    form = ",".join(f"{k}={v}" for k, v in forms.get(tag, {}).items())
    return f"{tag}:{form}" if form else tag


def compare(fits: Mapping[str, Fit], setting: Setting, tell: Tell) -> dict[str, Recording]:
    """One experiment simulated for each of some models."""
    out = {}
    for i, (tag, fit) in enumerate(fits.items()):

        def within(text: str, share: float, i: int = i) -> None:
            tell(text, 0.5 + 0.5 * (i + share) / len(fits))

        out[tag] = run(scenario(fit, setting), within, f"with {tag}")
    return out


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
        out[SWING] = np.array([np.ptp(read[(first + last) // 2 : last])])
    return out


def farthest(
    found: Mapping[str, Recording], scatters: Mapping[str, float] | None = None
) -> tuple[str, int, float] | None:
    """Measure and slip (from 0) in which some models differ most, and by how much of the mean; None where in none.

    Most is counted in scatters, where they are given (see :func:`scatter`), else in shares of the mean.
    """
    best: tuple[str, int, float] | None = None
    top = 0.0
    every = [signs(r) for r in found.values()]
    for key in every[0] if every else ():
        lists = [own.get(key, np.array([])) for own in every]
        for number in range(min(v.size for v in lists)):
            values = np.array([v[number] for v in lists])
            if not np.isfinite(values).all() or np.abs(values).max() == 0.0:
                continue
            apart = float(np.ptp(values) / np.abs(values).mean())
            weight = apart if scatters is None else apart / _scatter(key, values, scatters)
            if weight > top:
                best, top = (key, number, apart), weight
    return best


def _scatter(key: str, values: np.ndarray, scatters: Mapping[str, float]) -> float:
    """Of a measure, over its mean; of what a sensor reads at least a count."""
    count = COUNT / float(np.abs(values).mean()) if key in (READ, CREEP, SWING) else 0.0
    return float(np.hypot(scatters.get("slip" if key == READ else key, EXACT), count))


def where(measure: str, slip: int) -> str:
    """Where models differ, in words; slips are counted from 1."""
    words = measure.replace("_", " ")
    return words if measure in (CREEP, SWING) else f"{words} of slip {slip}"


def difference(found: Mapping[str, Recording], best: tuple[str, int, float] | None) -> str:
    """By which measure the models differ most, in words.

    Args:
        found: a recording of each.
        best: as of :func:`farthest`.
    """
    words = "They do not differ in any event of this experiment."
    if best is not None:
        key, number, apart = best
        words = f"They differ most in the {where(key, number + 1)}: by {100 * apart:.2g} % of its mean."
    if len({r.sizes["event"] for r in found.values()}) > 1:
        counts = ", ".join(f"{tag} {r.sizes['event']}" for tag, r in found.items())
        words += f" The number of slips differs: {counts}."
    return words


def scatter(campaign: Campaign) -> dict[str, float]:
    """Measure -> standard deviation of one event over its mean, the median over the steady runs; at least 0.1 %."""
    every = [values for _, values in steady_runs(campaign).values()]
    out = {}
    for key in MEASURES:
        shares = [values[key][1] / abs(values[key][0]) for values in every if values[key][2] > 1 and values[key][0]]
        out[key] = max(float(np.median(shares)), EXACT) if shares else EXACT
    return out


def tell_apart(
    model: Fit, fits: Mapping[str, Fit], options: Mapping[str, Setting], scatters: Mapping[str, float], tell: Tell,
    show: Callable[[Sequence[Telling]], None] = lambda found: None, code: str = "",
) -> list[Telling]:  # fmt: skip
    """Every experiment simulated for every model; the one first in which they differ most beyond the scatter.

    Args:
        model: in which the rivals stand in place of one another.
        fits: with each of them.
        options: the experiments.
        scatters: as of :func:`scatter`.
        tell, show: told the progress, and what there is so far.
        code: the lines of Python that lead to the model.
    """
    out: list[Telling] = []
    for i, (words, setting) in enumerate(options.items()):

        def within(text: str, share: float, i: int = i, words: str = words) -> None:
            tell(f"{words}, {text}", 0.5 + 0.5 * (i + 2.0 * (share - 0.5)) / len(options))

        try:
            setting = settled(model, setting)
            found = compare(fits, setting, within)
        except StickslipError as error:
            out.append(Telling(words, setting, model, fits, {}, note=str(error).split("\n")[0], code=code))
            continue
        best = farthest(found, scatters)
        if best is None:
            out.append(Telling(words, setting, model, fits, found, note="no event differs", code=code))
        else:
            key, slip, share = best
            values = np.array([signs(r)[key][slip] for r in found.values()])
            far = share / _scatter(key, values, scatters)
            out.append(Telling(words, setting, model, fits, found, key, slip + 1, share, far, code=code))
        out.sort(key=lambda t: -t.scatters)
        show(list(out))
    return out
