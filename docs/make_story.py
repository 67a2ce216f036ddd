"""Pictures of README.md and of the quick start, from the run folder of ``make demo``.

    python docs/make_story.py [out/demo]        # the story, its caption, and the terminal's last words
    python docs/make_story.py --simulations     # the simulated pictures in docs/images

The first writes docs/images/story.png and diagnosis.txt, docs/results/story.json, and puts the caption between the
``story`` marks of README.md.
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import sys
import tempfile
import textwrap
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import stickslip as ss
from stickslip.cli import diagnose as terminal
from stickslip.cli import run as command
from stickslip.data.segment import segment
from stickslip.inference.fit.creep_process import creep_processes
from stickslip.inference.fit.static import CreepFit, fit_static
from stickslip.inference.fit.static_table import StaticRig, static_table, virtual_curve
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, styled
from stickslip.system.runstore import read_result
from tests.kept_results import keep

IMAGES = ROOT / "docs" / "images"
RUN = 0  # the run whose trace is shown
SHOWN = 9  # candidates, at most


# --- 1: what was measured ---------------------------------------------------------------------------------------------


def measured(axes: Axes, data: xarray.Dataset, facts: dict[str, Any]) -> None:
    """The trace with its slips, and the load point."""
    key = f"trace{RUN}"
    t, x, drive = (data[f"{key}_whole_{name}"].values for name in ("time", "position", "drive"))
    onset = data[f"{key}_event_onset"].values
    zero = x[0]
    axes.plot(t, (drive - drive[0]) * 1e6, color=MIDDLE, ls="--", lw=1.0, label="load point")
    axes.plot(t, (x - zero) * 1e6, color=DARK, label="block, measured")
    axes.plot(onset, (np.interp(onset, t, x) - zero) * 1e6, "v", ms=6, color=MIDDLE, label="slip found")
    axes.set(xlabel="time / s", ylabel="displacement / µm")
    axes.set_title(f"1  Measured: stick-slip at {facts['drive_velocity'] * 1e6:.0f} µm/s")
    axes.legend(loc="upper left")


# --- 2: the static model ----------------------------------------------------------------------------------------------


def first_creep(campaign: Path) -> dict[str, Any]:
    """The static model fitted to the first creep of the run shown, and the creep of the first two sticks."""
    loaded = ss.load_campaign(campaign)
    trace = loaded.traces[RUN]
    events = segment(trace)
    processes, _ = creep_processes(trace, events)
    rig = StaticRig.of(loaded.rig)
    fit = next(f for f in fit_static(processes[:1], rig).fits if f.process.event == 0)
    table = static_table()
    curve = virtual_curve(rig, fit.process.velocity, table.tau, table.displacement(rig, fit.hurst, fit.h_rms))
    return {"fit": fit, "curve": curve, "sticks": [_stick(trace, events.events, i) for i in (0, 1)]}


def _stick(trace: ss.Trace, events: Any, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s) and displacement (m) from the start of a stick into its slip, and the time from start to onset (s)."""
    begin = 0.0 if number == 0 else events[number - 1].t_arrest
    onset = events[number].t_onset
    part = (trace.time >= begin) & (trace.time <= onset + 0.3 * (events[number].t_arrest - onset))
    t, x = trace.time[part], trace.displacement[part]
    settled = (t - begin) <= 0.05 * (onset - begin)
    return t - begin, x - np.median(x[settled]), np.array(onset - begin)


def static(axes: Axes, found: dict[str, Any]) -> None:
    """Two sticks as measured, and the one curve that the static model has for both."""
    fit: CreepFit = found["fit"]
    curve = found["curve"]
    top = 1.45 * curve.u[-1]
    for (t, x, _), look in zip(
        found["sticks"],
        ({"color": LIGHT, "lw": 4.0, "label": "first stick"}, {"color": DARK, "label": "second stick"}),
        strict=True,
    ):
        axes.plot(t, x * 1e9, **look)
    # laid on the measured curve where the fit laid it: at the passage of v_lim
    first = found["sticks"][0]
    end = _passage(fit, first)
    i = int(np.flatnonzero(curve.v <= fit.process.v_lim)[-1])
    t = curve.t - curve.t[i] + end
    u = curve.u - curve.u[i] + float(np.interp(end, first[0], first[1]))
    axes.plot(t, u * 1e9, color=MIDDLE, ls="--", lw=1.6, label="static model")
    axes.plot(t[-1], u[-1] * 1e9, "x", color=MIDDLE, ms=8, mew=2)
    axes.set_ylim(-0.04 * top * 1e9, top * 1e9)
    axes.set(xlabel="time since the stick began / s", ylabel="creep / nm")
    axes.set_title("2  The static model fails at the second slip")
    second = float(found["sticks"][1][2])
    axes.annotate(
        f"measured: slips\nafter {second:.2f} s",
        (second, 0.45 * top * 1e9),
        (second + 0.06 * curve.t[-1], 0.5 * top * 1e9),
        color=DARK,
        va="center",
    )
    axes.annotate(
        "ends; no slip",
        (t[-1], u[-1] * 1e9),
        (0.98 * t[-1], 1.04 * u[-1] * 1e9),
        color=MIDDLE,
        ha="right",
        va="bottom",
    )
    axes.legend(loc="upper center")


def _passage(fit: CreepFit, stick: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """When the process fitted ended, in the time of its stick (s): where its points lie on the trace best."""
    t, x, onset = stick
    ends = np.linspace(float(onset) - 0.1 * float(onset), float(onset), 2001)
    process = fit.process
    off = [np.std(np.interp(end + process.time, t, x) - process.displacement) for end in ends]
    return float(ends[int(np.argmin(off))])


# --- 3: the candidates ------------------------------------------------------------------------------------------------


def refitted(result: dict[str, Any]) -> list[dict[str, Any]]:
    """Candidates of the first round that were refitted, the best first."""
    known = [r for r in result["ranking"] if r.get("refit") and r.get("cost") is not None]
    return sorted(known, key=lambda r: r["cost"])


def candidates(axes: Axes, result: dict[str, Any]) -> None:
    """Error with each candidate, on fitted and on unseen runs."""
    shown = refitted(result)[:SHOWN]
    named = result["verdict"]["set"]
    y = np.arange(len(shown))[::-1]
    for key, mark, colour, label in (
        ("train_error", "o", DARK, "fitted runs"),
        ("heldout_error", "s", MIDDLE, "unseen runs"),
    ):
        axes.plot(
            [r[key] for r in shown], y, mark, color=colour, ms=6, mfc="none" if mark == "s" else colour, label=label
        )
    base = result["ladder"][1]["train_error"]
    axes.axvline(base, color=LIGHT, ls="--", lw=1.2)
    axes.annotate(
        "with none of them",
        (base, len(shown) - 0.3),
        (-4, 0),
        textcoords="offset points",
        color=DARK,
        fontsize=9,
        ha="right",  # what is named lies far to the left of it
    )
    axes.set_ylim(-0.7, len(shown) + 0.3)
    _log(axes, "x", [r[k] for r in shown for k in ("train_error", "heldout_error")] + [base])
    axes.set_yticks(y, [r["effect"] for r in shown])
    for text, row in zip(axes.get_yticklabels(), shown, strict=True):
        if row["effect"] in named:
            text.set_fontweight("bold")
            text.set_color(MIDDLE)
    axes.set(xlabel="error / floors")
    axes.set_title(f"3  Named: {', '.join(result['verdict']['effects']) or result['verdict']['kind']}")
    axes.legend(loc="lower left", handletextpad=0.2)  # those refused lie to the right, at the base


# --- 4: the ladder ----------------------------------------------------------------------------------------------------


def ladder(axes: Axes, result: dict[str, Any]) -> None:
    """Errors along the ladder of models."""
    rungs = result["ladder"]
    x = np.arange(len(rungs))
    for key, style, colour, label in (
        ("train_error", "o-", DARK, "fitted runs"),
        ("heldout_error", "s--", MIDDLE, "unseen runs"),
    ):
        axes.plot(
            x, [r[key] for r in rungs], style, color=colour, ms=6, mfc="none" if "s" in style else colour, label=label
        )
    for i, rung in enumerate(rungs):
        axes.annotate(
            _digits(rung["train_error"]),
            (float(i), rung["train_error"]),
            (9, 4),
            textcoords="offset points",
            color=DARK,
        )
    axes.set_yscale("log")
    axes.set_ylim(0.55, 2.5 * max(r["train_error"] for r in rungs))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.minorticks_off()
    axes.axhline(1.0, color=LIGHT, ls=":", lw=1.4)
    axes.text(-0.25, 0.87, "as good as the data allow", color=DARK, fontsize=9, va="top")
    axes.set_xlim(-0.3, len(rungs) - 0.55)
    axes.set_xticks(x, ["static" if r["added"] is None else f"+ {r['added']}" for r in rungs])
    axes.set(ylabel="error / floors")
    axes.set_title("4  The error falls, on unseen runs too")
    axes.legend(loc="upper right")


def _log(axes: Axes, which: str, values: list[float]) -> None:
    """A logarithmic axis around these values, with plain numbers."""
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    low, high = 0.8 * min(values), 1.25 * max(values)
    (axes.set_xlim if which == "x" else axes.set_ylim)(low, high)
    ticks = [v for p in range(-2, 5) for v in (1 * 10.0**p, 2 * 10.0**p, 5 * 10.0**p) if low < v < high]
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_ticks(ticks, [f"{v:g}" for v in ticks])
    axes.minorticks_off()


def _digits(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


# --- all of it --------------------------------------------------------------------------------------------------------


@styled
def story(data: xarray.Dataset, result: dict[str, Any], creep: dict[str, Any]) -> Figure:
    """Trace, failing static model, named effect, falling error."""
    made = Figure(figsize=(9.6, 7.6), layout="constrained")
    FigureCanvasAgg(made)
    top, low = made.subfigures(2, 1, hspace=0.04)  # so that the names of effects do not push the panel above aside
    upper, lower = top.subplots(1, 2), low.subplots(1, 2)
    measured(upper[0], data, result["traces"][RUN])
    static(upper[1], creep)
    candidates(lower[0], result)
    ladder(lower[1], result)
    return made


def facts(result: dict[str, Any], creep: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The figures that stand under the picture."""
    fit: CreepFit = creep["fit"]
    trace = result["traces"][RUN]
    shown = refitted(result)
    return {
        "version": result["versions"]["stickslip"],
        "date": datetime.fromtimestamp((folder / "arrays.nc").stat().st_mtime, UTC).date().isoformat(),
        "seconds": round(result["seconds"]),
        "slips": len(trace["events"]),
        "velocity_um_s": round(trace["drive_velocity"] * 1e6),
        "static": {
            "H": round(fit.hurst, 2),
            "residual_percent": round(100 * fit.nrmse, 1),
            "second_stick_s": round(float(creep["sticks"][1][2]), 2),
            "model_stick_s": round(float(creep["curve"].t[-1]), 1),
        },
        "tried": len(result["ranking"]),
        "refitted": len(shown),
        "best": [r["effect"] for r in shown[:2]],
        "gains": [round(r["gain"]) for r in shown[:2]],
        "models": ["static" if r["added"] is None else r["added"] for r in result["ladder"]],
        "fitted": [float(f"{r['train_error']:.3g}") for r in result["ladder"]],
        "unseen": [float(f"{r['heldout_error']:.3g}") for r in result["ladder"] if r["heldout_error"] is not None],
        "verdict": result["verdict"]["kind"],
        "effects": result["verdict"]["effects"],
    }


def caption(f: dict[str, Any]) -> str:
    """The words under the picture, every figure from the run."""
    s = f["static"]
    arrow = " → "
    named = ", ".join(f["effects"]) or "none"
    second = f"; next: {f['best'][1]}, {f['gains'][1]}" if len(f["best"]) > 1 else ""
    text = (
        f"*Drawn by `docs/make_story.py` from the run folder of `make demo`: version {f['version']}, {f['date']}, "
        f"{f['seconds']} s. **1** One of five runs, {f['slips']} slips at {f['velocity_um_s']} µm/s. **2** The static "
        f"model, fitted to the first creep, describes it to {s['residual_percent']} % (H = {s['H']}) and fails after "
        f"it: the second slip comes after {s['second_stick_s']} s, the model needs {s['model_stick_s']} s for every "
        f"stick and ends without a slip. **3** Error with each effect: {f['refitted']} of {f['tried']} that these data "
        f"can test were refitted; verdict `{f['verdict']}`, named: {named} (2 Δ log-likelihood = {f['gains'][0]}"
        f"{second}). **4** Error on fitted runs {arrow.join(_digits(v) for v in f['fitted'])}, on unseen ones "
        f"{arrow.join(_digits(v) for v in f['unseen'])}, in floors: 1 is as good as noise and scatter allow.*"
    )
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def last_words(result: dict[str, Any]) -> str:
    """What `stickslip diagnose` prints at its end."""
    result = {**result, "verdict": {"confidence": None, **result["verdict"]}}
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        terminal._print(result, Path("out/demo"))
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def put_caption(text: str) -> None:
    """Between the marks of README.md."""
    path = ROOT / "README.md"
    old = path.read_text(encoding="utf-8")
    new, found = re.subn(
        r"(<!-- story -->\n).*?(\n<!-- /story -->)", lambda m: m[1] + text + m[2], old, flags=re.DOTALL
    )
    if not found:
        raise SystemExit("README.md has no <!-- story --> ... <!-- /story -->")
    path.write_text(new, encoding="utf-8")


def simulations() -> None:
    """The two pictures that `stickslip simulate` makes."""
    for scenario, picture, name in (
        ("grzemba2014.toml", "trace.png", "grzemba2014.png"),
        ("static_vs_inertial.toml", "static_vs_inertial.png", "static_vs_inertial.png"),
    ):
        with tempfile.TemporaryDirectory() as folder:
            if command(["simulate", str(ROOT / "scenarios" / scenario), "--out", f"{folder}/run"]):
                raise SystemExit(f"{scenario} failed")
            shutil.copy(f"{folder}/run/{picture}", IMAGES / name)


def main(folder: Path) -> None:
    result = read_result(folder)
    with xarray.open_dataset(folder / "arrays.nc", engine="h5netcdf") as data:
        creep = first_creep(ROOT / result["inputs"][0]["file"])
        save(story(data, result, creep), IMAGES / "story.png")
    found = facts(result, creep, folder)
    keep("story", "python docs/make_story.py", **found)
    (IMAGES / "diagnosis.txt").write_text(last_words(result), encoding="utf-8")
    put_caption(caption(found))
    print(caption(found))


if __name__ == "__main__":
    if sys.argv[1:] == ["--simulations"]:
        simulations()
    else:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "out" / "demo"))
