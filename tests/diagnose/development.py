"""How often a diagnosis is right on campaigns of the independent simulator: what docs/diagnosis tabulates.

``python -m tests.diagnose.development FOLDER PART --seed S`` makes the campaigns of a part, diagnoses each (going on
where it was stopped), prints the answers as a table with their rates, and writes them to
``docs/results/development.json``, from which the page draws its tables. Parts: ``one`` (every effect that can be seen,
once with the same lines at every event and once with new ones), ``nothing``, ``two``, ``left-out`` (as ``one``
with the same lines, but the effect and laws that contain it are not in the catalogue that is tried), and ``strong``
(as ``one`` with the same lines, at the largest amplitude that is plausible, where that is more). A campaign takes
some minutes of one processor: ``--only 3 1`` diagnoses these. Every spring is simulated by itself: springs joined by
their thresholds leave a misfit that a second effect would be named for.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.blind.answers import read_answer
from stickslip.blind.case_plan import Case, Hidden, case_seed
from stickslip.blind.case_scores import mark, rate
from stickslip.blind.detection import amplitude, largest_multiple, visible_forms
from stickslip.blind.generator import CATALOGUED, EFFECTS
from stickslip.blind.make import make_challenge
from stickslip.blind.run import Progress, run_challenge
from stickslip.blind.seal import RUNS, read_seal, read_truth
from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.objects.diagnosis import diagnose_campaign
from stickslip.physics.effects import catalogue
from tests.kept_results import keep

IDENTIFIABLE = float(np.log(20.0))  # likelihood ratio of twenty
NUMBER = 100  # campaigns of a part
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
        tag = self.hidden[campaign.parent.name]
        tried = [t for t, cls in catalogue.all().items() if t != tag and tag not in cls.generalises]
        return diagnose_campaign(campaign, out, jobs=1, candidates=tried)


def margin(result: dict[str, Any], tag: str) -> float | None:
    """By how much the hidden effect's best fit is more likely than that of any rival, or of the base (log-likelihood).

    Each at its best parameters; in units in which chance spreads as it should (the cost over its dispersion). None
    where the hidden effect was not tried.
    """
    gains = {row["effect"]: float(row.get("gain") or 0.0) for row in reversed(result.get("ranking") or ())}
    if tag not in gains:
        return None
    containing = {t for t, cls in catalogue.all().items() if tag in cls.generalises}
    rivals = [gain for other, gain in gains.items() if other != tag and other not in containing]
    return 0.5 * (gains[tag] - max([*rivals, 0.0])) / DISPERSION


def tally(folder: Path, seed: int) -> dict[str, Any]:
    """The answers so far, with their rates (Wilson's intervals at 95 %)."""
    marked = [mark(truth, read_answer(folder / RUNS, truth["name"])) for truth in read_truth(folder)["cases"]]
    marked = [m for m in marked if m.answer.kind != "not run"]
    margins = {m.name: _margin(folder, m) for m in marked}
    identifiable = [m for m in marked if (margins[m.name] or 0.0) > IDENTIFIABLE]
    hidden = [m for m in marked if m.tags]
    sizes = [s for m in hidden for s in m.sizes]
    return {
        "seed": seed,
        "rates": {
            "exact": rate(m.exact for m in marked),
            "right": rate(m.right for m in marked),
            "something wrong named": rate(not set(m.answer.named) <= set(m.tags) for m in marked),
            "identifiable": rate((margins[m.name] or 0.0) > IDENTIFIABLE for m in marked if len(m.tags) == 1),
            "exact where identifiable": rate(m.exact for m in identifiable),
            "right where identifiable": rate(m.right for m in identifiable),
            "complete": rate(m.answer.kind == "complete" for m in marked),
            "amplitude within two deviations": rate(bool(s.within(2.0)) for s in sizes if s.std is not None),
        },
        "cases": [
            {
                "hidden": list(m.tags),
                "multiples": [e["multiple"] for e in m.effects],
                "lines": "new" if m.circumstances["new_lines"] else "same",
                "kind": m.answer.kind,
                "named": list(m.answer.named),
                "set": list(m.answer.set),
                "margin": margins[m.name],
                "unseen": [m.answer.base, m.answer.final],
                "seconds": m.answer.seconds,
            }
            for m in marked
        ],
    }


def _margin(folder: Path, m: Any) -> float | None:
    path = folder / RUNS / m.name / "result.json"
    if len(m.tags) != 1 or not path.is_file():
        return None
    return margin(json.loads(path.read_text(encoding="utf-8")), m.tags[0])


def table(found: dict[str, Any]) -> str:
    """Every answer, a row each (Markdown)."""
    rows = ["| hidden | lines | times detection | margin | said | unseen error |", "|---|---|---|---|---|---|"]
    for case in found["cases"]:
        times = ", ".join(f"{m:.3g}" for m in case["multiples"])
        far = "" if case["margin"] is None else f"{case['margin']:.3g}"
        said = f"`{case['kind']}` {', '.join(case['set'] or case['named'])}".strip()
        errors = " -> ".join(f"{e:.2f}" for e in case["unseen"] if e is not None)
        rows.append(
            f"| {', '.join(case['hidden']) or 'nothing'} | {case['lines']} | {times} | {far} | {said} | {errors} |"
        )
    return "\n".join(rows)


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
    number: int = NUMBER,
    workers: int | None = None,
    only: Sequence[int] | None = None,
) -> dict[str, Any]:
    """Make the campaigns of a part in a folder, unless they are there, and diagnose those that are not yet.

    ``only`` are the numbers of campaigns to diagnose, in this order; default all.
    """
    if not folder.exists():
        own = cases(part, seed, number)
        print("seal", make_challenge(folder, seed=seed, own=own))
    read_seal(folder)
    diagnosis = None
    if part == "left-out":
        diagnosis = LeftOut({case["name"]: case["effects"][0]["tag"] for case in read_truth(folder)["cases"]})
    names = None if only is None else [f"case-{i:03d}" for i in only]
    run_challenge(folder, workers=workers, only=names, diagnosis=diagnosis, tell=tell)
    return tally(folder, seed)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=NUMBER)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of campaigns, from 1")
    options = parser.parse_args()
    found = measure(options.folder, options.part, options.seed, options.number, options.workers, options.only)
    print(table(found))
    for name, r in found["rates"].items():
        print(f"{name}: {r['count']} of {r['of']}" + (f" ({r['low']:.0%} to {r['high']:.0%})" if r["of"] else ""))
    given = ["--seed", options.seed]
    given += ["--number", options.number] if options.number != NUMBER else []
    given += ["--only", *options.only] if options.only else []
    command = " ".join(["python -m tests.diagnose.development FOLDER", options.part, *map(str, given)])
    keep("development", command, options.part, **found)


if __name__ == "__main__":
    main()
