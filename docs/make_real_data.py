"""Write docs/real-data.md and its pictures: every number comes from the program, run on measured records.

    python docs/make_real_data.py [FOLDER]

FOLDER holds the records (default: the environment's STICKSLIP_REAL_DATA, else ../shared/data/real beside the
repository). The records themselves are others' and are not part of this repository.
"""

# Paragraphs of the page are written as they stand there.
# ruff: noqa: E501

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path
from statistics import mean, median, stdev

import numpy as np
import xarray

from stickslip import __version__
from stickslip.campaign import load_campaign, load_traces
from stickslip.cli import run
from stickslip.plots import save
from stickslip.report.figures import ripple_picture, trace_picture
from stickslip.report.fit_figures import ramp_grid
from stickslip.report.ripple import stick_spectrum
from stickslip.segment import segment

DOCS = Path(__file__).resolve().parent
DEFAULT = DOCS.parents[1] / "shared" / "data" / "real"

PAPER_RIG = """[rig]
mass = "30.7 g"
contacts = 1
normal_force = "0.3012 N"
friction_coefficient = {{ guess = 0.3, lower = 0.15, upper = 0.6 }}
spring_stiffness = "{k} N/m"
"""
PAPER = """[[trace]]
name = "k{k}v{v}"
file = "{data}/paper-slider-ens/k{k}Nm_v{v}.mat"
outside = true
time = {{ column = "t", unit = "s" }}
spring_force = {{ column = "Fnorm", unit = "0.3012 N" }}
drive_velocity = "{v} um/s"
"""
FAULT = """[[trace]]
name = "p5198"
file = "{data}/psu-stickslip-p5198/newDF_TimeToFailure_from_6600_to_6900_WITHOUT_subwindows.csv"
outside = true
time = {{ column = "Time", unit = "s" }}
drive_position = {{ column = "LPDisp", unit = "um" }}
spring_force = {{ column = "ShearStress", unit = "1 MPa * 25 cm^2" }}
"""
RAMP = """[[trace]]
name = "joint {joint}, {name}"
file = "{position}"
outside = true
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "mm" }}
spring_force = {{ column = 2, unit = "N", file = "{torque}" }}
minimum_slip = "{smallest} mm"
stop = "{stop:.3f} s"
virgin = true
"""

# peaks of the force that the collector of the records counted
BY_EYE = {
    (168, 1100): "119", (168, 4300): "67", (1002, 1100): "224", (1002, 4300): "132",
    (2254, 42): "0", (2254, 1100): "few", (2254, 4300): "168",
}  # fmt: skip


def program(*arguments: str) -> tuple[int, str]:
    """Run the command line; its exit code and what it said."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(list(arguments))
    return code, (out.getvalue() if code == 0 else err.getvalue()).strip()


def campaign(folder: Path, name: str, title: str, *parts: str) -> str:
    """A campaign file."""
    path = folder / f"{name}.toml"
    path.write_text(f'schema = 1\ntitle = "{title}"\n' + "".join(parts), encoding="utf-8")
    return str(path)


def result(path: str, out: Path, *command: str) -> tuple[dict, xarray.Dataset]:
    """Run a command into a run folder; its result and arrays."""
    code, said = program(command[0], path, *command[1:], "--out", str(out), "--force")
    if code:
        raise SystemExit(f"{' '.join(command)} {path} failed: {said}")
    with xarray.open_dataset(out / "arrays.nc", engine="h5netcdf") as data:
        return json.loads((out / "result.json").read_text(encoding="utf-8")), data.load()


def quote(lines: list[str]) -> str:
    return "\n".join(f"> {line}  " for line in lines) + "\n"


def paper(data: Path, work: Path, rows: list[list[str]]) -> str:
    """The paper slider."""
    rig = PAPER_RIG.format(k=168)
    path = campaign(work, "paper", "Paper on paper", rig, PAPER.format(k=168, v=42, data=data))
    seen, arrays = result(path, work / "paper", "inspect")
    trace = seen["traces"][0]
    save(trace_picture(arrays, 0, trace), DOCS / "figures" / "real-paper.png", dpi=90)
    save(
        ripple_picture(arrays, 0, {**trace["ripple"], "name": trace["name"]}),
        DOCS / "figures" / "real-paper-ripple.png",
        dpi=90,
    )
    slips = [1e6 * e["slip"] for e in trace["events"]]
    large = sum(s > 15 for s in slips)
    static, _ = result(path, work / "paper-static", "fit", "--model", "static", "--v-lim", "10 um/s")
    part = PAPER.format(k=168, v=42, data=data) + 'start = "260 s"\nstop = "300 s"\n'
    short = campaign(work, "paper-part", "Paper on paper", rig, part)
    dynamic, _ = result(short, work / "paper-dynamic", "fit")
    others = []
    for k, v in ((168, 1100), (168, 4300), (1002, 1100), (1002, 4300), (2254, 42), (2254, 1100), (2254, 4300)):
        other = PAPER_RIG.format(k=k)
        file = campaign(work, f"paper{k}-{v}", "Paper on paper", other, PAPER.format(k=k, v=v, data=data))
        found = json.loads(program("inspect", file, "--json")[1])["traces"][0]
        others.append(f"| {k} | {v} | {len(found['events'])} | {found['regime']} | {BY_EYE[k, v]} |")
    gain, s = trace["stick_gain"], static["static"]
    lines = [*seen["can"], *seen["cannot"]]
    near = [x for x in trace["ripple"]["lines"] if 0.1 < x["period"] < 0.2]
    f, a = arrays["trace0_ripple_frequency"].values, arrays["trace0_ripple_amplitude"].values
    around = float(a[(f > 1 / 0.17) & (f < 1 / 0.13)].max())
    wandering = without_phase(path)
    by_phase = dynamic["ladder"][-1]["by_phase"]
    short_gain = dynamic["traces"][0]["duration"]
    rows.append([
        "paper slider, k = 168 N/m, 42 um/s", str(len(slips)), f"{100 * s['median_nrmse']:.0f} % of the creep ({s['satisfying']} of {s['processes']} fit, v_lim = 10 µm/s)",
        f"{dynamic['ladder'][-1]['train_error']:.0f} floors ({dynamic['fit']['cycles']} cycles)", ", ".join(f"{p} {e:.3g}" for p, e in by_phase.items()),
    ])  # fmt: skip
    return f"""## Paper on paper (spring-driven slider)

Record `k168Nm_v42` of the paper slider, 376 s: {len(slips)} slips, {large} of them above 15 um, {mean(slips):.0f} um in the
mean with a standard deviation of {stdev(slips):.0f} um. What `stickslip inspect` says:

{quote(lines)}
![whole trace, one stick, one slip, what follows it](figures/real-paper.png)

**The force's scale.** In {gain["sticks"]:.0f} sticks the force rises {gain["value"]:.3f} (+-{gain["std"]:.3f}) times as fast as
stiffness times drive. A block cannot move backwards, so the program names it (sensor-gain, {100 * (gain["value"] - 1):+.0f} %). `stickslip fit`
finds it by itself and says, of the {short_gain:.0f} s used below:

{quote([note for note in dynamic["notes"] if "sensor-gain" in note])}
**Ripple.** {trace["ripple"]["text"][0].upper() + trace["ripple"]["text"][1:]}. Around a period of 0.15 s, at which the slope was described as modulated,
{"a line stands out" if near else f"no line stands out: what keeps its phase over the whole record is below {1e9 * around:.0f} nm"}.
{wandering} These are spectra of the position in the sticks, less what all sticks share, not of the residual of a fit, which describes too little of this record.

![spectrum of the position in the sticks](figures/real-paper-ripple.png)

**Static model.** {s["text"]} With one count of 1 um the last moments before a slip, where the curves differ, are a few counts.

The other records of the slider:

| k / (N/m) | V / (µm/s) | slips | motion | peaks by eye |
|---|---|---|---|---|
{chr(10).join(others)}

The last column is what who collected these records counted by eye. At these velocities the slider swings rather than
sticks, or hardly sticks, and how many of its swings are slips depends on what one calls a slip: the program's count is of velocities beyond
its threshold and says no more here than that this is not the stick-slip that the models describe.
"""


def without_phase(path: str) -> str:
    """What the mean of the sticks' spectra without phase says of a ripple of 0.15 s, in words."""
    (trace,) = load_traces(load_campaign(path))
    f, a, sticks = stick_spectrum(trace, segment(trace))
    inside = (f > 1 / 0.17) & (f < 1 / 0.13)
    beside = (f > 4.5) & (f < 10.0) & ~inside
    smooth = np.exp(np.polyval(np.polyfit(np.log(f[beside]), np.log(a[beside] ** 2), 2), np.log(f[inside])))
    excess = float(np.sqrt(max(np.max(a[inside] ** 2 - smooth), 0.0)))
    # a mean of so many powers of noise is known to its size over their root
    seen = float(np.sqrt(3.0 / np.sqrt(sticks) * np.max(smooth)))
    return (
        f"The mean of the spectra of {sticks} sticks without their phases, {1e9 * a[inside][0]:.0f} nm at {f[inside][0]:.2g} Hz, falls to {1e9 * a[inside][-1]:.0f} nm at {f[inside][-1]:.2g} Hz, at most "
        f"{1e9 * excess:.0f} nm (in squares) above a smooth line through its neighbours from 4.5 to 10 Hz: a ripple whose phase wanders would stand out from about {1e9 * seen:.0f} nm on."
    )


def together(data: Path, work: Path) -> str:
    """The paper slider's records that slip, of both springs and three velocities, diagnosed together."""
    parts = [PAPER.format(k=168, v=42, data=data) + 'start = "260 s"\nstop = "300 s"\n']
    for k, v in ((168, 1100), (168, 4300), (1002, 1100), (1002, 4300)):
        parts.append(PAPER.format(k=k, v=v, data=data) + f'spring_stiffness = "{k} N/m"\n')
    path = campaign(work, "paper-together", "Paper on paper", PAPER_RIG.format(k=168), *parts)
    out = work / "paper-diagnosis"
    code, said = program("diagnose", path, "--out", str(out), "--force")
    if not (out / "result.json").is_file():
        raise SystemExit(f"diagnose failed with {code}: {said}")
    found = json.loads((out / "result.json").read_text(encoding="utf-8"))
    rungs = [
        f"| {'static' if rung['added'] is None else '+ ' + rung['added']} | {number(rung['train_error'])} | {number(rung['heldout_error'])} | {phases(rung['by_phase'])} | {phases(rung['heldout_by_phase'])} |"
        for rung in found["ladder"]
    ]
    tried = sorted((c for c in found["ranking"] or [] if c.get("cost") is not None), key=lambda c: c["cost"])[:5]
    rest = [
        f"| {c['effect']} | {c['cost']:.0f} | {number(c['train_error'])} | {number(c['heldout_error'])} | {'; '.join(c['failures'] or [])} |"
        for c in tried
    ]
    ranking = (
        ""
        if not rest
        else f"""
The base model costs {found["ranking_base"]["cost"]:.0f}; what came nearest (whole list in the report that the command writes):

| effect | cost | fitted | unseen | not named because |
|---|---|---|---|---|
{chr(10).join(rest)}
"""
    )
    return f"""### The records of two springs that slip, diagnosed together

`stickslip diagnose` on five records: k = 168 N/m at 42 (260 to 300 s), 1100 and 4300 um/s and k = 1002 N/m at 1100 and 4300 um/s;
{len(found["ranking"] or [])} effects were tried. It says:

{quote([*found["notes"], f"{found['verdict']['kind']}: {found['verdict']['text']}", *([found["next_experiment"]["text"]] if found["next_experiment"] else []), *found["caution"]])}
| model | fitted cycles, floors | unseen | fitted, by phase | unseen, by phase |
|---|---|---|---|---|
{chr(10).join(rungs)}
{ranking}"""


def number(error: float | None) -> str:
    return "" if error is None else f"{error:.3g}"


def phases(errors: dict[str, float]) -> str:
    return ", ".join(f"{name} {number(error)}" for name, error in errors.items())


def robot(data: Path, work: Path, rows: list[list[str]]) -> str:
    """The robot's break-away ramps."""
    folder = data / "robot-breakaway-creep" / "test1"
    parts, left_out = [], []
    for position in sorted(folder.glob("*pos*")):
        torque = Path(str(position).replace("pos", "tau"))
        joint = 1 if "pos1" in position.name else 2
        rate = 0.5 if joint == 1 else 0.1  # N m/s
        t, tau = np.loadtxt(torque).T
        if np.mean(np.diff(t) <= 0) > 0.1:
            left_out.append(position.stem)
            continue
        # the controller's return motion is no part of the ramp
        off = np.flatnonzero(np.abs(np.abs(tau) - rate * t) > 1.5 * rate)
        stop = t[off[0] - 2] if off.size else t[-1]
        name = position.stem.removeprefix("est_").removesuffix("_gan")
        parts.append(
            RAMP.format(
                joint=joint,
                name=name,
                position=position,
                torque=torque,
                smallest=0.03 if joint == 1 else 0.3,
                stop=stop,
            )
        )
    path = campaign(work, "robot", "Robot joints", *parts)
    found, arrays = result(path, work / "robot", "fit", "--model", "static")
    r = found["ramps"]
    save(ramp_grid(arrays, r["fits"]), DOCS / "figures" / "real-robot.png", dpi=80)
    one = [f for f in r["fits"] if f["trace"].startswith("joint 1")]
    two = [f for f in r["fits"] if f["trace"].startswith("joint 2")]
    low = [
        float(abs(arrays[f"ramp{i}_displacement"].values[: len(arrays[f"ramp{i}_tau"]) // 5]).max() / f["u_max"])
        for i, f in enumerate(r["fits"])
    ]
    dead = sum(x < 0.01 for x in low)
    worst = max(r["fits"], key=lambda f: f["nrmse"])
    declined = (
        program("diagnose", path, "--out", str(work / "robot-diagnosis"))[1].splitlines()[0].removeprefix("stickslip: ")
    )
    rows.append([
        "robot joints, break-away ramps", str(r["ramps"]), f"{100 * r['median_nrmse']:.1f} % of u_max ({r['satisfying']} of {r['ramps']} fit)",
        "not possible (no driving spring)", "low force (dead band) and small slips before break-away",
    ])  # fmt: skip
    return f"""## Robot joints (torque ramps up to break-away)

{r["text"]} Here 1 mm stands for 1 degree of angle and 1 N for 1 N m of commanded torque; nothing is known of load or geometry, so only
the shape H and the scale u_max are fitted. {", ".join(left_out)} could not be used: more than a tenth of their time stamps stand still.

| | ramps | fit | median residual | u_max |
|---|---|---|---|---|
| joint 1 | {len(one)} | {sum(f["satisfying"] for f in one)} | {100 * median(f["nrmse"] for f in one):.1f} % | {median(1e3 * f["u_max"] for f in one):.2g} deg |
| joint 2 | {len(two)} | {sum(f["satisfying"] for f in two)} | {100 * median(f["nrmse"] for f in two):.1f} % | {median(1e3 * f["u_max"] for f in two):.2g} deg |

![ramps and the static curve](figures/real-robot.png)

What the model cannot describe: {dead} of {r["ramps"]} ramps hardly move (below 1 % of u_max) in the first fifth of the ramp, where every bank of springs
creeps in proportion to the force; and some ramps hold small slips before the large one (worst: {worst["trace"]}, {100 * worst["nrmse"]:.0f} %). A small H is
the fit's way to be steep at the end, and no finding about a surface: {sum(bool(f["note"]) for f in r["fits"])} of {r["ramps"]} end at the edge of its range.

`stickslip diagnose` declines these records: "{declined}". A ramp of torque without a spring has no stick-slip in it, so
no effect was tried on them, none is named, and no error fell: the dead band and the small slips stay unexplained.
"""


def fault(data: Path, work: Path, rows: list[list[str]]) -> str:
    """The laboratory fault."""
    path = campaign(work, "fault", "Laboratory fault p5198", FAULT.format(data=data))
    seen, arrays = result(path, work / "fault", "inspect")
    trace = seen["traces"][0]
    save(trace_picture(arrays, 0, trace), DOCS / "figures" / "real-fault.png", dpi=90)
    events = trace["events"]
    recurrence = [e["recurrence"] for e in events if e["recurrence"]]
    durations, slips = [e["duration"] for e in events], [e["slip"] for e in events]
    tied = float(np.corrcoef(durations, slips)[0, 1])
    refused = [program("fit", path, "--model", model)[1].splitlines()[0] for model in ("static", "inertial")]
    refused = [text.replace(str(work), "").replace("stickslip: ", "").lstrip("/") for text in refused]
    rows.append([
        "laboratory fault p5198", str(len(events)), "not possible (load and stiffness not known)", "not possible (mass not known)",
        "the record itself: smoothed over about a second",
    ])  # fmt: skip
    return f"""## Laboratory fault p5198 (shear stress)

{len(events)} slips, one every {mean(recurrence):.2f} s (standard deviation {stdev(recurrence):.2f} s), at {1e6 * trace["drive_velocity"]:.2f} um/s (median of the load point's speed). What `stickslip inspect` says:

{quote([*seen["can"], *seen["cannot"]])}
![whole record, one stick, one slip, what follows it](figures/real-fault.png)

The record was made from raw data by moving windows of about a second, and that forbids most conclusions. The slips last
{median(durations):.2f} s ({min(durations):.2f} to {max(durations):.2f} s, correlation with their size {tied:.2f}), which is the windows' length and says
nothing of the slip itself; peak velocity, onset shape, overshoot and ring-down are the filter's. Creep in the last second before a
slip is mixed with the slip. What remains: when the slips are, how large they are, and the slope of loading between them.
`stickslip fit` declines: "{refused[0]}" (static), "{refused[1]}" (inertial).
"""


def main() -> None:
    data = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("STICKSLIP_REAL_DATA", DEFAULT)).resolve()
    if not data.is_dir():
        raise SystemExit(f"there is no folder {data}; name it, or set STICKSLIP_REAL_DATA")
    (DOCS / "figures").mkdir(exist_ok=True)
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        sections = [paper(data, work, rows), together(data, work), robot(data, work, rows), fault(data, work, rows)]
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    told = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=DOCS, capture_output=True, text=True, check=False
    )
    commit = told.stdout.strip() or "unknown"
    text = f"""# Measured records

Written by `python docs/make_real_data.py` on {date.today():%-d %B %Y} with version {__version__} (commit {commit}); every number and picture is the program's. The records are others' and are not part of this
repository. Sources: Colas et al., Phys. Rev. E 2019 (paper slider, github.com/npusteln/stickslip, CeCILL-B); github.com/jorgevchin/Friction-Identification
(robot joints); github.com/lauralaurenti/DNN-earthquake-prediction-forecasting (laboratory fault p5198, raw data by C. Marone's group).

| record | events | static model, residual | dynamic model, error | where it fails most |
|---|---|---|---|---|
{table}

The static model's residual is a share of the creep; a fit satisfies below 2 %. The dynamic model's error is the residual over its
floor, so that 1 is as good as the data allow.

{chr(10).join(sections)}"""
    (DOCS / "real-data.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
