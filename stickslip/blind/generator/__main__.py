"""``python -m stickslip.blind.generator FOLDER --effect contact-ageing --seed 3``: one campaign, for developers."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from stickslip.errors import StickslipError

from .campaigns import make_campaign
from .forms import EFFECTS
from .recorder import RECORDERS


def main(arguments: list[str] | None = None) -> int:
    """Write one campaign; the truth goes to standard output, or to ``--truth``."""
    parser = argparse.ArgumentParser(prog="python -m stickslip.blind.generator", description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--effect",
        action="append",
        type=effect,
        default=[],
        metavar="TAG[=AMPLITUDE][:FORM]",
        help=f"one of: {', '.join(EFFECTS)}",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--new-lines", action="store_true", help="new rough lines after every slip")
    parser.add_argument("--not-virgin", action="store_true", help="records start after two slips")
    parser.add_argument("--spring", choices=("known", "unknown"), help="default: drawn")
    parser.add_argument("--recorder", choices=RECORDERS, default="plain", help="what happens to the counts")
    parser.add_argument("--every-spring", action="store_true", help="no groups of springs; takes ten times as long")
    parser.add_argument("--dt", type=float, default=2e-5, help="small step, s")
    parser.add_argument("--truth", type=Path, help="where to write the truth (kept apart from the campaign)")
    given = parser.parse_args(arguments)
    try:
        truth = make_campaign(
            given.folder,
            given.seed,
            given.effect,
            new_lines=given.new_lines,
            virgin=not given.not_virgin,
            spring_known=None if given.spring is None else given.spring == "known",
            dt=given.dt,
            recorder=given.recorder,
            grouped=not given.every_spring,
        )
    except StickslipError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    text = json.dumps(truth, indent=1)
    if given.truth:
        given.truth.write_text(text, encoding="utf-8")
    else:
        print(text)
    return 0


def effect(text: str) -> tuple[str, float | None] | tuple[str, float | None, str]:
    """``TAG[=AMPLITUDE][:FORM]`` as :func:`make_campaign` takes it."""
    text, _, form = text.partition(":")
    tag, _, number = text.partition("=")
    amplitude = float(number) if number else None
    return (tag, amplitude, form) if form else (tag, amplitude)


if __name__ == "__main__":
    sys.exit(main())
