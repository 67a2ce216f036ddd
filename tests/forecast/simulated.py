"""Forecasts of simulated slips whose friction wanders by the catalogue's law: are their intervals right?

    python -m tests.forecast.simulated FOLDER [--draws 3]

FOLDER keeps what is finished, and the same command goes on from there. Writes docs/results/calibration.json and
docs/figures/forecast-calibration.png, for docs/forecast.md.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.data.trace import Trace
from stickslip.inference.forecast.predict import METHODS
from stickslip.inference.forecast.rolling import Rolled, choose, roll
from stickslip.inference.forecast.scoring import quantiles
from stickslip.inference.forecast.wander import Wander
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, RUNS, figure, styled
from stickslip.simulation.scenario import load_scenario
from tests.kept_cases import each
from tests.kept_results import keep

from .synthetic import prepare

ROOT = Path(__file__).parents[2]
FORMS = {
    "place": ("place", 'length = "300 um"'),
    "place, there and back": ("place", 'length = "300 um"'),
    "slip": ("slip", 'length = "300 um"'),
    "time": ("time", 'time = "30 s"'),
}
SPEED, STROKE = 42e-6, 100  # m/s, and s there or back
SECONDS, TRAIN, SIZE, DRAW = 5000, 0.3, 0.1, 3
SHARES = np.arange(0.1, 0.95, 0.1)
MEANS = ("held", "coverage_50", "coverage_90", "crps", "crps_mean_recurrence")


def record(form: str, seconds: int = SECONDS, draw: float = DRAW) -> Trace:
    """The paper slider of the scenarios without ripple of its drive, its friction wandering; as a sensor reads it."""
    along, size = FORMS[form]
    text = (ROOT / "scenarios" / "paper_slider.toml").read_text(encoding="utf-8")
    before, after = text.index("[[effect]]"), text.index("[sensor]")
    effect = f'[[effect]]\ntype = "wandering-friction"\nalong = "{along}"\nsize = {SIZE}\n{size}\ndraw = {draw}\n\n'
    text = (text[:before] + effect + text[after:]).replace('"2 kHz"', '"500 Hz"')
    ways = [SPEED, -SPEED] * (seconds // STROKE // 2) if form.endswith("back") else [SPEED]
    duration = seconds // len(ways)
    pieces = "".join(f"[[drive.piece]]\nvelocity = {way}\nduration = {duration}\n" for way in ways)
    one = 'velocity = "42 um/s"\nduration = "40 s"\n'
    assert one in text
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wander.toml"
        path.write_text(text.replace(one, pieces), encoding="utf-8")
        data = ss.simulate(load_scenario(path))
    return Trace.from_arrays(
        form, time=data.time.values, displacement=data.reading.values, spring_stiffness=168.0,
        drive=[(duration * (n + 1.0), way) for n, way in enumerate(ways)],
    )  # fmt: skip


def forecasts(trace: Trace) -> tuple[Wander, Rolled]:
    """As the command makes them: law and use of the rise of late from the first part, forecasts all along the rest."""
    past, laws = prepare(trace, TRAIN)
    law, rise = choose(past, laws)
    return law, roll(past, law, rise=rise)


def held(found: Rolled) -> list[float]:
    """Share of what came within central intervals of :data:`SHARES`."""
    edges = quantiles(np.array(found.members[METHODS[0]]), [*(0.5 - 0.5 * SHARES), *(0.5 + 0.5 * SHARES)])
    low, high = edges[: SHARES.size], edges[SHARES.size :]
    return [float(v) for v in np.mean((found.truth >= low) & (found.truth <= high), axis=1)]


def one(name: str) -> dict[str, Any]:
    """How the forecasts of a record hold, ``name`` its form and draw."""
    form, draw = name.rsplit(" ", 1)
    law, found = forecasts(record(form, draw=float(draw)))
    scores = found.score()
    return {
        "slips": int(np.unique(found.slip).size), "forecasts": int(found.truth.size), "law": str(law),
        "held": held(found), **scores[METHODS[0]], "crps_mean_recurrence": scores["mean recurrence"]["crps"],
    }  # fmt: skip


def tally(records: list[dict[str, Any]]) -> dict[str, Any]:
    """Of all draws of a form: what is held is the mean over slips, ``draws`` what each of them holds."""
    slips = [r["slips"] for r in records]
    mean = {k: np.average([r[k] for r in records], axis=0, weights=slips).tolist() for k in MEANS}
    laws = list(dict.fromkeys(r["law"] for r in records))
    return {"slips": sum(slips), "law": "; ".join(laws), **mean, "draws": [{k: r[k] for k in MEANS} for r in records]}


@styled
def picture(rows: dict[str, dict[str, Any]]) -> Any:
    """Observed less nominal coverage of central intervals."""
    made, axes = figure(1, 1, width=6.0, height=3.6)
    ax = axes[0, 0]
    ax.axhspan(-3.0, 3.0, color=LIGHT, alpha=0.3, lw=0, label="aim")
    ax.axhline(0.0, color=DARK, lw=0.8)
    for (along, row), mark, color in zip(rows.items(), "osD^", RUNS[:4], strict=True):
        off = 100.0 * (np.array(row["held"]) - SHARES)
        error = 100.0 * np.sqrt(SHARES * (1.0 - SHARES) / row["slips"])
        ax.errorbar(100.0 * SHARES, off, error, marker=mark, ms=4, lw=1.0, color=color, label=f"wanders along {along}")
    ax.set(xlabel="central interval / %", ylabel="observed - nominal coverage / %", ylim=(-10.0, 10.0))
    ax.legend(fontsize="x-small", ncols=2)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draws", type=int, default=3)
    options = parser.parse_args()
    rows: dict[str, dict[str, Any]] = {}
    for form in FORMS:
        names = [f"{form} {draw}" for draw in range(DRAW, DRAW + options.draws)]
        rows[form] = tally([found for _, found in each(options.folder, names, one)])
        print(form, rows[form], flush=True)
    command = f"python -m tests.forecast.simulated FOLDER --draws {options.draws}"
    keep("calibration", command, size=SIZE, seconds=SECONDS, train=TRAIN, records=rows)
    save(picture(rows), ROOT / "docs" / "figures" / "forecast-calibration.png", dpi=90)


if __name__ == "__main__":
    main()
