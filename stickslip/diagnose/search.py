"""Where a search with one effect begins: linear steps from a grid of its inner parameters, and refits around plausible
amplitudes, each tried with the model itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product, zip_longest

import numpy as np

from ..effects.base import Effect
from ..errors import StickslipError
from ..features.measurement import Measurement
from ..fit.common import Common
from ..fit.composition import PHASE, Composition, run_of
from ..fit.composition import START as START_OF_RUN
from ..fit.inertial import Fit, fit, robust
from ..fit.parameters import effect_parameters
from ..fit.problem import Problem
from ..floors import event_widths
from ..params import specs
from .begin import begun, with_starts
from .candidate import Candidate, ease
from .linear import Linear, Step
from .periods import periods, phasor, within_record
from .recurrences import told

START = 0.02  # of the amplitude's range; scaled until its effect on the features is moderate
MODERATE = (2.0, 12.0)  # floors, rms: large against the solver's noise, small against what bends
MOST_STARTS = 6
PLAUSIBLE = 60.0  # floors, rms: by how much an amplitude moves the features at which everything else is refitted
TOLD = 0.5  # share of what makes recurrences differ within runs: an amplitude that explains as much is begun at
LARGER = 2.5  # times such an amplitude: what is tried besides where nothing describes the data
CARRIED = ((30.0, 6), (7.0, 6), (2.5, 7))  # stages of that refit, with the base's derivatives carried on
OTHERS = 2  # further starts that a leader is fitted from
SHARES = (1.0, 0.4)  # of a linear step that are tried
LOCKED = (1.0, 0.6)  # shares of the amplitude that locked onsets tell that are tried


def silent(text: str) -> None:
    """Progress that nobody asked for."""


def score(
    effect: Effect,
    base: Composition,
    optimum: Fit,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    *,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Candidate:
    """Score one effect and find where to start with it; arguments as :func:`stickslip.diagnose.refit.try_effect`."""
    form = {k: str(v) for k, v in vars(effect).items() if isinstance(v, str)}
    try:
        return _score(effect, form, base, optimum, measurement, floor, train, threads, progress or silent)
    except StickslipError as error:
        return Candidate(effect.tag, form, effect, 0.0, note=str(error))


def starts(
    effect: Effect, found: list[float] | None = None, bounds: tuple[float, float] | None = None
) -> list[dict[str, float]]:
    """Values of the effect's inner parameters to begin a search from: their grid.

    Args:
        effect: with its form chosen.
        found: periods the data hint at, for an effect that is periodic, the strongest first; they replace the grid's.
        bounds: of its period or frequency, where the record allows less than the effect.
    """
    table = specs(effect)
    inner = {k: s.grid for k, s in table.items() if k != effect.amplitude and s.grid}
    if effect.periodic is not None:
        name = effect.periodic[0]
        inner.pop("phase", None)
        low, high = bounds or (table[name].lower, table[name].upper)
        at = tuple(v for v in (1.0 / p if name == "frequency" else p for p in found or ()) if low < v < high)
        inner[name] = at[:MOST_STARTS] or tuple(v for v in inner.get(name, ()) if low < v < high)
        inner[name] = inner[name] or (float(np.sqrt(low * high)),)
    grid = [dict(zip(inner, values, strict=True)) for values in product(*inner.values())]
    if len(grid) <= MOST_STARTS:
        return grid
    return [grid[i] for i in _spread([len(values) for values in inner.values()], MOST_STARTS)]


def _spread(lengths: list[int], number: int) -> list[int]:
    """So many points of a grid (as numbers of `itertools.product`) that every pair of them differs in as many
    parameters as can be, and each parameter has its values about equally often: an even stride through the grid would
    leave one of them at one value."""
    points = list(product(*(range(n) for n in lengths)))
    chosen = [0]
    while len(chosen) < number:
        often = [np.bincount([points[j][i] for j in chosen], minlength=n) for i, n in enumerate(lengths)]

        def worth(k: int, often: list[np.ndarray] = often) -> tuple[int, int]:
            apart = min(sum(a != b for a, b in zip(points[k], points[j], strict=True)) for j in chosen)
            return apart, -sum(int(often[i][value]) for i, value in enumerate(points[k]))

        chosen.append(max((k for k in range(len(points)) if k not in chosen), key=worth))
    return sorted(chosen)


def plausible(
    candidate: Candidate, optimum: Fit, measurement: Measurement, floor: np.ndarray, train: np.ndarray, threads: int
) -> list[np.ndarray]:
    """Free parameters with the candidate's effect at plausible amplitudes and at larger ones, of either sign where it
    may have both, from every start of its inner parameters; everything else as the model without it has it."""
    assert candidate.composition is not None
    assert candidate.fit is not None
    use = train & np.asarray(measurement.cycles.used)
    problem = Problem(candidate.composition, measurement, threads=threads).coarser().seeing(use)
    k = len(optimum.free)
    free = candidate.fit.free[k:]
    valid = measurement.valid & use[..., None]
    search = Search(problem, optimum, floor, valid, candidate.wide, free, k, candidate.effect)
    found = [search.far(inner, sign, PLAUSIBLE, use) for inner in starts(candidate.effect) for sign in (1.0, -1.0)]
    near = [far[0] for far in found if far is not None]
    return [z for at in near for z in (at, search.scaled(at, LARGER, use))]


def _score(effect, form, base, optimum, measurement, floor, train, threads, tell) -> Candidate:
    free = within_record(effect, effect_parameters(effect), measurement)
    composition = base.with_effect(effect, free)
    k = len(base.free)
    use = train & np.asarray(measurement.cycles.used)
    problem = Problem(composition, measurement, threads=threads).coarser().seeing(use)
    valid = measurement.valid & use[..., None]
    factor = ease(optimum, measurement, floor)
    linear = Linear(problem, optimum, measurement, floor, valid, factor)
    hints: list[float] = []
    limits: tuple[float, float] | None = None
    if effect.periodic is not None:
        period = next(f for f in free if f.name == f"{effect.tag}.{effect.periodic[0]}")
        bounds = limits = (period.lower, period.upper)
        if effect.periodic[0] == "frequency":
            bounds = (1.0 / period.upper, 1.0 / period.lower)
        model = optimum.features - optimum.offsets
        both = [periods(effect.periodic[1], measurement, model, use, bounds, together=t) for t in (True, False)]
        hints = list(dict.fromkeys(p for pair in zip_longest(*both) for p in pair if p is not None))
    search = Search(problem, optimum, floor, valid, factor, free, k, effect)
    explained, likely = 0.0, {}
    for values in starts(effect, hints, limits):
        share = search.along(values, linear)
        if share >= explained:
            explained, likely = share, values
        tell(f"{effect.tag}: start {values}, explains {100 * share:.0f} %")
    if search.best is not None:
        if effect.periodic is None:
            for sign in (1.0, -1.0):
                search.push(likely, sign, PLAUSIBLE, use)
            search.by_recurrences(use)
        else:
            search.settle(use)
        tell(f"{effect.tag}: everything else refitted around a plausible amplitude")
    if search.best is None:
        return Candidate(effect.tag, form, effect, explained, composition=composition, note="cannot be evaluated")
    cost, z, events, features = search.best
    others = tuple((o[1], o[2]) for o in search.others())
    promise = 1.0 - cost / search.cost(optimum.z, optimum.events, search.bare)
    columns = search.columns.get(z.tobytes())
    if columns is None:
        columns = np.concatenate([optimum.columns, np.zeros((*features.shape, len(free)))], axis=-1)
    common = Common(measurement, floor, use)
    off = search.off(features)
    offsets, r = -common.offsets(off), robust(common(off[valid]))
    unknown = np.zeros((z.size, z.size))
    start = Fit(z, events, r, r, features + offsets, offsets, unknown, composition.free, columns, use, 0, 0)
    return Candidate(
        effect.tag, form, effect, explained, promise, factor, composition, start, note="not refitted", others=others
    )


class Search:
    """The best place to start with an effect: linear steps of everything, each tried with the model itself."""

    def __init__(self, problem, optimum, floor, valid, factor, free, k, effect) -> None:
        self.problem, self.optimum, self.floor, self.valid, self.factor = problem, optimum, floor, valid, factor
        self.free, self.k, self.effect = free, k, effect
        self.amplitude = next(i for i, f in enumerate(free) if f.amplitude)
        self.common = Common(problem.measurement, floor, valid.any(axis=-1), factor)
        self.widths = event_widths(problem.measurement)[valid.any(axis=-1)]
        self.null = free[self.amplitude].inward(specs(effect)[effect.amplitude].null or 0.0)
        self.best: tuple[float, np.ndarray, np.ndarray, np.ndarray] | None = None
        self.moderate: float | None = None
        self.columns: dict[bytes, np.ndarray] = {}  # derivatives where everything was refitted
        self.each: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []  # the best from every start
        self.plausible: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []  # from plausible amplitudes
        self.rates: list[tuple[dict[str, float], np.ndarray]] = []  # inner values, change for a unit of the amplitude
        self.bare = problem.features(self.point({}, self.null), optimum.events)  # the base at this tolerance

    def point(self, values: dict[str, float], amplitude: float, base: np.ndarray | None = None) -> np.ndarray:
        """Free parameters with the effect's inner ``values`` and its ``amplitude`` on the search scale."""
        names = [f.name.split(".", 1)[1] for f in self.free]
        given = [
            values.get(name, values.get(name.split(".")[0], f.start)) for name, f in zip(names, self.free, strict=True)
        ]
        inner = [f.inward(f.starting(value).start) for f, value in zip(self.free, given, strict=True)]
        low, high = self.free[self.amplitude].bounds
        inner[self.amplitude] = float(np.clip(amplitude, low + 1e-6, high - 1e-6))
        return np.concatenate([self.optimum.z if base is None else base, inner])

    def secant(self, values: dict[str, float]) -> tuple[np.ndarray, float] | None:
        """Change of the features for a unit of the amplitude, over a step whose effect is moderate; and that step."""
        low, high = self.free[self.amplitude].bounds
        reach = high - self.null if high > self.null else low - self.null
        longest = 0.98 * abs(reach)
        size = START * reach if self.moderate is None else self.moderate
        best = None
        for _ in range(4):
            features = self.problem.features(self.point(values, self.null + size), self.optimum.events)
            change = features - self.bare
            moved = np.abs(np.nan_to_num(change / self.floor, nan=1e3))[self.valid]
            rms = float(np.sqrt(np.mean(np.minimum(moved, 100.0) ** 2)))
            if np.isfinite(features[self.valid]).all():
                best = change / size, size
            if MODERATE[0] <= rms <= MODERATE[1] or (rms < MODERATE[0] and abs(size) >= longest):
                self.moderate = size  # about right for the next inner values as well
                break
            wanted = size * float(np.clip(np.sqrt(MODERATE[0] * MODERATE[1]) / max(rms, 1e-6), 0.02, 20.0))
            size = float(np.sign(wanted) * min(abs(wanted), longest))
        return best

    def along(self, values: dict[str, float], linear: Linear) -> float:
        """Try the linear step from these inner values; returns the share of the misfit it should explain."""
        phased = self.effect.periodic is not None
        lines = [{**values, "phase": p} for p in (0.0, np.pi / 2)] if phased else [values]
        found = [self.secant(v) for v in lines]
        known = [f for f in found if f is not None]
        if len(known) < len(lines):
            return 0.0
        if phased:
            step, size, phases = self._each_run([f[0] for f in known], linear)
            values = {**values, **phases}
        else:
            self.rates.append((values, known[0][0]))
            step = linear.step([known[0][0]])
            size = float(step.sizes[0])
        bounds = np.array([f.bounds for f in self.optimum.free])
        first = self.best is None
        offers = []
        for share in SHARES:
            moved = np.clip(self.optimum.z + share * np.clip(step.z, -1.0, 1.0), *bounds.T)
            events = self.optimum.events + share * np.clip(step.events, -0.3, 0.3)
            offers.append(self._offer(self.point(values, self.null + share * size, moved), events))
            if not first and self.best is not None and offers[-1][0] <= self.best[0]:
                break
        if phased:
            offers += self._locked(values, known[0][0])
        if first:
            # the least there is: the base with a little of the effect
            little = self.null + np.sign(size or 1.0) * 0.1 * abs(known[0][1])
            offers.append(self._offer(self.point(values, little), self.optimum.events))
        self.each.append(min(offers, key=lambda o: o[0]))
        return step.share

    def _each_run(self, quarters: list[np.ndarray], linear: Linear) -> tuple[Step, float, dict[str, float]]:
        """The linear step along an effect at phases of zero and a quarter turn, each run with a phase of its own.

        Returns:
            The step, the amplitude that most cycles ask for, and the phases by name.
        """
        cycles = self.valid.any(axis=-1).sum(axis=1)
        runs = np.flatnonzero(cycles)
        masks = [(np.arange(len(cycles)) == r)[:, None, None] for r in runs]
        step = linear.step([change * mask for mask in masks for change in quarters])
        pairs = step.sizes.reshape(-1, 2)
        size = float(np.sqrt(np.average(np.sum(pairs**2, axis=1), weights=cycles[runs])))
        return step, size, self._phases(dict(zip(runs.tolist(), np.arctan2(pairs[:, 1], pairs[:, 0]), strict=True)))

    def _phases(self, told: Mapping[int, float]) -> dict[str, float]:
        """Values of the phase's parameters from the phases of runs."""
        own = [f.name.split(".", 1)[1] for f in self.free if run_of(f.name) is not None]
        if not own:
            return {PHASE: float(next(iter(told.values()), 0.0))}
        return {name: float(told.get(int(name.split(".")[1]), 0.0)) for name in own}

    def _locked(self, values: dict[str, float], rate: np.ndarray) -> list[tuple]:
        """Starts with the amplitude and the phase that the measured onsets tell, which may be locked to the period.

        ``rate`` is the change of the features for a unit of the amplitude at a phase of zero.
        """
        name, variable = self.effect.periodic
        period = 1.0 / values[name] if name == "frequency" else values[name]
        m, used = self.problem.measurement, self.valid.any(axis=-1)
        own = phasor(variable, m, self.bare, rate, period, used)
        late = phasor(variable, m, m.values, m.values - self.bare, period, used)
        known = np.flatnonzero((own != 0.0) & (late != 0.0))
        if not known.size:
            return []
        ratio = late[known] / own[known]
        told = {**values, **self._phases(dict(zip(known.tolist(), np.angle(ratio), strict=True)))}
        size = float(np.median(np.abs(ratio)))
        return [self._offer(self.point(told, self.null + share * size), self.optimum.events) for share in LOCKED]

    def push(self, values: dict[str, float], sign: float, rms: float, use: np.ndarray) -> None:
        """Refit everything from an amplitude that moves the features by ``rms`` floors, however little that promises.

        What the base has bent itself to imitate shows no slope at an amplitude of zero. Nothing is done where the
        amplitude cannot have that ``sign``.
        """
        far = self.far(values, sign, rms, use)
        if far is not None:
            self._refit(far[0], self.optimum.events, far[1], use)

    def by_recurrences(self, use: np.ndarray) -> None:
        """Refit everything from the amplitude that the recurrences tell, if one explains how they differ within runs.

        Runs that do not begin virgin begin so that their slips come when the measured ones do.
        """
        m, at = self.problem.measurement, self.problem.measurement.layout.slices()["recurrence"].start
        off, floor, valid = (a[..., at] for a in (m.values - self.bare, self.floor, self.valid))
        low, high = self.free[self.amplitude].bounds
        found = [(values, *told(off, rate[..., at], floor, valid)) for values, rate in self.rates]
        found = [f for f in found if f[2] >= TOLD and low < self.null + f[1] < high]
        if not found:
            return
        values, size, _ = max(found, key=lambda f: f[2])
        o, z = self.optimum, self.point(values, self.null + size)
        z, features = begun(self.problem, z, o.events, o.columns, o.free, m.values, use)
        self._refit(z, o.events, features, use)

    def far(
        self, values: dict[str, float], sign: float, rms: float, use: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Free parameters with an amplitude that moves the features by ``rms`` floors, and the features there.

        Runs that do not begin virgin begin so that their slips come when they did. None where the amplitude cannot
        have that ``sign``.
        """
        low, high = self.free[self.amplitude].bounds
        reach = high - self.null if sign > 0.0 else low - self.null
        if sign * reach <= 0.0:
            return None
        share = 0.1
        for _ in range(5):
            z = self.point(values, self.null + share * reach)
            o = self.optimum
            z, features = begun(self.problem, z, o.events, o.columns, o.free, self.bare, use, steps=1)
            moved = np.abs(np.nan_to_num((features - self.bare) / self.floor, nan=1e3))[self.valid]
            now = float(np.sqrt(np.mean(np.minimum(moved, 1e3) ** 2)))
            if 0.6 * rms < now < 1.6 * rms or (now < rms and share >= 0.5):
                break
            share = float(np.clip(share * np.clip(rms / max(now, 1e-6), 0.02, 10.0), 1e-6, 0.5))
        if any(f.name.startswith(START_OF_RUN) for f in o.free):
            z, features = begun(self.problem, z, o.events, o.columns, o.free, self.bare, use)
        return z, features

    def scaled(self, z: np.ndarray, times: float, use: np.ndarray) -> np.ndarray:
        """Free parameters with the amplitude so many times as large, as far as its bounds let it."""
        out, at, o = z.copy(), self.k + self.amplitude, self.optimum
        low, high = self.free[self.amplitude].bounds
        out[at] = float(np.clip(self.null + times * (z[at] - self.null), low + 1e-6, high - 1e-6))
        return with_starts(self.problem, out, o.events, o.columns, o.free, self.bare, use)

    def settle(self, use: np.ndarray) -> None:
        """Refit everything from the best place seen: where an effect is periodic, its phase tells how large it is."""
        assert self.best is not None
        _, z, events, features = self.best
        self._refit(z, events, features, use)

    def _refit(self, z: np.ndarray, events: np.ndarray, features: np.ndarray, use: np.ndarray) -> None:
        own = self.problem.columns(z, events, range(self.k, z.size), features)
        columns = np.concatenate([self.optimum.columns, own], axis=-1)
        found = fit(self.problem, self.floor, z=z, events=events, stages=CARRIED, use=use, columns=columns, anew=False)
        self.plausible.append(self._keep(found.z, found.events, found.features - found.offsets))
        self.columns[found.z.tobytes()] = found.columns

    def others(self) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
        """Further starts: those from plausible amplitudes before those near none, which end in one place as a rule."""
        ranked = [o for kind in (self.plausible, self.each) for o in sorted(kind, key=lambda o: o[0])]
        return [o for o in ranked if o is not self.best][:OTHERS]

    def cost(self, z: np.ndarray, events: np.ndarray, features: np.ndarray) -> float:
        """Robust chi-square at the widened floors, with the priors of the base; ``features`` of the model alone."""
        away = [(v - f.inward(f.prior)) / min(f.width, 1e3) for v, f in zip(z, self.optimum.free, strict=False)]
        at = events[self.valid.any(axis=-1)] / self.widths
        return robust(self.common(self.off(features)[self.valid])) + float(np.sum(np.square(away)) + np.sum(at**2))

    def off(self, features: np.ndarray) -> np.ndarray:
        """Model less data (SI), limited to 1e4 floors."""
        r = (features - self.problem.measurement.values) / self.floor
        return np.clip(np.nan_to_num(r, nan=1e4), -1e4, 1e4) * self.floor

    def _offer(self, z: np.ndarray, events: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        return self._keep(z, events, self.problem.features(z, events))

    def _keep(
        self, z: np.ndarray, events: np.ndarray, features: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        offer = self.cost(z, events, features), z, events, features
        if self.best is None or offer[0] < self.best[0]:
            self.best = offer
        return offer
