"""The score of a challenge: how often the diagnosis was right, and how sure one can be of that."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..system.runstore import file_record
from .answers import Answer, read_answer
from .case_scores import mark
from .figures import figures
from .one_case import failures
from .own_answers import read_answers
from .run import PROTOCOL, codes_of, read_protocol
from .seal import RUNS, SealError, case_hashes, case_names, check_seal, digest, read_truth


def score_challenge(
    folder: str | Path, *, answers: str | Path | Mapping[str, Any] | None = None, expected: str | None = None
) -> dict[str, Any]:
    """Score a challenge. A case that failed, was not run or is not answered counts as answered wrongly.

    Args:
        folder: of the challenge.
        answers: of another method, in place of those that the run of the challenge gave: a file, or a mapping such as
            ``{"case-001": {"kind": "missing", "effects": ["tilt"]}}``; see
            :class:`~stickslip.blind.own_answers.OwnAnswer` for what may be said of a case.
        expected: digest of the seal as it was published.

    Returns:
        Plain numbers and texts, ready for JSON.

    Raises:
        SealError: truth, campaigns or seal are not what was sealed, or were not when the cases were run.
        InputError: no challenge, or nothing was run; answers that cannot be read.
    """
    folder = Path(folder).resolve()
    seal = check_seal(folder, expected=expected)
    names = case_names(seal)
    source: dict[str, Any]
    if answers is None:
        found, protocol = _of_the_run(folder, seal)
        source = {"protocol": protocol}
    else:
        found = {name: (answer, 0) for name, answer in read_answers(answers, names).items()}
        source = {"answers": None if isinstance(answers, Mapping) else file_record(answers)}
    truth = read_truth(folder)
    cases = {case["name"]: case for case in truth["cases"]}
    if sorted(cases) != names:
        raise SealError("truth and campaigns are not of the same challenge", file=folder)
    marked = [mark(cases[name], *found[name]) for name in names]
    return {"schema": 1, "seed": truth["seed"], "seal": digest(folder), **source, **figures(marked)}


def _of_the_run(folder: Path, seal: dict[str, Any]) -> tuple[dict[str, tuple[Answer, int]], dict[str, Any]]:
    """Answers and failed attempts of the challenge's run, and its protocol."""
    runs, names = folder / RUNS, case_names(seal)
    protocol = read_protocol(runs)
    if protocol["seal"] != digest(folder):
        raise SealError("the cases were run under another seal", file=runs / PROTOCOL)
    found = {}
    for name in names:
        answer = read_answer(runs, name)
        if answer.kind not in ("failed", "not run") and answer.hashes != case_hashes(seal, name):
            what = "the result is of other files than those that were sealed"
            raise SealError(what, file=runs / name, hint="remove this folder and run the challenge again")
        found[name] = answer, len(failures(runs, name))
    protocol["codes"] = codes_of(runs, protocol, names)
    return found, protocol
