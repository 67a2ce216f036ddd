"""Write docs/results/real_data.json and its pictures, from which docs/real-data.md takes every number.

The numbers are the program's, run on measured records; the modules of docs/real_data say how.

    python docs/make_real_data.py [FOLDER] [--only PART ...]

FOLDER holds the records (default: the environment's STICKSLIP_REAL_DATA, else ../shared/data/real beside the
repository). The records themselves are others' and are not part of this repository. Reports of diagnoses are left in
out/real-data.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from real_data.along_the_motion import diagnosed, drill_string
from real_data.bolted_joint import bolted_joint
from real_data.forecasts import forecasts
from real_data.friction_damper import friction_damper
from real_data.loops import reciprocating_loops
from real_data.paper_slider import paper
from real_data.robot_ramps import robot
from real_data.rocks import rocks
from real_data.surfaces import topographies
from real_data.unresolved_slips import classroom, fault
from real_data.wandering import paper_wandering

from tests.kept_results import keep

DEFAULT = DOCS.parents[1] / "shared" / "data" / "real"
PARTS: dict[str, Callable[[Path, Path], dict[str, Any]]] = {
    "paper": paper,
    "paper-slider-speeds": partial(diagnosed, "paper-slider-speeds"),
    "paper-wandering": paper_wandering,
    "forecasts": forecasts,
    "fault": fault,
    "classroom": classroom,
    "bolted-joint": bolted_joint,
    "reciprocating-loops": reciprocating_loops,
    "topographies": topographies,
    "rocks": rocks,
    "friction-damper": friction_damper,
    "drill-string": drill_string,
    "robot": robot,
    "robot-joint": partial(diagnosed, "robot-joint"),
    "robot-joint-2": partial(diagnosed, "robot-joint-2"),
    "robot-loops": partial(diagnosed, "robot-loops"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default=os.environ.get("STICKSLIP_REAL_DATA", str(DEFAULT)))
    parser.add_argument("--only", nargs="*", choices=PARTS, default=list(PARTS), metavar="PART",
                        help=f"parts to make anew; the others stay: {', '.join(PARTS)}")  # fmt: skip
    asked = parser.parse_args()
    data = Path(asked.folder).resolve()
    if not data.is_dir():
        raise SystemExit(f"there is no folder {data}; name it, or set STICKSLIP_REAL_DATA")
    (DOCS / "figures").mkdir(exist_ok=True)
    for name in asked.only:
        with tempfile.TemporaryDirectory() as work:
            made = PARTS[name](data, Path(work))
        keep("real_data", f"python docs/make_real_data.py --only {name}", name, **made)


if __name__ == "__main__":
    main()
