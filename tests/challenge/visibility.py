"""How large an effect must be to be seen through noise, the scatter of the contact, and unknown parameters of the rig.

Taken from the generator's own campaigns: how far an effect moves the features, in floors, when rig and lines are moved
so as to hide it, and other lines at an event may hide it as well. Spring and mass count as known. Neither the package's
model nor its fit takes part. `python -m tests.challenge.visibility` prints the table of `stickslip.blind.detection`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.blind.generator import EFFECTS, Setup, draw_setup, make_campaign
from stickslip.blind.generator.sensor import SILENT
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.errors import StickslipError
from stickslip.inference.features.curve import SampledCurve
from stickslip.inference.features.evaluate import features
from stickslip.inference.features.measurement import Measurement, measure
from stickslip.inference.fit.stated_rig import ring_period
from tests.fit.feature_floors import floors_alone

SEEN = 5.0  # standard deviations from which an effect counts as seen
SCATTER = 1.5  # between the same lines at every event and new ones
# shares by which the parameters of the rig and the lines are moved, to see what they could do
RIG = {"mu_s": 3e-3, "mu_k": 3e-3, "slip_length": 1e-2, "heal_time": 1e-2, "damping": 2e-2}
SURFACE = {"h_rms": 1e-2, "hurst": 1e-2}
EVENTS = {"h_rms": 0.12, "hurst": 0.10}  # standard deviations of what may differ from event to event, as shares
CYCLES = 8
FINE = 1e-11  # m
REFITS = 3
STRAIGHT = (3.0, 60.0)  # standard deviations between which a change is taken as proportional


def visible(forms: Iterable[tuple[str, str]], seeds: Iterable[int] = (1, 2)) -> dict[tuple[str, str], float]:
    """The amplitudes of effects from which they move the features by five standard deviations.

    Args:
        forms: tags of effects of the generator, each with one of its forms.
        seeds: of the rigs and of the effects' inner parameters; the geometric mean over them is given.

    Returns:
        Amplitudes in the effects' units; effects that moved nothing anywhere are left out.
    """
    forms = tuple(forms)
    found: dict[tuple[str, str], list[float]] = {}
    for seed in seeds:
        rig = Reference(seed)
        for tag, form in forms:
            limit = rig.limit(tag, form)
            if limit is not None:
                found.setdefault((tag, form), []).append(limit)
    return {key: float(np.exp(np.mean(np.log(limits)))) for key, limits in found.items()}


class Reference:
    """One rig, its features, and what its parameters can do to them; every campaign has the same lines and noise."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        real, _ = self._measured(draw_setup(np.random.default_rng(seed)), [])
        self.floor = floors_alone(real, factor=SCATTER)
        self.base, _ = self._measured(self._setup(), [])
        columns = {name: self._column(name) for name in (*RIG, *SURFACE)}
        self.white = self._whitening([columns[name] * share for name, share in EVENTS.items()])
        self.free = self.white @ np.stack(list(columns.values()), axis=1)

    def limit(self, tag: str, form: str) -> float | None:
        """Amplitude at which ``tag`` moves the features by SEEN standard deviations; None where it does not."""
        effect = EFFECTS[tag]
        size, best = float(np.sqrt(effect.low * effect.high)), None
        for _ in range(4):
            moved = self.moved(tag, form, size)
            if moved is None:  # no stick-slip is left, or other events
                size /= 3.0
                continue
            if moved <= 0:
                return best
            best = size * SEEN / moved
            if STRAIGHT[0] < moved < STRAIGHT[1]:
                return best
            size = float(min(3.0 * best, effect.high))
        return best

    def moved(self, tag: str, form: str, size: float) -> float | None:
        """Standard deviations that remain when rig and lines are fitted to hide the effect (Gauss-Newton)."""
        effect = EFFECTS[tag]
        shares = np.zeros(self.free.shape[1])
        left, expected = [], None
        for _ in range(REFITS):
            setup = self._setup(**dict(zip((*RIG, *SURFACE), shares, strict=True)))
            shift = self._shift(setup, [(tag, size * effect.sign, form)])
            if shift is None:
                break
            left.append(float(np.linalg.norm(self.white @ shift)))
            explained, expected = self._fitted(shift)
            shares = shares - np.clip(explained, -0.2, 0.2)
        if expected is None:
            return None
        # the last guess was not tried, but after others that were it is a small step
        return min([*left, expected] if len(left) == REFITS else left)

    def hidden(self, shares: Mapping[str, float]) -> float:
        """Standard deviations that remain of another rig (shares by which its parameters differ) when it is fitted."""
        shift = self._shift(self._setup(**shares), [])
        return float("inf") if shift is None else self._fitted(shift)[1]

    def _fitted(self, shift: np.ndarray) -> tuple[np.ndarray, float]:
        """Shares of rig and lines that explain most of a change of the features, and what then remains of it."""
        shift = self.white @ shift
        explained, *_ = np.linalg.lstsq(self.free, shift, rcond=None)
        return explained, float(np.linalg.norm(shift - self.free @ explained))

    def _setup(self, **shares: float) -> Setup:
        setup = draw_setup(np.random.default_rng(self.seed))
        rig = {k: getattr(setup.rig, k) * (1 + s) for k, s in shares.items() if k in RIG}
        surface = {k: getattr(setup.surface, k) * (1 + s) for k, s in shares.items() if k in SURFACE}
        sensor = replace(SILENT, count=FINE)  # differences of two campaigns, without the noise of both
        return replace(setup, sensor=sensor, rig=replace(setup.rig, **rig), surface=replace(setup.surface, **surface))

    def _column(self, name: str) -> np.ndarray:
        """Change of the features with the logarithm of a parameter."""
        step = {**RIG, **SURFACE}[name]
        shift = self._shift(self._setup(**{name: step}), [])
        if shift is None:
            raise StickslipError(f"rig {self.seed} cannot take another {name}")
        return shift / step

    def _whitening(self, each: list[np.ndarray]) -> np.ndarray:
        """Undoes the correlations that other lines at an event bring: what they can explain counts less."""
        cells, width = int(np.prod(self.base.values.shape[:2])), self.base.values.shape[2]
        own = np.kron(np.eye(cells), np.ones((width, 1)))
        event = np.hstack([own * column[:, None] for column in each])
        return np.linalg.inv(np.linalg.cholesky(np.eye(event.shape[0]) + event @ event.T))

    def _measured(self, setup: Setup, effects: list[tuple[Any, ...]]) -> tuple[Measurement, list]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "c"
            make_campaign(path, self.seed, effects, new_lines=False, virgin=True, spring_known=True, setup=setup)
            traces = load_traces(load_campaign(path / "campaign.toml"))
        found = [segment(trace) for trace in traces]
        self.ring = getattr(self, "ring", None) or ring_period(traces, found)
        data = measure(traces, found, ring_period=self.ring, most_cycles=CYCLES)
        return data, list(zip(traces, found, strict=True))

    def _shift(self, setup: Setup, effects: list[tuple[Any, ...]]) -> np.ndarray | None:
        """Change of all features in floors (flat, zero where not valid), looked at where the reference was."""
        try:
            data, records = self._measured(setup, effects)
        except StickslipError:
            return None
        out = np.zeros_like(self.base.values)
        for r, (trace, found) in enumerate(records):
            n = int(min(np.sum(self.base.cycles.used[r]), np.sum(data.cycles.used[r])))
            for k in range(n):
                event = found.events[k]
                start = float(data.cycles.start[r][k])
                inside = (trace.time >= start - 1e-3) & (trace.time <= event.t_arrest + 8e-3)
                curve = SampledCurve(trace.time[inside], trace.displacement[inside], event.t_arrest, 0.18 * self.ring)
                old = _at(self.base, r, k)
                values = features(curve, old._replace(start=np.float64(start)), self.base.layout)
                good = self.base.valid[r, k] & data.valid[r, k] & np.isfinite(values)
                out[r, k] = np.where(good, (values - self.base.values[r, k]) / self.floor[r, k], 0.0)
        return np.clip(out, -1e3, 1e3).ravel()


def _at(data: Measurement, run: int, cycle: int) -> Any:
    a = data.anchors
    return type(a)(
        np.float64(a.start[run][cycle]), np.asarray(a.creep[run][cycle]), np.asarray(a.hold[run][cycle]),
        np.float64(a.ring_period[run][cycle]),
    )  # fmt: skip


if __name__ == "__main__":
    found = visible((e.tag, f.name) for e in EFFECTS.values() for f in e.forms)
    for tag in EFFECTS:
        limits = [f'"{form}": {amplitude:.2g}' for (of, form), amplitude in found.items() if of == tag]
        print(f'    "{tag}": {{{", ".join(limits)}}},')
