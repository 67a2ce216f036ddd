"""Fit of the dynamic model to all runs of a campaign together: annealed floors, Huber's loss, event-wise variation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from ..errors import FitError
from ..features.measurement import Measurement
from ..floors import event_widths, uncertain
from ..residual import Misfit, misfit
from .common import Common
from .composition import START, run_of
from .parameters import Free, to_si, vector
from .problem import STEP, Problem

HUBER = 3.0
QUIET = 0.15  # floors; mean change of the features below which derivatives are kept as they are
TRUST = 0.1  # share of a step's change that Broyden's update may have missed
MODERATE = 4.0  # floors, rms, by which the step of a difference should move the features
FAR = 100.0  # floors, from what a slope lets expect, beyond which a difference is that of another event
AT_ONCE = 8  # evaluations after which derivatives that were carried on are taken again
FARTHEST = (0.2, 0.5)  # step on the search scale along a direction that moves little; of a logarithm, of another scale
LEAST, LARGEST = 1e-3, (0.05, 0.5)  # such a step on the search scale; the largest of a logarithm, of another scale
DISPERSION = 16.0  # of costs, over that of noise alone: events share what a bank of three parameters cannot describe
MODEL_ERROR = 2.0  # on standard deviations: a bank of three parameters is no rough line (tests/fit/test_recovery.py)
PASSES = 3  # over all directions, until derivatives are certain
WIDE = 2.4  # factor on the floors from which a coarser tolerance of the solver does
STAGES = ((30.0, 6), (7.0, 8), (2.5, 8), (1.0, 20))  # factor on the floors, most evaluations at it


@dataclass(frozen=True)
class Fit:
    """An optimum.

    Attributes:
        z: free parameters on the search scale, shape (k,).
        events: event-wise ln factors, shape (R, n, 2).
        cost: robust chi-square, priors included.
        data_cost: of the data alone.
        features: of the model at the optimum and what all events have in common, shape (R, n, F); of cycles that the
            problem has not seen those of the data.
        offsets: what all events, or all of a run, have in common, as far as it is in ``features``, shape (R, n, F).
        covariance: of z, event-wise factors marginalised, shape (k, k); what the data tell is widened by MODEL_ERROR,
            which development campaigns asked for.
        free: what z means.
        columns: derivatives of the features in z, the last ones used, shape (R, n, F, k); in cycles that the fit has
            not seen those in u_max, p and the start of a run alone.
        use: cycles the fit has seen, shape (R, n).
        evaluations, jacobians: features and Jacobians taken.
    """

    z: np.ndarray
    events: np.ndarray
    cost: float
    data_cost: float
    features: np.ndarray
    offsets: np.ndarray
    covariance: np.ndarray
    free: tuple[Free, ...]
    columns: np.ndarray
    use: np.ndarray
    evaluations: int
    jacobians: int

    @property
    def values(self) -> dict[str, float]:
        """Name -> SI value."""
        return to_si(self.free, self.z)

    def std(self) -> dict[str, float]:
        """Name -> standard deviation (SI), from the covariance."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return {f.name: float(s * f.slope(float(z))) for f, s, z in zip(self.free, sd, self.z, strict=True)}


class _Residuals:
    """Whitened residuals and their Jacobian for scipy, in the vector (z, event factors of the used cycles)."""

    def __init__(self, problem: Problem, floor: np.ndarray, event_scale: float, use: np.ndarray | None) -> None:
        self.problem, self.floor = problem, floor
        m = problem.measurement
        self.used = np.asarray(m.cycles.used) & problem.seen & (True if use is None else use)
        self.valid = m.valid & self.used[..., None]
        self.widths = event_widths(m)[self.used].ravel() * event_scale
        self._common: dict[float, Common] = {}
        self.free = problem.composition.free
        self.k = len(self.free)
        self._at: np.ndarray | None = None
        self._features: np.ndarray | None = None
        self._columns: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self._taken = np.array([])  # where they were last taken by differences
        self._stale = False  # whether they must be, wherever they are asked for next
        self.anew = True  # whether derivatives may be taken again where Broyden's update fails
        self.evaluations = self.jacobians = 0
        self.steps = np.full(self.k, STEP)

    def events(self, x: np.ndarray) -> np.ndarray:
        out = np.zeros((*self.used.shape, 2))
        out[self.used] = x[self.k :].reshape(-1, 2)
        return out

    def solve(self, problem: Problem) -> None:
        """Go on with ``problem``, the same at another tolerance."""
        if problem is not self.problem:
            self.problem, self._at = problem, None

    def evaluate(self, x: np.ndarray) -> np.ndarray:
        """Features at ``x``, kept for the Jacobian that may follow."""
        if self._at is None or not np.array_equal(self._at, x):
            self._features = self.problem.features(x[: self.k], self.events(x))
            self._at = x.copy()
            self.evaluations += 1
        assert self._features is not None
        return self._features

    def columns(self, x: np.ndarray) -> np.ndarray:
        """Derivatives in z: taken anew, or carried on by Broyden's update while that predicts the change well."""
        f = self.evaluate(x)
        if self._columns is not None and not self._stale:
            at, old, columns = self._columns
            if np.array_equal(at, x):
                return columns
            dz = x[: self.k] - at[: self.k]
            de = self.events(x) - self.events(at)
            event = self.problem.event_columns(columns, at[: self.k], self.events(at))
            miss = f - old - columns @ dz - np.einsum("rnfe,rne->rnf", event, de)
            weight = self.valid / self.floor
            size = np.linalg.norm((f - old) * weight)
            if size < QUIET * np.sqrt(weight.astype(bool).sum()):
                return columns  # a step this small says more of the solver's noise than of a slope
            good = not self.anew or np.linalg.norm(miss * weight) < TRUST * size
            if dz @ dz > 0 and good:
                columns = columns + miss[..., None] * dz / (dz @ dz)
                self._columns = (x.copy(), f, columns)
                return columns
        columns = self._along(x, f, self._columns[2]) if self._columns is not None else self._apart(x, f)
        self.jacobians += 1
        self._taken, self._stale = x.copy(), False
        self._columns = (x.copy(), f, columns)
        return columns

    def _apart(self, x: np.ndarray, f: np.ndarray) -> np.ndarray:
        """Derivatives by a difference for each parameter."""
        columns = self._differences(x, f, range(self.k))
        again = self._adapt(columns, range(self.k))
        if again:
            columns[..., again] = self._differences(x, f, again)
            self._adapt(columns, again)
        return columns

    def _along(self, x: np.ndarray, f: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Derivatives by differences along the principal directions of those ``known``.

        What several parameters do together may be a thousandth of what each does alone, and is lost in the noise of
        differences taken apart: it is measured in a step of its own, long enough to be seen.
        """
        apart = np.array([run_of(free.name) is not None for free in self.free])  # of one run each
        widths = np.array([min(free.width, 1.0) for free in self.free])
        seen = np.nan_to_num(known)[self.valid] * widths
        whitened = np.clip(self.common(1.0)(seen[:, ~apart]), -1e6, 1e6)
        _, _, rotation = np.linalg.svd(whitened, full_matrices=False)
        directions = np.diag(widths)
        directions[np.ix_(~apart, ~apart)] = widths[~apart, None] * rotation.T
        reach = np.array([FARTHEST[0] if free.scale == "log" else FARTHEST[1] for free in self.free])
        longest = (reach[:, None] / np.maximum(np.abs(directions), 1e-12)).min(axis=0)
        moved = np.abs(seen / self.floor[self.valid][:, None] @ (directions / widths[:, None]))
        steps = np.array([_moderate(column, most) for column, most in zip(moved.T, longest, strict=True)])
        slopes = self.problem.slopes(x[: self.k], self.events(x), directions, f, steps)
        before = known @ directions
        # an event that falls on the other side of a hold within the step tells nothing of a slope
        far = np.abs(np.nan_to_num((slopes - before) * steps / self.floor[..., None])) > FAR
        slopes = np.where(np.any(far & self.valid[..., None], axis=2, keepdims=True), before, slopes)
        return np.asarray(slopes @ np.linalg.inv(directions))

    def _differences(self, x: np.ndarray, f: np.ndarray, which: Sequence[int]) -> np.ndarray:
        return self.problem.columns(x[: self.k], self.events(x), which, f, self.steps[list(which)])

    def _adapt(self, columns: np.ndarray, which: Sequence[int]) -> list[int]:
        """Set the steps of the next differences by what these moved; returns those that moved far too much."""
        far = []
        for i in which:
            moved = np.abs(np.nan_to_num(columns[..., i] * self.steps[i] / self.floor, nan=1e3))[self.valid]
            rms = float(np.sqrt(np.mean(np.minimum(moved, 100.0) ** 2)))
            if rms > 4.0 * MODERATE:
                far.append(i)
            largest = LARGEST[0] if self.free[i].scale == "log" else LARGEST[1]
            self.steps[i] = np.clip(self.steps[i] * np.clip(MODERATE / max(rms, 1e-9), 0.1, 5.0), LEAST, largest)
        return far

    def renew(self, x: np.ndarray) -> bool:
        """Have the derivatives at ``x`` taken again, unless they were taken just there; returns whether so."""
        stale = self.anew and not np.array_equal(self._taken, x)
        self._stale = self._stale or stale
        return stale

    def start(self, x: np.ndarray, columns: np.ndarray) -> None:
        """Take ``columns`` for the derivatives at ``x``."""
        self._columns = (x.copy(), self.evaluate(x), columns)

    def common(self, factor: float) -> Common:
        """What events have in common, with the floors times ``factor``."""
        if factor not in self._common:
            self._common[factor] = self.problem.common(self.floor, self.used, factor)
        return self._common[factor]

    def misfit(self, x: np.ndarray) -> np.ndarray:
        """Model less data (SI), shape (R, n, F), limited to 1e4 floors; that where the model has no such feature."""
        r = self.evaluate(x) - self.problem.measurement.values
        return np.clip(np.nan_to_num(r / self.floor, nan=1e4), -1e4, 1e4) * self.floor

    def data(self, x: np.ndarray, factor: float) -> np.ndarray:
        return self.common(factor)(self.misfit(x)[self.valid])

    def priors(self, x: np.ndarray) -> np.ndarray:
        z = x[: self.k]
        p = [(v - f.inward(f.prior)) / f.width for v, f in zip(z, self.free, strict=True) if np.isfinite(f.width)]
        return np.concatenate([p, x[self.k :] / self.widths])

    def residual(self, x: np.ndarray, factor: float) -> np.ndarray:
        return np.concatenate([self.data(x, factor), self.priors(x)])

    def jacobian(self, x: np.ndarray, factor: float) -> np.ndarray:
        columns = self.columns(x)
        de = self.problem.event_columns(columns, x[: self.k], self.events(x))
        slopes = self._side_by_side(np.nan_to_num(columns)[self.valid], np.nan_to_num(de)[self.valid])
        return np.clip(np.vstack([self.common(factor)(slopes), self._prior_slopes()]), -1e7, 1e7)

    def _side_by_side(self, shared: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Columns of what is common to all cycles, and of the two factors that each cycle has for itself."""
        cells = int(self.used.sum())
        index = np.full(self.used.shape, -1)
        index[self.used] = np.arange(cells)
        owner = np.broadcast_to(index[..., None], self.valid.shape)[self.valid]
        event = np.zeros((len(shared), 2 * cells))
        at = np.arange(len(shared))
        event[at, 2 * owner] = own[:, 0]
        event[at, 2 * owner + 1] = own[:, 1]
        return np.hstack([shared, event])

    def _prior_slopes(self) -> np.ndarray:
        finite = [i for i, f in enumerate(self.free) if np.isfinite(f.width)]
        prior = np.zeros((len(finite), self.k + self.widths.size))
        prior[np.arange(len(finite)), finite] = [1.0 / self.free[i].width for i in finite]
        event = np.hstack([np.zeros((self.widths.size, self.k)), np.diag(1.0 / self.widths)])
        return np.vstack([prior, event])

    def information(self, x: np.ndarray) -> np.ndarray:
        """The Jacobian for the covariance: what every feature tells of a parameter (:func:`uncertain`), and priors."""
        columns = self.columns(x)
        event = self.problem.event_columns(columns, x[: self.k], self.events(x))
        width = MODEL_ERROR * uncertain(self.problem.measurement)[self.valid][:, None]
        slopes = self._side_by_side(np.nan_to_num(columns)[self.valid], np.nan_to_num(event)[self.valid]) / width
        return np.clip(np.vstack([slopes, self._prior_slopes()]), -1e7, 1e7)

    def covariance(self, x: np.ndarray) -> np.ndarray:
        """Covariance of z, what varies from event to event marginalised, shape (k, k)."""
        scale = np.concatenate([[min(f.width, 1.0) for f in self.free], self.widths])
        slopes = self.information(x) * scale
        soft = self.problem.coupled()
        back = np.diag(scale[: self.k])
        if soft is not None:  # the strength goes with the spring's stiffness
            slopes[:, soft[0]] += slopes[:, soft[1]] * scale[soft[0]] / scale[soft[1]]
            back[soft[1], soft[0]] = scale[soft[0]]
        spread = np.linalg.pinv(slopes.T @ slopes)[: self.k, : self.k]
        covariance: np.ndarray = back @ spread @ back.T
        return covariance

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = zip(*(f.bounds for f in self.free), strict=True)
        reach = 4.0 * self.widths
        return np.concatenate([low, -reach]), np.concatenate([high, reach])


def _moderate(rate: np.ndarray, longest: float) -> float:
    """The step, at most ``longest``, that moves features by MODERATE (rms); ``rate`` in floors for a unit of it."""
    steps = longest * np.geomspace(1e-4, 1.0, 60)
    rms = np.sqrt(np.mean(np.minimum(rate * steps[:, None], 100.0) ** 2, axis=1))
    return float(steps[max(int(np.searchsorted(rms, MODERATE, side="right")) - 1, 0)])


def robust(r: np.ndarray) -> float:
    """Huber's loss: chi-square with the far tails straightened."""
    a = np.abs(r)
    return float(np.sum(np.where(a <= HUBER, a * a, 2.0 * HUBER * a - HUBER * HUBER)))


def fit(
    problem: Problem,
    floor: np.ndarray,
    *,
    z: np.ndarray | None = None,
    events: np.ndarray | None = None,
    stages: tuple[tuple[float, int], ...] = STAGES,
    event_scale: float = 1.0,
    use: np.ndarray | None = None,
    columns: np.ndarray | None = None,
    anew: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Fit:
    """Levenberg-Marquardt (trust region with bounds) at falling floors.

    Args:
        problem: composition and data.
        floor: standard deviation of every feature, shape (R, n, F).
        z, events: where to start; default the composition's starts and no variation.
        stages: factors on the floors and how many evaluations each may take.
        event_scale: on the prior width of the event-wise variation.
        use: cycles to fit, shape (R, n); default all.
        columns: derivatives at the start if they are known, shape (R, n, F, k).
        anew: whether derivatives may be taken again; if not, those given, or taken at the start, are only updated.
        progress: told the iteration and the error (rms, in floors) after every evaluation.

    Raises:
        FitError: the model could not be evaluated at the start.
    """
    whole, used = problem, np.asarray(problem.measurement.cycles.used)
    problem = problem.seeing(used if use is None else used & use)
    res = _Residuals(problem, floor, event_scale, use)
    coarse = problem.coarser() if any(factor >= WIDE for factor, _ in stages) else problem
    low, high = res.bounds()
    start = vector(problem.composition.free) if z is None else np.asarray(z, float)
    ev = np.zeros((*res.used.shape, 2)) if events is None else events
    x = np.clip(np.concatenate([start, ev[res.used].ravel()]), low + 1e-9, high - 1e-9)
    res.anew = anew
    res.solve(coarse if stages[0][0] >= WIDE else problem)
    if columns is not None:
        res.start(x, columns)
    scale = np.concatenate([[min(f.width, 1.0) for f in res.free], res.widths])
    soft = problem.coupled()

    def outward(u: np.ndarray, begun: np.ndarray) -> np.ndarray:
        x = begun + scale * u
        if soft is not None:  # the strength goes with the spring's stiffness
            x[soft[1]] += scale[soft[0]] * u[soft[0]]
        return np.clip(x, low + 1e-9, high - 1e-9)

    def inward(jac: np.ndarray) -> np.ndarray:
        out = jac * scale
        if soft is not None:
            out[:, soft[0]] += jac[:, soft[1]] * scale[soft[0]]
        return out

    ahead = list(stages)
    while ahead:
        factor, most = ahead.pop(0)
        # sought as a distance from where the stage begins, in units of the priors: scipy takes the length of the
        # start vector for the radius it trusts, and that of logarithms is far too long
        begun = x
        res.solve(coarse if factor >= WIDE else problem)

        def residual(u: np.ndarray, factor: float = factor, begun: np.ndarray = begun) -> np.ndarray:
            r = res.residual(outward(u, begun), factor)
            if progress is not None:
                error = factor * float(np.sqrt(robust(r) / max(r.size, 1)))
                progress(f"iteration {res.jacobians}, error {error:.3g}")
            return r

        def jacobian(u: np.ndarray, factor: float = factor, begun: np.ndarray = begun) -> np.ndarray:
            return inward(res.jacobian(outward(u, begun), factor))

        if not np.all(np.isfinite(residual(np.zeros_like(x)))):
            raise FitError("the model gives no finite features at the start of the fit")
        found = least_squares(
            residual,
            np.zeros_like(x),
            jac=jacobian,
            bounds=_box(low, high, begun, scale, soft),
            loss="huber",
            f_scale=HUBER,
            max_nfev=most if ahead else min(most, AT_ONCE),
            ftol=4e-3,
            xtol=1e-4,
            gtol=1e-6,
        )
        x = outward(found.x, begun)
        if not ahead and most - found.nfev > 1 and res.renew(x):
            # what stands still with derivatives that were carried on may go on with new ones
            ahead = [(factor, most - found.nfev)]
    res.solve(problem)
    offsets = -res.common(1.0).offsets(res.misfit(x))
    data, prior = res.data(x, 1.0), res.priors(x)
    x, raw, columns = _with_unseen(whole, res, x)
    return Fit(
        x[: res.k],
        res.events(x),
        robust(data) + float(prior @ prior),
        robust(data),
        raw + offsets,
        offsets,
        res.covariance(x),
        problem.composition.free,
        columns,
        res.used,
        res.evaluations,
        res.jacobians,
    )


def _begun_alike(res: _Residuals, x: np.ndarray) -> np.ndarray:
    """The parameters with runs that the fit has not seen begun as far from full strength as those it has (the median),
    which an effect may have moved by far: only from near there their own slips tell how far it is."""
    runs = {i: run_of(free.name) for i, free in enumerate(res.free) if free.name.startswith(START)}
    seen = [x[i] for i, run in runs.items() if res.used[run].any()]
    unseen = [i for i, run in runs.items() if not res.used[run].any()]
    x = x.copy()
    if seen:
        x[unseen] = np.median(seen)
    return x


def _with_unseen(whole: Problem, res: _Residuals, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features and derivatives at ``x``, those of cycles that the fit has not seen added: there only what every event,
    or a run, has of its own is derived by, for that is set anew where a fit is judged on them. Before them ``x``, with
    runs that the fit has not seen begun like the others."""
    features, columns = res.evaluate(x), res.columns(x)
    unseen = np.asarray(whole.measurement.cycles.used) & whole.seen & ~res.used
    if not unseen.any():
        return x, features, columns
    x = _begun_alike(res, x)
    z, events = x[: res.k], res.events(x)
    rest = whole.seeing(unseen)
    features = np.where(unseen[..., None], rest.features(z, events), features)
    columns = np.where(unseen[..., None, None], 0.0, columns)
    names = [free.name for free in res.free]
    begins = [i for i, name in enumerate(names) if name.startswith(START) and not res.used[run_of(name)].any()]
    own = [names.index("contact.u_max"), names.index("contact.p")]
    # carried derivatives leave the steps as short as at first: these move features as far as those of a fit do
    rates = np.abs(np.nan_to_num(columns[..., own])[res.valid] / res.floor[res.valid][:, None])
    steps = [_moderate(rate, LARGEST[0]) for rate in rates.T] + [STEP] * len(begins)
    which = [*own, *begins]
    slopes = rest.columns(z, events, which, features, np.array(steps))
    columns[..., which] += np.where(unseen[..., None, None], slopes, 0.0)
    return x, features, columns


def certain(problem: Problem, floor: np.ndarray, found: Fit) -> Fit:
    """The same optimum with derivatives and covariance taken once more, along principal directions.

    Derivatives that a search has carried on, or that were taken by a difference for each parameter, hold the solver's
    noise in the directions that the features hardly tell, and noise looks like knowledge: it makes standard deviations
    too small, by a factor of three in the worst case seen. So the motion is solved strictly here: how much noise there
    is at the tolerance of a search, and with it the standard deviation, hangs on how a processor rounds.
    """
    res = _Residuals(problem.seeing(found.use).strict(), floor, 1.0, found.use)
    x = np.concatenate([found.z, found.events[res.used].ravel()])
    features, columns = res.evaluate(x), found.columns
    for _ in range(PASSES):  # the first on steps that noise has made too short
        columns = res._along(x, features, columns)
    unseen = ~res.used[..., None, None]
    columns = np.where(unseen, found.columns, columns)
    res.start(x, columns)
    evaluations = found.evaluations + PASSES * columns.shape[-1]
    jacobians = found.jacobians + PASSES
    return replace(found, covariance=res.covariance(x), columns=columns, evaluations=evaluations, jacobians=jacobians)


def _box(
    low: np.ndarray, high: np.ndarray, begun: np.ndarray, scale: np.ndarray, soft: tuple[int, int] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the search variables; the strength, which moves with the stiffness as well, has none of its own."""
    box = (low - begun) / scale, (high - begun) / scale
    if soft is not None:
        box[0][soft[1]], box[1][soft[1]] = -np.inf, np.inf
    return box


def errors(measurement: Measurement, found: Fit, floor: np.ndarray) -> Misfit:
    """The errors of a fit on the cycles it has seen, and what those have in common."""
    used = found.use & np.asarray(measurement.cycles.used)
    shown = replace(measurement, valid=measurement.valid & used[..., None])
    common = Common(measurement, floor, used)
    off = np.nan_to_num((found.features - found.offsets - measurement.values) / floor, nan=1e4) * floor
    return replace(misfit(shown, found.features, floor), alike=common.alike(off[common.valid]))
