"""Score of a sealed challenge for docs/challenge.md, of the cases that were run.

    python docs/make_challenge.py FOLDER --seal DIGEST

FOLDER is that of ``stickslip challenge run``; DIGEST is the seal as it was published before. Writes
docs/results/sealed.json.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip.blind.answers import read_answer
from stickslip.blind.case_scores import mark
from stickslip.blind.figures import figures
from stickslip.blind.score import score_challenge
from stickslip.blind.seal import RUNS, read_truth
from tests.kept_results import keep

KEPT = ("cases", "by_kind", "false_alarms", "unknown_recall", "amplitude", "by_amplitude", "aims", "confusion")
LINE = ("kind", "hidden", "answer", "named", "set", "right", "exact", "heldout_base", "heldout_final")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seal", required=True)
    options = parser.parse_args()
    whole = score_challenge(options.folder, expected=options.seal)
    answers = [(case, read_answer(options.folder / RUNS, case["name"])) for case in read_truth(options.folder)["cases"]]
    found = figures([mark(case, answer, 0) for case, answer in answers if answer.kind != "not run"])
    keep(
        "sealed", "python docs/make_challenge.py FOLDER --seal DIGEST", seed=whole["seed"], seal=whole["seal"],
        made=whole["cases"], failed=whole["failed"], **{key: found[key] for key in KEPT},
        list=[{key: line[key] for key in LINE} for line in found["list"]],
    )  # fmt: skip
    print(f"{found['cases']} of {whole['cases']} cases")


if __name__ == "__main__":
    main()
