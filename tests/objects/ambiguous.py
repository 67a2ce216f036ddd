"""Does the experiment that is proposed decide? Campaigns of the independent simulator that leave a set of effects.

    python -m tests.objects.ambiguous FOLDER [--number 24]

A campaign of two short runs hides one effect, and is diagnosed among this and those that the catalogue says it is
confused with. Where that ends with a set that holds it, the first proposed experiment that changes nothing but the
drive is made on the same rig by the simulator, and the campaign with this run is diagnosed again among the set. Effects
that only shape the backbone are left out. FOLDER keeps what is finished, and the same command goes on from there.
Writes docs/results/ambiguous.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from stickslip.errors import InputError
from stickslip.inference.force.candidates import every_form
from stickslip.objects import next_experiment
from stickslip.objects.diagnosis import Diagnosis
from stickslip.objects.experiments import Setting
from stickslip.objects.experiments.setting import settled
from stickslip.physics.effects import catalogue
from tests.diagnose.development import hidden, visible
from tests.kept_cases import each
from tests.kept_results import keep

RUNS = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 4))
MULTIPLE = 3.0  # of detection in a whole campaign
SEED = 7100
LONGEST = 30.0  # s of an experiment; the simulator takes every spring through every step


def one(folder: Path, number: int) -> dict[str, Any]:
    """A campaign, its set, the experiment, and what is said after it."""
    tags = [tag for tag in visible() if every_form([tag])]
    law = hidden(tags[number % len(tags)], 1.0 if number // len(tags) % 2 == 0 else -1.0, MULTIPLE)
    among = [law.tag, *catalogue.get(law.tag).confused_with]
    made: dict[str, Any] = {"hidden": law.tag, "seed": SEED + number, "among": among}

    def campaign(name: str, *runs: Run) -> ss.Campaign:
        case = folder / f"{number:03d}-{name}"
        if not (case / "campaign.toml").is_file():
            own = [(law.tag, law.amplitude, law.form)]
            make_campaign(case, SEED + number, own, runs=(*RUNS, *runs), spring_known=True, grouped=False)
        return ss.load_campaign(case / "campaign.toml")

    try:
        first = campaign("before").diagnose(jobs=1, max_effects=1, candidates=among, progress=silent)
    except InputError as error:
        return {**made, "before": "not made", "note": error.what}
    made |= {"before": first.verdict["kind"], "set": list(first.verdict["set"])}
    if made["before"] != "ambiguous" or law.tag not in made["set"]:
        return made
    words, run = proposed(first)
    made["experiment"] = words
    if run is None:
        return made
    try:
        then = campaign("after", run).diagnose(jobs=1, max_effects=1, candidates=made["set"], progress=silent)
    except InputError as error:
        return {**made, "after": "not made", "note": error.what}
    left = list(then.verdict["set"] or then.verdict["effects"])
    return {**made, "after": then.verdict["kind"], "left": left}


def silent(text: str, share: float) -> None:
    """Nobody is told."""


def proposed(found: Diagnosis) -> tuple[str, Run | None]:
    """The first experiment that only another drive makes, in words and for the simulator; none where there is none."""
    assert found.found is not None
    done = next((done for done in found.found.named.values() if len(done.close) > 1), None)
    if done is None:  # a wrong entry of the rig does as well, and nothing is named
        return "", None
    judged = done.close[0]
    model = next_experiment._fit(found.campaign, found.found, done, judged.tag, judged.candidate.fit)
    options = next_experiment._options(model)
    for words, row in found.experiments.iterrows():
        setting: Setting = options[str(words)]
        if row["note"] or row["margin"] < np.log(2.0) or setting.spring or setting.mass or setting.load:
            continue
        speed = float(setting.velocity.split()[0])
        pieces = settled(model, setting).pieces
        if not pieces:
            return str(words), Run("proposed", speed, 5)
        until = np.cumsum([length for _, length in pieces])
        if until[-1] <= LONGEST:
            ends = zip(until.tolist(), (v for v, _ in pieces), strict=True)
            return str(words), Run("proposed", speed, pieces=tuple((round(t, 3), v) for t, v in ends))
    return "", None


def tally(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """How many campaigns left a set with the truth in it, and in how many of them the experiment left that alone."""
    sets = [c for c in cases if "after" in c and c["after"] != "not made"]
    alone = [c for c in sets if c["left"] == [c["hidden"]]]
    kept = [c for c in sets if c["hidden"] in c["left"]]
    return {
        "campaigns": len(cases),
        "ambiguous": sum(c["before"] == "ambiguous" for c in cases),
        "made": len(sets),
        "alone": len(alone),
        "kept": len(kept),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--number", type=int, default=24)
    options = parser.parse_args()
    cases = []
    numbers = (f"{number:03d}" for number in range(options.number))
    for number, case in each(options.folder, numbers, lambda number: one(options.folder, int(number))):
        cases.append(case)
        print(number, case, flush=True)
    keep("ambiguous", f"python -m tests.objects.ambiguous FOLDER --number {len(cases)}", **tally(cases), cases=cases)
    print(tally(cases))


if __name__ == "__main__":
    main()
