"""The score of a challenge: how often the diagnosis was right, and how sure one can be of that."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .answers import read_answer
from .case_scores import mark
from .figures import figures
from .one_case import failures
from .run import PROTOCOL, codes_of, read_protocol
from .seal import RUNS, SealError, case_hashes, case_names, check_seal, digest, read_truth


def score_challenge(folder: str | Path, *, expected: str | None = None) -> dict[str, Any]:
    """Score a challenge. A case that failed or was not run counts as answered wrongly.

    Args:
        folder: of the challenge.
        expected: digest of the seal as it was published.

    Returns:
        Plain numbers and texts, ready for JSON.

    Raises:
        SealError: truth, campaigns or seal are not what was sealed, or were not when the cases were run.
        InputError: no challenge, or nothing was run.
    """
    folder = Path(folder).resolve()
    seal = check_seal(folder, expected=expected)
    protocol = read_protocol(folder / RUNS)
    if protocol["seal"] != digest(folder):
        raise SealError("the cases were run under another seal", file=folder / RUNS / PROTOCOL)
    truth = read_truth(folder)
    cases = {case["name"]: case for case in truth["cases"]}
    if sorted(cases) != case_names(seal):
        raise SealError("truth and campaigns are not of the same challenge", file=folder)
    marked = []
    for name in sorted(cases):
        answer = read_answer(folder / RUNS, name)
        if answer.kind not in ("failed", "not run") and answer.hashes != case_hashes(seal, name):
            what = "the result is of other files than those that were sealed"
            raise SealError(what, file=folder / RUNS / name, hint="remove this folder and run the challenge again")
        marked.append(mark(cases[name], answer, len(failures(folder / RUNS, name))))
    protocol["codes"] = codes_of(folder / RUNS, protocol, sorted(cases))
    head = {"schema": 1, "seed": truth["seed"], "seal": digest(folder), "protocol": protocol}
    return {**head, **figures(marked)}
