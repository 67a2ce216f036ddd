"""How often a diagnosis is right on campaigns of the independent simulator: what docs/diagnosis tabulates.

``python -m tests.diagnose.development FOLDER PART --seed S`` makes the campaigns of a part, diagnoses each (going on
where it was stopped), and prints the answers as a table and the rate. Parts: ``one`` (every effect that can be seen,
once with the same lines at every event and once with new ones), ``nothing``, ``two``, ``left-out`` (as ``one``
with the same lines, but the effect and laws that contain it are not in the catalogue that is tried), and ``strong``
(as ``one`` with the same lines, at the largest amplitude that is plausible, where that is more). All of a part take
days: ``--only 3 1`` diagnoses these.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.challenge.answers import Answer, is_exact, is_right, read_answer
from stickslip.challenge.detection import amplitude, largest_multiple, visible_forms
from stickslip.challenge.generator import CATALOGUED, EFFECTS
from stickslip.challenge.make import make_challenge
from stickslip.challenge.mix import Case, Hidden, case_seed
from stickslip.challenge.run import Progress, run_challenge
from stickslip.challenge.seal import RUNS, read_seal, read_truth
from stickslip.runstore import read_result
from stickslip.workflow import diagnose_campaign

MULTIPLE = 10.0  # of detection, or the largest at which the block slips
VELOCITIES, HOLDS = (5e-5, 1e-4, 2e-4, 4e-4), (1.0, 5.0)  # m/s, s
PARTS = {"one": "one", "nothing": "nothing", "two": "two", "left-out": "outside", "strong": "one"}


def visible() -> list[str]:
    """Effects of the catalogue that can be seen in their textbook form."""
    return [tag for tag in CATALOGUED if not EFFECTS[tag].decoy and _textbook(tag)]


def _textbook(tag: str) -> list[str]:
    return [form.name for form in visible_forms(EFFECTS[tag]) if not form.own]


def largest(tag: str) -> float:
    """The largest plausible multiple of detection of an effect in its first textbook form."""
    return largest_multiple(EFFECTS[tag], _textbook(tag)[0])


def hidden(tag: str, sign: float, multiple: float = MULTIPLE) -> Hidden:
    """An effect in its first textbook form at a multiple of detection, or the largest plausible one if that is less."""
    form = _textbook(tag)[0]
    multiple = min(multiple, largest(tag))
    return Hidden(tag, multiple, amplitude(EFFECTS[tag], form, multiple, sign), form)


def cases(part: str, seed: int, number: int) -> list[Case]:
    """The campaigns of a part; those with nothing or two effects as many as ``number``."""
    rng = np.random.default_rng([seed, list(PARTS).index(part)])
    sets: Iterator[tuple[tuple[str, ...], bool]]
    if part == "nothing":
        sets = (((), bool(i % 2)) for i in range(number))
    elif part == "two":
        pairs = [rng.choice(visible(), 2, replace=False) for _ in range(number)]
        sets = ((tuple(str(t) for t in pair), bool(i % 2)) for i, pair in enumerate(pairs))
    elif part == "strong":
        sets = (((tag,), False) for tag in visible() if largest(tag) > MULTIPLE)
    else:
        sets = (((tag,), new) for tag in visible() for new in ((False,) if part == "left-out" else (False, True)))
    made = []
    for i, (tags, new_lines) in enumerate(sets, start=1):
        multiple = np.inf if part == "strong" else MULTIPLE
        effects = tuple(hidden(tag, 1.0 if rng.random() < 0.5 else -1.0, multiple) for tag in tags)
        spring_known, virgin = part != "nothing" or bool(i // 2 % 2), bool(rng.random() < 0.5)
        made.append(
            Case(
                f"case-{i:03d}", PARTS[part], effects, spring_known, virgin, new_lines, VELOCITIES, HOLDS, "plain",
                case_seed(seed, i),
            )
        )  # fmt: skip
    return made


@dataclass(frozen=True)
class LeftOut:
    """Diagnosis without the hidden effect of each case."""

    hidden: dict[str, str]

    def __call__(self, campaign: Path, out: Path) -> Any:
        from stickslip.effects import catalogue

        tag = self.hidden[campaign.parent.name]
        tried = [t for t, cls in catalogue.all().items() if t != tag and tag not in cls.generalises]
        return diagnose_campaign(campaign, out, jobs=1, candidates=tried)


@dataclass(frozen=True)
class Tally:
    """How many campaigns of a part were answered, and how.

    Attributes:
        answered: how many.
        exact: the answer is the truth. right: or a set of at most three that holds it.
        table: every answer, a row each (Markdown).
        shown: in how many the base model alone is not within its limits, so that an effect was looked for.
        shown_exact, shown_right: of these.
        passed_by: of these, in how many something hidden was scored and not refitted.
    """

    answered: int
    exact: int
    right: int
    table: str
    shown: int
    shown_exact: int
    shown_right: int
    passed_by: int


def tally(folder: Path) -> Tally:
    """The answers so far."""
    rows = ["| hidden | lines | times detection | looked for | said | unseen error |", "|---|---|---|---|---|---|"]
    answers: list[tuple[bool, bool, bool, bool]] = []
    for truth in read_truth(folder)["cases"]:
        answer = read_answer(folder / RUNS, truth["name"])
        if answer.kind == "not run":
            continue
        tags = tuple(e["tag"] for e in truth["effects"])
        ranking = read_result(folder / RUNS / truth["name"])["ranking"] if answer.kind != "failed" else []
        refitted = {r["effect"] for r in ranking if r["refit"]}
        passed_by = bool({r["effect"] for r in ranking if r["effect"] in tags} - refitted)
        right = is_exact(truth["kind"], tags, answer), is_right(truth["kind"], tags, answer)
        answers.append((bool(ranking), *right, passed_by))
        times = ", ".join(f"{e['multiple']:.3g}" for e in truth["effects"])
        lines = "new" if truth["new_lines"] else "same"
        rows.append(
            f"| {', '.join(tags) or 'nothing'} | {lines} | {times} | {'yes' if ranking else 'no'}"
            f"{', not refitted' if passed_by else ''} | {_said(answer)} | {_errors(answer)} |"
        )
    exact, right = (sum(a[i] for a in answers) for i in (1, 2))
    return Tally(len(answers), exact, right, "\n".join(rows), *(sum(a[0] and a[i] for a in answers) for i in range(4)))


def _said(answer: Answer) -> str:
    return f"`{answer.kind}` {', '.join(answer.set or answer.named)}".strip()


def _errors(answer: Answer) -> str:
    return " -> ".join(f"{e:.2f}" for e in (answer.base, answer.final) if e is not None)


def tell(p: Progress) -> None:
    """One line for a finished case."""
    print(
        f"{p.done}/{p.total} {p.case} {p.state}: {p.message} ({p.seconds:.0f} s, {p.left / 60:.0f} min left)",
        flush=True,
    )


def measure(
    folder: Path,
    part: str,
    seed: int,
    number: int = 100,
    workers: int | None = None,
    only: Sequence[int] | None = None,
) -> Tally:
    """Make the campaigns of a part in a folder, unless they are there, and diagnose those that are not yet.

    ``only`` are the numbers of campaigns to diagnose, in this order; default all.
    """
    if not folder.exists():
        own = cases(part, seed, number)
        print("seal", make_challenge(folder, seed=seed, own=own, grouped=True))
    read_seal(folder)
    diagnosis = None
    if part == "left-out":
        diagnosis = LeftOut({case["name"]: case["effects"][0]["tag"] for case in read_truth(folder)["cases"]})
    names = None if only is None else [f"case-{i:03d}" for i in only]
    run_challenge(folder, workers=workers, only=names, diagnosis=diagnosis, tell=tell)
    return tally(folder)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=100)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of campaigns, from 1")
    options = parser.parse_args()
    found = measure(options.folder, options.part, options.seed, options.number, options.workers, options.only)
    print(found.table)
    print(f"\n{found.answered} answered: {found.exact} exact, {found.right} right")
    print(
        f"{found.shown} in which something was looked for: {found.shown_exact} exact, {found.shown_right} right, "
        f"{found.passed_by} with something hidden that was not refitted"
    )


if __name__ == "__main__":
    main()
