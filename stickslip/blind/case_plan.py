"""What a challenge consists of: which cases hide what, and what the user of each would know and have measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError
from .detection import amplitude, draw_multiple, visible_forms

if TYPE_CHECKING:
    from .generator import Run

MIX = {"nothing": 0.30, "one": 0.45, "two": 0.15, "outside": 0.10}
VELOCITIES = (
    (5e-5, 1e-4, 2e-4),
    (6e-5, 1.5e-4, 4e-4),
    (5e-5, 1e-4, 2e-4, 4e-4),
    (7e-5, 1.2e-4, 2e-4, 3.5e-4),
    (5e-5, 8e-5, 1.3e-4, 2.2e-4, 3.6e-4),
)
HOLDS = ((1.0, 5.0), (0.5, 3.0), (2.0, 8.0), (1.0, 3.0, 6.0))  # s
STRETCHES = (430e-6, 230e-6, 230e-6, 260e-6)  # m driven before, between and after holds
EVENTS = 7
DEALT_RECORDERS = ("wrap", "cleared", "drop-outs", *("plain",) * 7)  # of ten cases


@dataclass(frozen=True)
class Hidden:
    """One hidden effect: its amplitude (unit of the generator), that in multiples of detection, and its form."""

    tag: str
    multiple: float
    amplitude: float
    form: str


@dataclass(frozen=True)
class Case:
    """One case of a challenge before it is made.

    Attributes:
        name: also of its folder; says nothing of what is hidden.
        kind: ``nothing``, ``one``, ``two`` or ``outside`` (an effect that no catalogue lists).
        hidden: the effects.
        spring_known, virgin, new_lines: whether the file gives the spring's stiffness, the runs start from a contact
            never loaded, and the rough lines are new after every slip.
        velocities: of the steady runs, m/s. holds: of the run with holds, s.
        recorder: what happens to the counts: ``plain``, ``wrap``, ``cleared`` or ``drop-outs``.
        seed: of rig, lines and noise.
    """

    name: str
    kind: str
    hidden: tuple[Hidden, ...]
    spring_known: bool
    virgin: bool
    new_lines: bool
    velocities: tuple[float, ...]
    holds: tuple[float, ...]
    recorder: str
    seed: int

    def runs(self) -> tuple[Run, ...]:
        """The runs to be made: one for each velocity and one with holds."""
        from .generator import Run

        steady = [Run(f"v{round(v * 1e6):03d}", v, events=EVENTS) for v in self.velocities]
        speed = min(self.velocities, key=lambda v: abs(v - 1e-4))
        pieces, until = [], 0.0
        stretches = [*STRETCHES[: len(self.holds)], STRETCHES[-1]]
        for stretch, hold in zip(stretches, [*self.holds, 0.0], strict=True):
            until = round(until + stretch / speed, 3)
            pieces.append((until, speed))
            if hold:
                until = round(until + hold, 3)
                pieces.append((until, 0.0))
        return (*steady, Run("holds", speed, pieces=tuple(pieces)))

    def weaker(self) -> Case:
        """The same with every effect half as large, but not below detection."""
        return replace(self, hidden=tuple(_half(h) for h in self.hidden))

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def _half(h: Hidden) -> Hidden:
    multiple = max(1.0, h.multiple / 2)
    return replace(h, multiple=multiple, amplitude=h.amplitude * multiple / h.multiple)


def counts(cases: int) -> dict[str, int]:
    """How many cases of each kind; the largest remainders are rounded up."""
    exact = {kind: share * cases for kind, share in MIX.items()}
    found = {kind: math.floor(x + 1e-9) for kind, x in exact.items()}
    short = sorted(MIX, key=lambda kind: found[kind] - exact[kind])[: cases - sum(found.values())]
    return {kind: n + (kind in short) for kind, n in found.items()}


def plan(cases: int, seed: int) -> list[Case]:
    """All cases of a challenge; the same for the same number and seed.

    Effects are dealt like cards, so that each comes up about as often; forms that are not the textbook's in every
    other case that has a choice; each of the three circumstances in half of the cases, and of every kind as near to
    half as can be.

    Args:
        cases: how many.
        seed: fixes them all; not negative.

    Raises:
        ArgumentError: fewer than one case, or a negative seed.
    """
    from .generator import CATALOGUED, EFFECTS, OUTSIDE

    if cases < 1:
        raise ArgumentError("a challenge needs cases", key="cases", value=cases, allowed="1 or more")
    if seed < 0:
        raise ArgumentError("a seed is not negative", key="seed", value=seed, allowed="0 or more")
    rng = np.random.default_rng([seed, 0])
    known = tuple(tag for tag in CATALOGUED if not EFFECTS[tag].decoy and visible_forms(EFFECTS[tag]))
    decks = {"one": _deal(known, rng), "two": _deal(known, rng), "outside": _deal(OUTSIDE, rng)}
    circumstances = _circumstances(rng)
    own = _alternate(rng)
    recorders = _deal(DEALT_RECORDERS, np.random.default_rng([seed, 1]))
    out = []
    for kind, number in counts(cases).items():
        for _ in range(number):
            tags: list[str] = [] if kind == "nothing" else [next(decks[kind])]
            if kind == "two":
                tags.append(next(tag for tag in decks[kind] if tag != tags[0]))
            spring_known, virgin, new_lines = next(circumstances)
            out.append(
                Case(
                    "", kind, tuple(_hidden(tag, rng, own) for tag in tags), spring_known, virgin, new_lines,
                    VELOCITIES[int(rng.integers(len(VELOCITIES)))], HOLDS[int(rng.integers(len(HOLDS)))],
                    next(recorders), 0,
                )
            )  # fmt: skip
    digits = max(3, len(str(cases)))
    order = rng.permutation(cases)
    return [replace(out[j], name=f"case-{i:0{digits}d}", seed=case_seed(seed, i)) for i, j in enumerate(order, start=1)]


def case_seed(seed: int, number: int, attempt: int = 0) -> int:
    """Seed of rig, lines and noise of one case."""
    return int(np.random.SeedSequence([seed, number, attempt]).generate_state(1)[0])


def _hidden(tag: str, rng: np.random.Generator, own: Iterator[bool]) -> Hidden:
    from .generator import EFFECTS

    effect = EFFECTS[tag]
    seen = visible_forms(effect)
    wanted = next(own) if len({form.own for form in seen}) == 2 else seen[0].own
    forms = [form.name for form in seen if form.own == wanted]
    form = forms[int(rng.integers(len(forms)))]
    multiple = draw_multiple(effect, form, rng)
    return Hidden(tag, multiple, amplitude(effect, form, multiple, -1.0 if rng.random() < 0.5 else 1.0), form)


def _deal(cards: Sequence[str], rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield from (cards[i] for i in rng.permutation(len(cards)))


def _alternate(rng: np.random.Generator) -> Iterator[bool]:
    state = bool(rng.random() < 0.5)
    while True:
        yield state
        state = not state


def _circumstances(rng: np.random.Generator) -> Iterator[tuple[bool, ...]]:
    """All eight combinations of three, each followed by its opposite, in a new order every time."""
    firsts = [c for c in product((False, True), repeat=3) if c[0]]
    while True:
        for i in rng.permutation(len(firsts)):
            pair = (firsts[i], tuple(not x for x in firsts[i]))
            yield from pair if rng.random() < 0.5 else reversed(pair)
