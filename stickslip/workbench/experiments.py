"""What the model as it stands foretells: one run under another drive or rig, a sweep, and rivals in one experiment."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..data.segment import Segmentation, crept, segment
from ..data.trace import Drive, Trace
from ..errors import InputError, StickslipError
from ..objects import Campaign, Diagnosis, Fit
from ..simulation.scenario import Scenario
from ..simulation.scenario.recording import Recording
from ..simulation.scenario.schema import SweepTable
from ..simulation.scenario.series import scenarios_of
from ..simulation.scenario.simulation import Progress, record
from ..simulation.scenario.writers import write_campaign
from ..system.progress import breathe
from ..system.units import to_si
from .places import new_place

Tell = Callable[[str, float], None]
MEASURES = {"recurrence": "s", "slip": "m", "peak_velocity": "m/s", "creep_before_slip": "m"}
FEWEST, MOST = 2, 40  # runs of a sweep
RATE = 10_000.0  # Hz at which a synthetic record is written
COUNT = 7.91e-9  # m, where the campaign's runs have no count of their own
LONGEST_HOLD = 300.0  # s; a record of one takes a gigabyte of memory
EXACT = 1e-3  # scatter of an event, of its mean, below which none is believed
STICKS = (1.6, 2.6)  # mean recurrences of drive before and after a hold, so that it begins and ends between slips


@dataclass(frozen=True)
class Setting:
    """What is simulated, as it was written; "" leaves it as in the measured run.

    Attributes:
        run: the measured run that it is beside.
        velocity: of the load point, such as "100 um/s".
        hold: how long the load point halts once, such as "10 s".
        spring: stiffness of the spring, such as "500 N/m".
        mass: of the block, such as "100 g".
        events: slips after which it ends, where a velocity is given; else it is as long as the measured run.
        step: velocity that the load point goes on with from a stick on, such as "1 mm/s".
    """

    run: str
    velocity: str = ""
    hold: str = ""
    spring: str = ""
    mass: str = ""
    events: int = 5
    step: str = ""

    @property
    def as_measured(self) -> bool:
        """Whether the load point moves as in the measured run."""
        return not any(text.strip() for text in (self.velocity, self.hold, self.step))


def scenario(fit: Fit, setting: Setting) -> Scenario:
    """The model as a scenario of a setting.

    Raises:
        InputError: a quantity that cannot be read or is out of range.
    """
    made: Scenario = fit.scenario(run=setting.run, events=setting.events)
    changes: list[tuple[str, Any]] = []
    for key, text, unit, words in (
        ("block.spring_stiffness", setting.spring, "N/m", "spring"),
        ("block.mass", setting.mass, "kg", "mass"),
    ):
        if text.strip():
            changes.append((key, _positive(text, unit, words)))
    driven = next(run for run in fit.fitted.runs if run.name == setting.run)
    if not setting.as_measured:
        velocity = to_si(setting.velocity, "m/s", key="velocity") if setting.velocity.strip() else driven.velocity
        if velocity == 0.0:
            raise InputError("a load point that stands still brings no slip", key="velocity", value=setting.velocity)
        changes = [("drive", {"velocity": velocity, "events": setting.events}), *changes]
    made = made.with_changes(changes)
    hold = _positive(setting.hold, "s", "hold") if setting.hold.strip() else 0.0
    if hold > LONGEST_HOLD:
        raise InputError(
            "too long to be shown here", key="hold", value=setting.hold, allowed=f"up to {LONGEST_HOLD:g} s",
            hint="write it into a scenario for stickslip simulate",
        )  # fmt: skip
    if not hold and not setting.step.strip():
        return made
    later = to_si(setting.step, "m/s", key="velocity after the step") if setting.step.strip() else None
    return made.with_changes([("drive", {"piece": _pieces(made, hold, later)})])


def _positive(text: str, unit: str, key: str) -> float:
    found = to_si(text, unit, key=key)
    if not found > 0.0:
        raise InputError("out of range", key=key, value=text, allowed=f"more than 0 {unit}")
    return found


def _pieces(made: Scenario, hold: float, later: float | None) -> list[dict[str, float]]:
    """Drive, a hold amid a stick where one is asked for, and drive again, at another velocity where there is one."""
    file = made.file
    velocity = float(file.drive.velocity or 0.0)
    block, contact = file.block, file.contact
    strength = contact.contacts * contact.of(0, "normal_force") * contact.of(0, "friction_coefficient")
    rate = block.spring_stiffness * abs(velocity)
    period = 2.0 * (1.0 - file.weakening.ratio) * strength / rate + np.pi * np.sqrt(block.mass / block.spring_stiffness)
    first = strength / rate + STICKS[0] * period
    after = velocity if later is None else later
    longer = max(abs(velocity / after), 0.1) if after else 1.0
    return [
        {"velocity": velocity, "duration": float(first)},
        *([{"velocity": 0.0, "duration": hold}] if hold else []),
        {"velocity": after, "duration": float(STICKS[1] * period * longer)},
    ]


def run(made: Scenario, tell: Tell | None = None, text: str = "simulating") -> Recording:
    """A scenario, freely integrated; ends where it is cancelled."""

    def progress(p: Progress) -> None:
        breathe()
        if tell is not None:
            tell(f"{text}: {p.time:.3g} s, {p.events} slips", p.time / p.end if p.end > 0 else 0.0)

    return record(made, progress)


def spread(values: Any) -> tuple[float, float, int]:
    """Mean, deviation and number of what is known of the events after the first, where there are more."""
    found = np.asarray(values, float)
    found = found[1:] if found.size > 1 else found
    found = found[np.isfinite(found)]
    return (float(found.mean()), float(found.std()), int(found.size)) if found.size else (np.nan, np.nan, 0)


def measured(trace: Trace, found: Segmentation) -> dict[str, tuple[float, float, int]]:
    """Mean, deviation and number of the events of a run, for each of :data:`MEASURES`."""
    own = {key: [getattr(e, key) for e in found.events] for key in ("recurrence", "slip", "peak_velocity")}
    return {key: spread(values) for key, values in {**own, "creep_before_slip": crept(trace, found)}.items()}


def simulated(recording: Recording, trace: Trace) -> dict[str, tuple[float, float, int]]:
    """The same of a simulated run beside a measured one: with its sensor and its smallest slip.

    The recorder's own slips begin earlier, where the block outruns the load point; the creep between is no error.
    """
    own = trace.leading == "displacement"
    t, drive = recording["time"].values, recording["drive_position"].values
    seen = Trace(
        trace.name, t, displacement=recording["displacement"].values, drive=Drive.sampled(t, drive),
        resolution=trace.resolution if own else None, noise=trace.noise if own else None, virgin=trace.virgin,
        minimum_slip=trace.minimum_slip,
    )  # fmt: skip
    return measured(seen, segment(seen))


def steady_runs(campaign: Campaign) -> dict[str, tuple[float, dict[str, tuple[float, float, int]]]]:
    """Run -> its velocity (m/s) and :func:`measured`, for runs with slips and without a hold."""
    out = {}
    for trace, found in zip(campaign.traces, campaign.events, strict=True):
        if trace.drive is None or found.settings.unit != "m" or len(found.events) < 2:
            continue
        speeds = np.diff(trace.drive.positions) / np.diff(trace.drive.times)
        if np.ptp(speeds) <= 0.2 * np.abs(speeds).max():
            out[trace.name] = (trace.drive.speed, measured(trace, found))
    return out


@dataclass(frozen=True)
class Swept:
    """Events of a model over the velocity of the drive.

    Attributes:
        fit: the model.
        velocities: m/s, as far as they are simulated.
        events: of each of them, as of :func:`simulated`.
    """

    fit: Fit
    velocities: tuple[float, ...] = ()
    events: tuple[dict[str, tuple[float, float, int]], ...] = ()

    def mean(self, key: str) -> np.ndarray:
        """Means of one of :data:`MEASURES`, shape (n,); nan where there is no event."""
        return np.array([values[key][0] for values in self.events])


def sweep(
    fit: Fit, setting: Setting, low: str, high: str, points: int, tell: Tell, show: Callable[[Swept], None]
) -> Swept:  # fmt: skip
    """Events of the model over the velocity of the drive; shown as far as they are there.

    Args:
        fit: the model.
        setting: its spring, mass and number of events, and the run whose sensor sees them.
        low, high: ends of the velocities, with units.
        points: how many.
        tell, show: told the progress, and what there is so far.

    Raises:
        InputError: a velocity that cannot be read, or too many of them.
    """
    ends = [to_si(text, "m/s", key="velocities") for text in (low, high)]
    if not 0.0 < ends[0] < ends[1]:
        raise InputError("the velocities must increase", key="velocities", value=f"{low} to {high}")
    if not FEWEST <= points <= MOST:
        raise InputError("out of range", key="number of velocities", value=points, allowed=f"{FEWEST} to {MOST}")
    base = scenario(fit, replace(setting, velocity=low, hold="", step=""))
    series = SweepTable(key="drive.velocity", start=ends[0], stop=ends[1], points=points)
    done = Swept(fit)
    for i, (value, member) in enumerate(scenarios_of(base, series)):
        words = f"{i + 1} of {points}: {1e6 * value:.4g} µm/s"

        def within(text: str, share: float, i: int = i) -> None:
            tell(text, (i + share) / points)

        events = simulated(run(member, within, words), fit.campaign[setting.run])
        done = Swept(fit, (*done.velocities, value), (*done.events, events))
        show(done)
    return done


def write(fit: Fit, setting: Setting, campaign: Campaign, name: str, tell: Tell) -> Path:
    """A setting as a vibrometer would record it: a folder in that of the campaign with a record and a campaign file.

    Raises:
        InputError: the name cannot be used or is there already; as of :func:`scenario`.
    """
    if not campaign.description.filed:
        raise InputError("this campaign has no folder", hint="only a campaign of a file has one")
    folder = new_place(campaign.description.folder, name, "name of the folder")
    counts = [t.resolution for t in campaign.traces if t.leading == "displacement" and t.resolution]
    sensor = {"resolution": float(counts[0]) if counts else COUNT}
    made = scenario(fit, setting).with_changes(
        [("sensor", sensor), ("output", {"trace": "record.csv", "sampling_rate": RATE})]
    )
    recording = run(made, tell, "simulating the record")
    aside = folder.with_name(f".{folder.name}.writing")
    shutil.rmtree(aside, ignore_errors=True)
    aside.mkdir()
    try:
        write_campaign(aside, [made], [recording])
        aside.rename(folder)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return folder


def undecided(diagnosis: Diagnosis | None) -> list[tuple[tuple[str, ...], str]]:
    """Sets of effects that the data cannot tell apart, each with the experiment that would."""
    proposed = None if diagnosis is None else diagnosis.next_experiment
    if not proposed:
        return []
    every = [proposed, *proposed.get("others", ())]
    return [(tuple(e["separates"]), str(e["text"])) for e in every if len(e.get("separates", ())) > 1]


def usual(setting: Setting, velocity: float, spring: float, mass: float) -> dict[str, Setting]:
    """Experiments that are easily made on a rig, by what is done; the drive, the spring and the block as they are.

    Args:
        setting: what else is asked for.
        velocity, spring, mass: as they are (m/s, N/m, kg).
    """
    plain = replace(setting, velocity=f"{velocity:.6g} m/s", hold="", step="")

    def at(factor: float) -> str:
        return f"{factor * velocity:.6g} m/s"

    return {
        "a hold of 1 s": replace(plain, hold="1 s"),
        "a hold of 10 s": replace(plain, hold="10 s"),
        "a hold of 100 s": replace(plain, hold="100 s"),
        "a quarter of the velocity": replace(plain, velocity=at(0.25)),
        "four times the velocity": replace(plain, velocity=at(4.0)),
        "a step to ten times the velocity": replace(plain, step=at(10.0)),
        "a block twice as heavy": replace(plain, mass=f"{2.0 * mass:.6g} kg"),
        "a spring half as stiff": replace(plain, spring=f"{0.5 * spring:.6g} N/m"),
    }


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
        form = ",".join(f"{k}={v}" for k, v in forms.get(tag, {}).items())
        out[tag] = fit if inside == [tag] else base.add(f"{tag}:{form}" if form else tag)
    return out


def compare(fits: Mapping[str, Fit], setting: Setting, tell: Tell) -> dict[str, Recording]:
    """One experiment simulated for each of some models."""
    out = {}
    for i, (tag, fit) in enumerate(fits.items()):

        def within(text: str, share: float, i: int = i) -> None:
            tell(text, 0.5 + 0.5 * (i + share) / len(fits))

        out[tag] = run(scenario(fit, setting), within, f"with {tag}")
    return out


def farthest(
    found: Mapping[str, Recording], scatters: Mapping[str, float] | None = None
) -> tuple[str, int, float] | None:
    """Measure and slip (from 0) in which some models differ most, and by how much of the mean; None where in none.

    Most is counted in scatters, where they are given (see :func:`scatter`), else in shares of the mean.
    """
    best: tuple[str, int, float] | None = None
    top = 0.0
    for key in MEASURES:
        lists = [np.asarray(r[key].values, float) for r in found.values()]
        for number in range(min((v.size for v in lists), default=0)):
            values = np.array([v[number] for v in lists])
            if not np.isfinite(values).all() or np.abs(values).max() == 0.0:
                continue
            apart = float(np.ptp(values) / np.abs(values).mean())
            weight = apart if scatters is None else apart / scatters[key]
            if weight > top:
                best, top = (key, number, apart), weight
    return best


def difference(found: Mapping[str, Recording]) -> str:
    """By which measure the models differ most, in words."""
    best = farthest(found)
    words = "They do not differ in any event of this experiment."
    if best is not None:
        key, number, apart = best
        words = (
            f"They differ most in the {key.replace('_', ' ')} of slip {number + 1}: by {100 * apart:.2g} % of its mean."
        )
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


@dataclass(frozen=True)
class Telling:
    """An experiment simulated for each of some models.

    Attributes:
        words: what is done.
        setting: the same.
        recordings: of every model; empty where it cannot be simulated.
        measure, slip, share: where the models differ most, and by how much of the mean.
        scatters: the same in scatters of one such event.
        note: why there is nothing.
    """

    words: str
    setting: Setting
    recordings: Mapping[str, Recording]
    measure: str = ""
    slip: int = 0
    share: float = 0.0
    scatters: float = 0.0
    note: str = ""


def tell_apart(
    fits: Mapping[str, Fit], options: Mapping[str, Setting], scatters: Mapping[str, float], tell: Tell,
    show: Callable[[Sequence[Telling]], None] = lambda found: None,
) -> list[Telling]:  # fmt: skip
    """Every experiment simulated for every model; the one first in which they differ most beyond the scatter.

    Args:
        fits: the models.
        options: the experiments.
        scatters: as of :func:`scatter`.
        tell, show: told the progress, and what there is so far.
    """
    out: list[Telling] = []
    for i, (words, setting) in enumerate(options.items()):

        def within(text: str, share: float, i: int = i, words: str = words) -> None:
            tell(f"{words}, {text}", 0.5 + 0.5 * (i + 2.0 * (share - 0.5)) / len(options))

        try:
            found = compare(fits, setting, within)
        except StickslipError as error:
            out.append(Telling(words, setting, {}, note=str(error).split("\n")[0]))
            continue
        best = farthest(found, scatters)
        if best is None:
            out.append(Telling(words, setting, found, note="no event differs"))
        else:
            key, slip, share = best
            out.append(Telling(words, setting, found, key, slip + 1, share, share / scatters[key]))
        out.sort(key=lambda t: -t.scatters)
        show(list(out))
    return out
