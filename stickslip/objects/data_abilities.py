"""Which features a campaign's data can give, and which not, in words and before anything is fitted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..data.prescribed import prescribed
from ..data.resolution import noise_level
from ..data.segment import LAWS, Segmentation, Shapes, crept, event_shapes
from ..data.trace import Trace
from ..inference.fit.creep_process import V_LIM, creep_processes
from ..inference.fit.normalised import is_ramp
from ..system.units import shown

_RING_RATE = 5000.0  # Hz: a contact resonance of some 500 Hz needs ten samples a period
COARSE = 1 / 50  # of the creep before a slip that a count is: 1/30 makes a drop that is 8 deviations off
DITHERED = 0.5  # of a count, which the noise of a sample is: rounding then is noise as well
_NEAR = 1.25  # drive velocities closer than this factor count as one


@dataclass(frozen=True)
class Abilities:
    """Sentences."""

    can: tuple[str, ...]
    cannot: tuple[str, ...]


def abilities(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> Abilities:
    """What the traces of a campaign can and cannot tell."""
    pairs = list(zip(traces, segmentations, strict=True))
    can: list[str] = []
    cannot: list[str] = []
    slipping = [(t, s) for t, s in pairs if s.events]
    given = [t.name for t, s in pairs if prescribed(t, s)]
    if given:
        can.append(
            f"A force beside a prescribed motion in {_some(given)}: the law of friction is driven by that motion, and "
            "elasticity of the instrument counts as the contact's."
        )
    elif not slipping:
        cannot.append(
            "No trace holds a slip: only creep or sliding can be examined; the dynamic model cannot be fitted."
        )
    shapes = [event_shapes(t, s) for t, s in slipping]
    verdicts = [judge(pairs, slipping) for judge in (_velocities, _events, _holds, _virgin, _signals, _slow_noise)]
    verdicts += [judge(slipping, shapes) for judge in (_slip, _overshoot, _ringing)]
    verdicts.append(_counts(slipping))
    verdicts += [judge(pairs, slipping) for judge in (_creep, _ramps, _unseen)]
    for good, bad in verdicts:
        can += good
        cannot += bad
    return Abilities(tuple(can), tuple(cannot))


Pairs = list[tuple[Trace, Segmentation]]
Verdict = tuple[list[str], list[str]]


def _velocities(pairs: Pairs, slipping: Pairs) -> Verdict:
    speeds = sorted({v for t, _ in pairs if t.drive is not None for v in t.drive.speeds(_NEAR)})
    groups: list[float] = []
    for v in speeds:
        if not groups or v > _NEAR * groups[-1]:
            groups.append(v)
    shown = ", ".join(f"{v * 1e6:.3g}" for v in groups)
    if not groups:
        if any(not is_ramp(t) for t, _ in pairs):
            return [], ["The drive is not known: neither its velocity nor its phase can be used."]
        return [], []
    if len(groups) == 1:
        return [], [
            f"One drive velocity only ({shown} µm/s): creep at one velocity identifies nothing, since roughness, "
            "friction and weakening together imitate almost every effect. Record three velocities over a factor of "
            "four."
        ]
    if len(groups) == 2 or groups[-1] < 4 * groups[0]:
        return [f"{len(groups)} drive velocities ({shown} µm/s): effects that depend on velocity can be seen."], [
            "Fewer than three velocities over a factor of four: many effects cannot be distinguished."
        ]
    return [f"{len(groups)} drive velocities ({shown} µm/s) separate what depends on velocity from what does not."], []


def _events(pairs: Pairs, slipping: Pairs) -> Verdict:
    few = [t.name for t, s in slipping if len(s.events) < 3]
    n = sum(len(s.events) for _, s in slipping)
    good = [f"{_count(n, 'slip')} in {len(slipping)} of {_count(len(pairs), 'trace')}."] if n else []
    bad = []
    if few:
        bad.append(
            f"Fewer than three slips in {_some(few)}: no recurrence time and no scatter from slip to slip there."
        )
    odd = [f"{t.name} ({s.regime})" for t, s in pairs if not s.events or s.regime != "stick-slip"]
    if odd and slipping:
        bad.append(f"No regular stick-slip in {_some(odd)}.")
    return good, bad


def _slow_noise(pairs: Pairs, slipping: Pairs) -> Verdict:
    """A reading that wanders looks like creep; only a record of the block at rest distinguishes the two."""
    measured = [t for t, _ in slipping if t.displacement is not None]
    stated = [t for t in measured if t.walk or t.hum]
    silent = [t.name for t in measured if not (t.walk or t.hum)]
    kinds = sorted({(t.walk, t.hum) for t in stated})
    good = [
        f"Slow noise of the sensor is known in {_some([t.name for t in stated if (t.walk, t.hum) == (walk, hum)])}: "
        f"{walk * 1e9:.3g} nm/s^0.5 at random, {hum * 1e9:.3g} nm of hum."
        for walk, hum in kinds
    ]
    bad = [
        f"Slow noise of the sensor is not stated in {_some(silent)}: drift or hum of some nanometres would be "
        "interpreted as creep. Record the block at rest, and give walk and hum beside the displacement's column."
    ]
    return good, bad if silent else []


def _holds(pairs: Pairs, slipping: Pairs) -> Verdict:
    held = [sum(e.hold_time > 0 for e in s.events) for _, s in slipping]
    if not slipping:
        return [], []
    if sum(held):
        return [f"{_count(sum(held), 'slip')} after a hold: strengthening with time and creep at rest can be seen."], []
    return [], ["No hold: strengthening with time, creep at rest and drift of the sensor cannot be separated."]


def _virgin(pairs: Pairs, slipping: Pairs) -> Verdict:
    if not pairs or any(t.virgin for t, _ in pairs):
        return ["A virgin start: the first loading of a fresh contact is recorded."] if pairs else [], []
    return [], [
        "No virgin start is stated (virgin = true): the first stick of every trace is left out, and the contact's "
        "memory of the last slip is in every creep."
    ]


def _signals(pairs: Pairs, slipping: Pairs) -> Verdict:
    force = [t.name for t, s in pairs if t.leading == "spring_force" and not prescribed(t, s)]
    if not force:
        return [], []
    bad = [
        f"Spring force only in {_some(force)}: the block's position is drive - F/c_s, so every error of the force's "
        "scale, of the stiffness or of the drive appears as motion. A fit finds the scale with the rest, and a ripple "
        "of the drive as an effect."
    ]
    good: list[str] = []
    for t, s in pairs:
        if t.name in force and t.spring_stiffness is None and s.settings.unit == "m" and s.settings.gain:
            bad.append(
                f"{t.name}: the spring's stiffness is not given. It is estimated from the loading rate early in a "
                f"stick, where the block hardly moves: c_s = {shown(s.settings.gain, 'N/m', 3)}."
            )
        if s.settings.unit != "m":
            bad.append(f"{t.name}: neither stiffness nor drive is known, so lengths are given as loading time (s).")
    return good, bad


def _slip(slipping: Pairs, shapes: list[Shapes]) -> Verdict:
    coarse = [
        f"{t.name} ({float(np.median([e.duration for e in s.events])) * t.sampling_rate:.0f} samples a slip)"
        for (t, s), shape in zip(slipping, shapes, strict=True)
        if "slip_times" in shape.missing
    ]
    if coarse:
        return [], [f"Sampled too slowly for the shape of a slip: {_some(coarse)}."]
    return (["The course of the slips is resolved."] if slipping else []), []


def _overshoot(slipping: Pairs, shapes: list[Shapes]) -> Verdict:
    """Overshoot, where it is missing or below what the sensor makes."""
    missing, hidden = [], []
    for (t, _), shape in zip(slipping, shapes, strict=True):
        if "overshoot" in shape.missing:
            missing.append(f"{t.name} ({shape.missing['overshoot']})")
            continue
        known = np.array([e.overshoot for e in shape.events])
        if abs(float(np.nanmedian(known))) < 2.0 * shape.noise["overshoot"]:
            hidden.append(t.name)
    bad = [f"No overshoot: {_some(missing)}."] if missing else []
    if hidden:
        bad.append(f"The overshoot is within the noise in {_some(hidden)}.")
    return [], bad


def _ringing(slipping: Pairs, shapes: list[Shapes]) -> Verdict:
    slow = [f"{t.name} ({_rate(t.sampling_rate)})" for t, _ in slipping if t.sampling_rate < _RING_RATE]
    found = [(t, shape) for (t, _), shape in zip(slipping, shapes, strict=True) if np.isfinite(shape.frequency)]
    good, bad = [], []
    if slow:
        text = (
            f"Sampled too slowly for a ring-down of some 500 Hz: {_some(slow)}; contact stiffness and damping are then"
        )
        bad.append(f"{text} known from creep and slip alone.")
    if found:
        each = _some([f"{t.name} at {_rate(shape.frequency)}" for t, shape in found])
        good.append(f"Ring-down after the slips (contact stiffness and damping): {each}.")
        clear = [shape.decay for _, shape in found if shape.decay in LAWS]
        if len(set(clear)) == 1 and len(clear) >= 0.5 * len(found):
            good.append(f"The ring-down's {LAWS[clear[0]]}.")
        else:
            bad.append("The law by which the ring-down decays is not clear, so kinds of damping cannot be separated.")
    quiet = [
        f"{t.name} ({shape.missing['ring']})"
        for (t, _), shape in zip(slipping, shapes, strict=True)
        if "ring" in shape.missing and t.sampling_rate >= _RING_RATE
    ]
    if quiet:
        bad.append(f"No ring-down: {_some(quiet)}.")
    return good, bad


def _counts(slipping: Pairs) -> Verdict:
    """Counts that a creep passes few of: where the block is between two of them no noise tells."""
    coarse = []
    for trace, segmentation in slipping:
        count, creep = trace.resolution, _usual(crept(trace, segmentation))
        if trace.displacement is None or not count or not creep < count / COARSE:
            continue
        if noise_level(trace.displacement, count) < DITHERED * count:
            coarse.append(f"{trace.name} ({shown(count, 'm', 3)}, with {shown(creep, 'm', 3)} of creep)")
    if not coarse:
        return [], []
    return [], [
        f"Counts are coarse beside the creep before a slip in {_some(coarse)}: drop, healing time and damping are then "
        "off by more than their deviations. A finer sensor, or noise of half a count on it, corrects that."
    ]


def _usual(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.nan


def _creep(pairs: Pairs, slipping: Pairs) -> Verdict:
    kept, lost = 0, []
    for t, s in slipping:
        if is_ramp(t) or t.drive is None:
            continue
        found, dropped = creep_processes(t, s)
        kept += len(found)
        lost += dropped
    good = (
        [f"{_count(kept, 'creep process')} can be compared with the static model (v_lim = {V_LIM * 1e6:g} µm/s)."]
        if kept
        else []
    )
    bad = []
    if lost:
        reasons: dict[str, int] = {}
        for d in lost:
            short = re.sub(r" \([^)]*\)", "", d.reason).split(":")[0]  # numbers differ from one to the next
            reasons[short] = reasons.get(short, 0) + d.count
        text = "; ".join(f"{n} because {reason}" for reason, n in sorted(reasons.items(), key=lambda r: -r[1]))
        bad.append(
            f"{_count(sum(d.count for d in lost), 'creep process')} cannot be compared with the static model: {text}."
        )
    return good, bad


def _ramps(pairs: Pairs, slipping: Pairs) -> Verdict:
    ramps = [t.name for t, s in pairs if is_ramp(t) and s.events]
    if not ramps:
        return [], []
    return (
        [f"{_count(len(ramps), 'break-away ramp')}: the normalised static curve (H and u_max) can be fitted."],
        ["Ramps without a geometry: h_rms, line length and load cannot be determined from them."],
    )


def _unseen(pairs: Pairs, slipping: Pairs) -> Verdict:
    if len(slipping) < 2 and slipping:
        return [], ["One trace with slips: no run can be held out, so nothing can be checked on unseen conditions."]
    return [], []


def _count(n: int, thing: str) -> str:
    """``2 slips``, ``1 creep process``."""
    return f"{n} {thing}" if n == 1 else f"{n} {thing}{'es' if thing.endswith('s') else 's'}"


def _rate(rate: float) -> str:
    return f"{rate / 1e3:.3g} kHz" if rate >= 1e3 else f"{rate:.3g} Hz"


def _some(names: Sequence[str], most: int = 4) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
