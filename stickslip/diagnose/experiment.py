"""What to measure next: the experiment in which fitted models would differ most."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..errors import StickslipError
from ..fit.composition import Composition
from ..fit.record import Fitted
from ..floors import Scatter
from .bench import estimates, prepared, until_slips
from .menu import BACK, HELD_AT, LONGEST, MENU, Conditions, Experiment, quantity
from .outcome import FEATURES, Outcome, floor_of, outcome

DRAWS = 4  # of the parameters of each model, for what its fit leaves open
SEED = 0  # of these draws
SLIPS = 3  # of a run: the third is past the start
SLIDES = "slides"  # why there is no slip to be compared
TELLING = 3.0  # floors from which an experiment separates two models

# feature -> what it is of, in a sentence; the unit; the words for more and less
_WORDS = {
    "recurrence": ("the slips follow each other", "s", "later", "earlier"),
    "size": ("the slip is", "m", "larger", "smaller"),
    "peak": ("the peak velocity of the slip is", "m/s", "higher", "lower"),
    "creep": ("the creep before the slip is", "m", "larger", "smaller"),
    "frequency": ("the ringing after the slip is", "Hz", "higher", "lower"),
    "hold": ("the block's creep in the hold is", "m", "larger", "smaller"),
}


class Rival(Protocol):
    """A fitted model."""

    @property
    def tag(self) -> str:
        """What it is called."""

    @property
    def composition(self) -> Composition | None:
        """The family of models."""

    @property
    def fit(self) -> Fitted | None:
        """The member of it, and its covariance."""


class Difference(NamedTuple):
    """A feature with one model and with the other (SI), and how many floors they are apart."""

    first: float
    second: float
    floors: float


@dataclass(frozen=True)
class Proposal:
    """An experiment and what it would tell.

    Attributes:
        name: of the experiment.
        separation: floors by which the models differ in the feature that differs most; infinite where only one of them
            slips, zero where neither does.
        feature: which that is; empty where there is none.
        text: one sentence.
        differences: of every feature.
    """

    name: str
    separation: float
    feature: str
    text: str
    differences: dict[str, Difference]


class _Ran(NamedTuple):
    """An outcome, or why there is none: it slides, or the solver's message; and times of the last stick (s, s)."""

    outcome: Outcome | None
    why: str = ""
    stick: tuple[float, float] = (0.0, 0.0)


def propose(
    first: Rival,
    second: Rival,
    conditions: Conditions,
    *,
    scatter: Scatter | None = None,
    factor: float = 1.0,
    menu: Sequence[Experiment] = MENU,
    draws: int = DRAWS,
    seed: int = SEED,
    progress: Callable[[str, float], None] | None = None,
) -> list[Proposal]:
    """Rank experiments by how far two fitted models differ in them.

    Each experiment is simulated with both. Differences are counted in floors: the expected scatter of the feature and
    of the sensor, and what the two fits leave open (from draws of their parameters).

    Args:
        first, second: the models.
        conditions: what was measured, see `Conditions.of`.
        scatter: shares of realisation scatter.
        factor: on it: 1 where the lines are the same at every event, about 2 where they are new.
        menu: the experiments.
        draws: of each model's parameters; 0 leaves their uncertainty out.
        seed: of the draws.
        progress: told the experiment and the share done.

    Returns:
        One proposal for each experiment, the most telling first.
    """
    rows = _pairwise((first, second), conditions, scatter, factor, menu, draws, seed, progress)
    return sorted((row[0] for row in rows), key=lambda p: -p.separation)


def recommend_among(
    rivals: Sequence[Rival],
    conditions: Conditions,
    *,
    scatter: Scatter | None = None,
    factor: float = 1.0,
    menu: Sequence[Experiment] = MENU,
    draws: int = DRAWS,
    seed: int = SEED,
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """The experiment in which the two models that stay nearest to each other, of two or more, differ most.

    Where none tells all pairs apart it is the one that tells most of them, and the text names those that it leaves.

    Args:
        rivals: the models, at least two.
        conditions, scatter, factor, menu, draws, seed, progress: as of `propose`.

    Returns:
        The ``next_experiment`` of a result: ``text``, ``separates``, ``floors`` of the pair that differs least
        (infinite, no number in a file, where only one of two models slips) and the whole ``menu``.
    """
    if len(rivals) < 2:
        raise ValueError("an experiment separates at least two models")
    tags = [r.tag for r in rivals]
    pairs = list(combinations(tags, 2))
    rows = _pairwise(rivals, conditions, scatter, factor, menu, draws, seed, progress)
    rows = sorted(rows, key=_telling, reverse=True)
    entries = [
        {"experiment": row[0].name, "floors": min(p.separation for p in row), "text": _said(row, pairs)} for row in rows
    ]
    text = entries[0]["text"]
    if not _telling(rows[0])[0]:
        who = f"{tags[0]} from {tags[1]}" if len(tags) == 2 else f"any of {_listed(tags)} from another"
        text = f"no experiment of the menu tells {who}; best is: {max(rows[0], key=lambda p: p.separation).text}"
    return {"text": text, "separates": tags, "floors": entries[0]["floors"], "menu": entries}


def _pairwise(
    rivals: Sequence[Rival],
    conditions: Conditions,
    scatter: Scatter | None,
    factor: float,
    menu: Sequence[Experiment],
    draws: int,
    seed: int,
    progress: Callable[[str, float], None] | None,
) -> list[list[Proposal]]:
    """For each experiment of the menu what it would tell of every pair, in the order of `combinations`."""
    known = Scatter() if scatter is None else scatter
    models = [_Model(r, conditions, draws, seed) for r in rivals]
    rows = []
    for i, experiment in enumerate(menu):
        if progress is not None:
            progress(f"next experiment, {experiment.name}", i / len(menu))
        held = _hold(models, experiment)
        ran = [(rival.tag, model.draws(experiment, held)) for rival, model in zip(rivals, models, strict=True)]
        rows.append(
            [_judged(experiment, (x, y), (a, b), conditions, known, factor) for (a, x), (b, y) in combinations(ran, 2)]
        )
    return rows


def _telling(row: Sequence[Proposal]) -> tuple[int, list[float]]:
    """By which experiments are ranked: how many pairs one tells apart, then the floors, those of the nearest first."""
    floors = sorted(p.separation for p in row)
    return sum(f >= TELLING for f in floors), floors


def _said(row: Sequence[Proposal], pairs: Sequence[tuple[str, str]]) -> str:
    """One sentence for all pairs of an experiment."""
    order = sorted(range(len(row)), key=lambda i: -row[i].separation)
    told = [i for i in order if row[i].separation >= TELLING]
    if len(row) == 1 or not told:
        return row[order[0]].text
    if len(told) == len(row):
        return f"{row[order[-1]].text}; every other pair of them differs more"
    also = [f"{a} from {b}" for a, b in (pairs[i] for i in told[1:])]
    left = [f"{a} from {b}" for a, b in (pairs[i] for i in order[len(told) :])]
    more = f"; it also tells {_listed(also)}" if also else ""
    return f"{row[told[0]].text}{more}; it does not tell {_listed(left, 'or')}"


def _listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    return f" {last} ".join([part for part in (", ".join(words[:-1]), words[-1]) if part])


class _Model:
    """A rival and draws of its parameters; the first is the optimum."""

    def __init__(self, rival: Rival, conditions: Conditions, draws: int, seed: int) -> None:
        if rival.composition is None or rival.fit is None:
            raise ValueError(f"{rival.tag} was not fitted")
        self.composition, self.conditions = rival.composition, conditions
        fit = rival.fit
        bounds = np.array([f.bounds for f in self.composition.free])
        widths = np.array([f.width for f in self.composition.free])
        rng = np.random.default_rng(seed)
        values, vectors = np.linalg.eigh(0.5 * (fit.covariance + fit.covariance.T))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        steps = rng.standard_normal((draws, fit.z.size)) @ root.T
        steps = np.clip(steps, -widths, widths)
        self.z = [fit.z, *(np.clip(fit.z + step, *bounds.T) for step in steps)]

    def draws(self, experiment: Experiment, held: float | None) -> list[_Ran]:
        """The experiment with the optimum and with every draw."""
        return [self.run(experiment, z, held) for z in self.z]

    def run(self, experiment: Experiment, z: np.ndarray, held: float | None) -> _Ran:
        """One run; ``held`` is when the drive stops (s)."""
        v = self.conditions.velocity(experiment)
        model = prepared(self.composition, z, self.conditions, experiment)
        pieces, number, hold = [(1.0, v)], SLIPS, None
        if held is not None:
            pieces, hold = [(held, v), (experiment.hold, 0.0), (1.0, v)], (held, held + experiment.hold)
        elif experiment.first:
            number = 1  # every run begins with a fresh contact
            if experiment.reversed:
                pieces = [(_back(model, v), -v), (1.0, v)]
        try:
            run, slips = until_slips(model, pieces, number)
        except StickslipError as error:
            return _Ran(None, str(error).split("\n")[0])
        if len(slips) < number:
            return _Ran(None, SLIDES)
        found = outcome(run, slips, number - 1, self.conditions.period, hold)
        stick = (slips[number - 2].arrest if number > 1 else 0.0, slips[number - 1].onset)
        return _Ran(found, "", stick)


def _back(model: Any, v: float) -> float:
    """How long to pull the other way (s)."""
    return BACK * estimates(model, v)[0]


def _hold(rivals: Sequence[_Model], experiment: Experiment) -> float | None:
    """When the drive is held (s): the same for all, late in the stick before the third slip."""
    if not experiment.hold:
        return None
    plain = Experiment("as measured", experiment.of, experiment.speed)
    sticks = [r.run(plain, r.z[0], None).stick for r in rivals]
    times = [a + HELD_AT * (b - a) for a, b in sticks if b > 0.0]
    return min(times) if times else None


def _judged(
    experiment: Experiment,
    ran: Sequence[list[_Ran]],
    tags: tuple[str, str],
    conditions: Conditions,
    scatter: Scatter,
    factor: float,
) -> Proposal:
    what = experiment.words(conditions)
    best = [r[0] for r in ran]
    lasts = max((r.outcome.recurrence for r in best if r.outcome is not None), default=0.0)
    if lasts > LONGEST:
        text = f"{what}: a cycle would last {lasts:.3g} s, and a diagnosis takes in no more than {LONGEST:.3g} s"
        return Proposal(experiment.name, 0.0, "", text, {})
    if any(r.outcome is None for r in best):
        return _without(experiment, ran, tags, what)
    a, b = (r.outcome for r in best)
    assert a is not None
    assert b is not None
    differences = {}
    for name in FEATURES:
        x, y = getattr(a, name), getattr(b, name)
        if not (math.isfinite(x) and math.isfinite(y)):
            continue
        floor = math.hypot(
            floor_of(name, a, b, experiment, conditions, scatter, factor), *(_open(name, r) for r in ran)
        )
        differences[name] = Difference(x, y, abs(x - y) / floor if floor > 0.0 else math.inf)
    if not differences:
        return Proposal(experiment.name, 0.0, "", f"{what}: nothing can be compared", {})
    feature = max(differences, key=lambda n: differences[n].floors)
    d = differences[feature]
    words, unit, more, less = _WORDS[feature]
    if feature == "recurrence":
        after = "the first slip after it comes" if experiment.hold else words
        words = "the first slip comes" if experiment.first else after
    elif experiment.first:
        words = words.replace("the slip", "the first slip")
    gap = d.first - d.second
    text = (
        f"{what}: {words} {quantity(abs(gap), unit)} {more if gap > 0 else less} with {tags[0]} than with {tags[1]}, "
        f"{d.floors:.2g} times the scatter"
    )
    return Proposal(experiment.name, d.floors, feature, text, differences)


def _without(experiment: Experiment, ran: Sequence[list[_Ran]], tags: tuple[str, str], what: str) -> Proposal:
    """An experiment in which a model does not slip, or cannot be run."""
    best = {tag: r[0] for tag, r in zip(tags, ran, strict=True)}
    broken = [(tag, r.why) for tag, r in best.items() if r.outcome is None and r.why != SLIDES]
    if broken:
        text = f"{what}: {broken[0][0]} could not be simulated ({broken[0][1]})"
        return Proposal(experiment.name, 0.0, "", text, {})
    slides = [tag for tag, r in best.items() if r.outcome is None]
    if len(slides) == 2:
        text = f"{what}: the block slides steadily with both, which tells little"
        return Proposal(experiment.name, 0.0, "", text, {})
    slips = next(tag for tag in tags if tag not in slides)
    text = f"{what}: the block slips with {slips} and slides steadily with {slides[0]}"
    if any((r.why == SLIDES) != (rows[0].why == SLIDES) for rows in ran for r in rows):
        text = f"{text}, though not for all parameters that the fits leave open"
        return Proposal(experiment.name, 1.0, "slips", text, {})
    return Proposal(experiment.name, math.inf, "slips", text, {})


def _open(name: str, ran: Sequence[_Ran]) -> float:
    """What the fit leaves open: standard deviation over the draws (SI), about the optimum."""
    values = [getattr(r.outcome, name) for r in ran if r.outcome is not None]
    rest = [v - values[0] for v in values[1:] if math.isfinite(v)]
    return math.sqrt(sum(v * v for v in rest) / len(rest)) if rest else 0.0
