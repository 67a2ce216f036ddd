"""Write docs/results/real_data.json and its pictures, from which docs/real-data.md takes every number.

The numbers are the program's, run on measured records.

    python docs/make_real_data.py [FOLDER] [--only PART ...]

FOLDER holds the records (default: the environment's STICKSLIP_REAL_DATA, else ../shared/data/real beside the
repository). The records themselves are others' and are not part of this repository. Reports of diagnoses are left in
out/real-data.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import shutil
import tempfile
import tomllib
from datetime import date
from itertools import pairwise
from pathlib import Path
from statistics import mean, median, stdev
from typing import Any

import numpy as np
import xarray
from scipy.io import loadmat
from scipy.signal import savgol_filter, welch

import stickslip as ss
from stickslip import __version__
from stickslip.cli import run
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.errors import InputError
from stickslip.inference.force.heldout import halves, unseen
from stickslip.inference.force.problem import BESIDE
from stickslip.physics.contact import default_loads, equal_bodies, from_heights, heights_from_scan
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, plain, scaled, styled
from stickslip.show.report.figures import ripple_picture, trace_picture
from stickslip.show.report.fit_figures import ramp_grid
from stickslip.show.report.ripple import stick_spectrum

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

# campaigns of scenarios/real, and where their records are
PRESCRIBED = {
    "reciprocating-loops": "reciprocating-loops-200Hz",
    "drill-string": "torsional-rig-drillstring",
    "robot-joint": "robot-breakaway-creep/test1",
    "robot-loops": "robot-breakaway-creep/test3",
    "friction-damper": "friction-damper-brfd",
    "bolted-joint": "bolted-joint-brb",
    "rock-basalt": "rock-velocity-steps",
    "rock-sepiolite": "rock-velocity-steps",
}

PICTURES = {"reciprocating-loops": "real-reciprocating-loops", "drill-string": "real-drill-string"}

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


def paper(data: Path, work: Path) -> dict[str, Any]:
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
    static, _ = result(path, work / "paper-static", "fit", "--model", "static", "--v-lim", "10 um/s")
    part = PAPER.format(k=168, v=42, data=data) + 'start = "260 s"\nstop = "300 s"\n'
    short = campaign(work, "paper-part", "Paper on paper", rig, part)
    dynamic, _ = result(short, work / "paper-dynamic", "fit")
    others = []
    for k, v in ((168, 1100), (168, 4300), (1002, 1100), (1002, 4300), (2254, 42), (2254, 1100), (2254, 4300)):
        other = PAPER_RIG.format(k=k)
        file = campaign(work, f"paper{k}-{v}", "Paper on paper", other, PAPER.format(k=k, v=v, data=data))
        found = json.loads(program("inspect", file, "--json")[1])["traces"][0]
        others.append({
            "k": k, "v_um_s": v, "slips": len(found["events"]), "motion": found["regime"], "by_eye": BY_EYE[k, v],
        })  # fmt: skip
    ripple, static = trace["ripple"], static["static"]
    f, a = arrays["trace0_ripple_frequency"].values, arrays["trace0_ripple_amplitude"].values
    last = dynamic["ladder"][-1]
    return {
        "slips": len(slips),
        "large": sum(s > 15 for s in slips),
        "mean_um": mean(slips),
        "std_um": stdev(slips),
        "says": [*seen["can"], *seen["cannot"]],
        "gain": {name: trace["stick_gain"][name] for name in ("sticks", "value", "std")},
        "part_s": dynamic["traces"][0]["duration"],
        "fit_says": [note for note in dynamic["notes"] if "sensor-gain" in note],
        "ripple": ripple["text"],
        "lines_near": sum(0.1 < line["period"] < 0.2 for line in ripple["lines"]),
        "around_nm": 1e9 * float(a[(f > 1 / 0.17) & (f < 1 / 0.13)].max()),
        "without_phase": without_phase(path),
        "static": {name: static[name] for name in ("text", "satisfying", "processes", "median_nrmse")},
        "dynamic": {
            "error": last["train_error"], "cycles": dynamic["fit"]["cycles"], "by_phase": last["by_phase"],
        },
        "others": others,
    }  # fmt: skip


def without_phase(path: str) -> dict[str, float]:
    """What the mean of the sticks' spectra without phase says of a ripple of 0.15 s."""
    (trace,) = load_traces(load_campaign(path))
    f, a, sticks = stick_spectrum(trace, segment(trace))
    inside = (f > 1 / 0.17) & (f < 1 / 0.13)
    beside = (f > 4.5) & (f < 10.0) & ~inside
    smooth = np.exp(np.polyval(np.polyfit(np.log(f[beside]), np.log(a[beside] ** 2), 2), np.log(f[inside])))
    excess = float(np.sqrt(max(np.max(a[inside] ** 2 - smooth), 0.0)))
    # a mean of so many powers of noise is known to its size over their root
    seen = float(np.sqrt(3.0 / np.sqrt(sticks) * np.max(smooth)))
    return {
        "sticks": sticks, "from_nm": 1e9 * float(a[inside][0]), "from_hz": float(f[inside][0]),
        "to_nm": 1e9 * float(a[inside][-1]), "to_hz": float(f[inside][-1]), "excess_nm": 1e9 * excess,
        "visible_nm": 1e9 * seen,
    }  # fmt: skip


def together(data: Path, work: Path) -> dict[str, Any]:
    """The paper slider's records that slip through the softer spring, at three velocities, diagnosed together."""
    return diagnosed("paper-slider-speeds", data / "paper-slider-ens", work / "speeds")


def robot(data: Path, work: Path) -> dict[str, Any]:
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
    low = [
        float(abs(arrays[f"ramp{i}_displacement"].values[: len(arrays[f"ramp{i}_tau"]) // 5]).max() / f["u_max"])
        for i, f in enumerate(r["fits"])
    ]
    worst = max(r["fits"], key=lambda f: f["nrmse"])
    joints = []
    for joint in (1, 2):
        own = [f for f in r["fits"] if f["trace"].startswith(f"joint {joint}")]
        joints.append({
            "joint": joint, "ramps": len(own), "fit": sum(f["satisfying"] for f in own),
            "median_nrmse": median(f["nrmse"] for f in own), "u_max_deg": median(1e3 * f["u_max"] for f in own),
        })  # fmt: skip
    return {
        "text": r["text"],
        "ramps": r["ramps"],
        "satisfying": r["satisfying"],
        "median_nrmse": r["median_nrmse"],
        "left_out": left_out,
        "joints": joints,
        "dead": sum(x < 0.01 for x in low),
        "worst": worst["trace"],
        "worst_nrmse": worst["nrmse"],
        "at_edge": sum(bool(f["note"]) for f in r["fits"]),
    }


def fault(data: Path, work: Path) -> dict[str, Any]:
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
    return {
        "slips": len(events),
        "recurrence_s": mean(recurrence),
        "recurrence_std_s": stdev(recurrence),
        "velocity_um_s": 1e6 * trace["drive_velocity"],
        "says": [*seen["can"], *seen["cannot"]],
        "duration_s": [median(durations), min(durations), max(durations)],
        "correlation": tied,
        "declined": refused,
    }


def prescribed(data: Path, work: Path) -> dict[str, Any]:
    """Campaigns of scenarios/real whose motion is prescribed and whose force is measured, diagnosed."""
    return {"records": {name: diagnosed(name, data / folder, work / name) for name, folder in PRESCRIBED.items()}}


def diagnosed(name: str, records: Path, work: Path) -> dict[str, Any]:
    """One of them: the ladder, what the program says, and a picture."""
    work.mkdir(parents=True)
    path = Path(shutil.copy(DOCS.parent / "scenarios" / "real" / f"{name}.toml", work))
    if name == "bolted-joint":
        first_mode(records, work)
        records = work
    for trace in tomllib.loads(path.read_text(encoding="utf-8"))["trace"]:
        for channel in (trace, *(c for c in trace.values() if isinstance(c, dict) and "file" in c)):
            if records != work:
                shutil.copy(records / channel["file"], work)
    campaign = ss.load_campaign(path)
    try:
        made = campaign.diagnose()
    except InputError as error:
        return {"title": campaign.title, "declined": error.what, "fitted": fitted(campaign)}
    made.save(DOCS.parent / "out" / "real-data" / name, force=True)
    assert made.found is not None
    rungs = [rung for rung in made.found.ladder if rung.fit is not None]
    fits = [rung.fit for rung in rungs]
    problem = fits[0].problem
    level = float(np.quantile(np.abs(np.concatenate([k.mean @ k.force for k in problem.runs])), 0.95))
    if name in PICTURES:
        save(hysteresis(fits[0], fits[-1], name), DOCS / "figures" / f"{PICTURES[name]}.png")
    own: dict[str, Any] = {"free": [v / level for v in freely(fits[0])]} if problem.loaded else {}
    if name == "bolted-joint":
        own = {"linear": [v / level for v in linear(fits[0])], "swings": (seen := swings(fits)),
               "stuck": [fits[0].values[BESIDE], fits[0].std()[BESIDE]]}  # fmt: skip
        save(amplitudes(seen), DOCS / "figures" / "real-bolted-joint.png", dpi=80)
    if name == "friction-damper":
        own = {"ringing": ringing(campaign)}
    verdict = made.result["verdict"]
    return {
        **own, "title": made.campaign.title, "runs": len(fits[0].problem.runs), "events": int(fits[0].problem.events),
        "says": f"{verdict['kind']}: {verdict['text']}",
        "scatter": fits[-1].scatter.named(),
        "ladder": [
            {
                "model": rung.added, "fitted": rms(rung.residual) / level, "unseen": rms(rung.unseen) / level,
                "gain": None if rung.fit is fits[0] else last.fit.cost - rung.fit.cost,
                "floors": [told["train_error"], told["heldout_error"]],
            }
            for last, rung, told in zip([rungs[0], *rungs], rungs, made.result["ladder"][1:], strict=False)
        ],
    }  # fmt: skip


def first_mode(records: Path, work: Path) -> None:
    """The first bending mode of the bolted beam, as its campaign file says: displacement and acceleration."""
    data = loadmat(records / "HammerImpact.mat", simplify_cells=True)["HIdata"]
    t, a = data["time"], data["acc3"]
    f = np.fft.rfftfreq(t.size, t[1] - t[0])
    mode = np.fft.rfft(a) * np.exp(-0.5 * ((f - 80.4) / 5.0) ** 2)
    x = np.fft.irfft(-mode / (2.0 * np.pi * np.maximum(f, 1.0)) ** 2, t.size)
    rows = np.column_stack([t, x, np.fft.irfft(mode, t.size)])
    np.savetxt(work / "first_mode.csv", rows, header="t,x,a", delimiter=",", comments="")


def linear(fit: Any) -> list[float]:
    """Rms of the force (N) that a spring and a dashpot leave, fitted and on halves of runs left out."""
    _, x, v = along_runs(fit.problem)
    return least(fit, np.column_stack([x, v, fit.problem.run[:, None] == np.arange(len(fit.problem.runs))]))


def freely(fit: Any) -> list[float]:
    """The same of any function of the speed, other where it falls, that is linear in the measured load."""
    runs = fit.problem.runs
    _, _, v = along_runs(fit.problem)
    load = np.concatenate([k.mean @ k.load for k in runs])
    falls = np.concatenate([k.acceleration for k in runs]) < 0.0
    nodes = np.unique(np.quantile(v, np.linspace(0.0, 1.0, 13)))
    hats = np.stack([np.interp(v, nodes, row) for row in np.eye(nodes.size)], axis=1)
    loaded = np.hstack([hats, hats * (load / np.median(load) - 1.0)[:, None]])
    return least(fit, np.hstack([loaded, loaded * falls[:, None]]))


def ringing(campaign: ss.Campaign) -> list[list[float]]:
    """Of every stroke of 20 mm: its way (m), and frequency (Hz) and rms (N) of what the force swings between turns."""
    out = []
    for trace in campaign.traces:
        t, x, force = trace.time, trace.displacement, trace.spring_force
        assert x is not None
        assert force is not None
        step = t[1] - t[0]
        turns = np.flatnonzero(np.diff(np.sign(savgol_filter(x, 31, 2, deriv=1))))
        for a, b in pairwise(turns.tolist()):
            if abs(x[b] - x[a]) < 0.02:
                continue
            sliding = force[a + 100 : b - 40]
            swing = sliding - savgol_filter(sliding, 121, 2)
            f = np.fft.rfftfreq(8192, step)
            power = np.abs(np.fft.rfft(swing * np.hanning(swing.size), 8192)) * ((f > 8.0) & (f < 80.0))
            out.append([float(x[b] - x[a]), float(f[np.argmax(power)]), float(swing.std())])
    return out


def least(fit: Any, columns: np.ndarray) -> list[float]:
    """Rms of the force (N) that a linear model leaves, fitted and on halves of runs left out."""
    force, _, _ = along_runs(fit.problem)

    def left(seen: np.ndarray, own: np.ndarray) -> np.ndarray:
        return force[own] - columns[own] @ np.linalg.lstsq(columns[seen], force[seen], rcond=None)[0]

    everything = np.ones(force.size, bool)
    apart = [np.isin(fit.problem.of, part) for part in halves(fit)]
    return [rms(left(everything, everything)), rms(np.concatenate([left(~own, own) for own in apart]))]


def along_runs(problem: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force (N), displacement from the start (m) and velocity (m/s) at the points."""
    runs = problem.runs
    force, x = (np.concatenate([k.mean @ y for k, y in zip(runs, ys, strict=True)])
                for ys in ([k.force for k in runs], [k.x - k.x[0] for k in runs]))  # fmt: skip
    return force, x, np.concatenate([k.rate for k in runs])


def swings(fits: list[Any]) -> dict[str, Any]:
    """Of every full swing: amplitude (m), and frequency (Hz) and loss over 2 (1) of measured and unseen model force."""
    problem = fits[0].problem
    force, x, v = along_runs(problem)
    forces = {"measured": force, **{"base" if f is fits[0] else f.problem.composition.effects[-1].tag:
                                    force - unseen(f).residual for f in fits}}  # fmt: skip
    out: dict[str, Any] = {"amplitude": [], **{name: {"frequency": [], "damping": []} for name in forces}}
    for e in range(problem.events - 1):
        own = (problem.of == e) | (problem.of == e + 1)
        if np.unique(problem.run[own]).size > 1 or own.sum() < 20:
            continue
        columns = np.column_stack([x[own], v[own], np.ones(own.sum())])
        out["amplitude"].append(0.5 * float(np.ptp(x[own])))
        for name, values in forces.items():
            k, c, _ = np.linalg.lstsq(columns, values[own], rcond=None)[0]
            out[name]["frequency"].append(float(np.sqrt(k) / (2.0 * np.pi)))
            out[name]["damping"].append(float(0.5 * c / np.sqrt(k)))
    return out


@styled
def amplitudes(seen: dict[str, Any]) -> Any:
    """Frequency and damping of a swing against its amplitude, measured and of models on parts left out."""
    made, axes = figure(1, 2, width=10.0, height=4.0)
    x = 1e6 * np.array(seen["amplitude"])
    for axis, what, k, unit in zip(
        axes[0], ("frequency", "damping"), (1.0, 100.0), ("Hz", "% of critical"), strict=True
    ):
        for name, mark, color in zip([n for n in seen if n != "amplitude"], "o^s", (DARK, LIGHT, MIDDLE), strict=False):
            axis.plot(x, k * np.array(seen[name][what]), mark, ms=3, color=color, label=plain(name))
        axis.axhline(k * np.mean(seen["measured"][what]), color=DARK, lw=0.8, ls="--", label="linear joint")
        axis.set(xlabel="amplitude / µm", ylabel=f"{what} / {unit}")
    axes[0][0].legend(fontsize="x-small")
    return made


def classroom(data: Path, work: Path) -> dict[str, Any]:
    """The classroom slider: what the level of a slip follows, and the forecast."""
    work = work / "classroom"
    work.mkdir()
    path = Path(shutil.copy(DOCS.parent / "scenarios" / "real" / "classroom-slider.toml", work))
    shutil.copy(data / "classroom-slider" / "Force7.txt", work)
    campaign = ss.load_campaign(path)
    sizes, forecast = campaign.levels()["slip"].values, campaign.forecast()
    save(forecast.plot.levels(), DOCS / "figures" / "real-classroom.png", dpi=80)
    found = forecast.result
    return {
        "slips": int(sizes.size), "size_s": [float(sizes.mean()), float(sizes.std())],
        "levels": found["levels"], "coordinate": found["coordinate"]["text"], "methods": found["methods"],
        "gains": found["gains"], "train": found["train"],
    }  # fmt: skip


def fitted(campaign: ss.Campaign) -> dict[str, Any]:
    """What a record too short for a diagnosis says of the law that such records are made for."""
    fit = campaign.fit(["rate-and-state"])
    own = fit.parameters.loc[[i for i in fit.parameters.index if i.startswith("rate-and-state.")]]
    return {
        "gain": float(fit.ladder["gain"].iloc[-1]), "error": fit.ladder["error"].tolist()[-2:],
        "law": {name: [float(row["value"]), float(row["std"]), str(row["unit"])] for name, row in own.iterrows()},
    }  # fmt: skip


CROWDING = 0.055  # load over E* L h_rms: the paper's contacts
HURSTS = np.linspace(0.05, 0.95, 19)


def topographies(data: Path, work: Path) -> dict[str, Any]:
    """Surfaces that were measured: does a line of theirs creep as a random line of its Hurst exponent does?"""
    folder = data / "topographies"
    text = (folder / "dektak-1.csv").read_text(encoding="latin-1").partition("Scan Data")[2].splitlines()
    scan = 1e-6 * np.array([[float(v) for v in row.split(",")[:2]] for row in text if row[:1].isdigit()])
    stylus = scan[: len(scan) // 128 * 128, 1].reshape(-1, 128), float(np.mean(np.diff(scan[:, 0])))
    metal = np.loadtxt(folder / "x3p-2_crop256.csv", delimiter=","), 0.127656509837346e-6
    surfaces = {
        "atomic force microscope, 10 µm": (np.loadtxt(folder / "matrix-3.txt"), 10e-6 / 256),
        "machined metal by light, 33 µm": metal,
        "profile under a stylus, 20 µm": stylus,
    }
    rows, drawn = [], {}
    for name, (heights, spacing) in surfaces.items():
        lines = [heights_from_scan(None, row, spacing=spacing)[0] for row in heights]
        kept = [line for line in lines if line.std() > 0.0]
        height = float(np.sqrt(np.mean([line.var() for line in kept])))
        loads = [CROWDING * equal_bodies().normal * spacing * line.size * float(line.std()) for line in kept]
        own = normalised([ss.creep_curve(profile=from_heights(z, spacing), normal_force=f)
                          for z, f in zip(kept, loads, strict=True)])  # fmt: skip
        random = {float(h): normalised([ss.creep_curve(H=float(h), n_springs=kept[0].size)]) for h in HURSTS}
        off = {h: rms(own - curve) for h, curve in random.items()}
        best = min(off, key=off.__getitem__)
        hurst = spectral_hurst(np.array(kept), spacing)
        nearest_h = float(HURSTS[np.argmin(np.abs(HURSTS - hurst))])
        rows.append({"name": name, "lines": len(kept), "h_rms": height, "hurst": hurst, "best": best,
                     "off_best": off[best], "off": off[nearest_h]})  # fmt: skip
        drawn[name] = own, random[best], best
    save(surface_curves(drawn), DOCS / "figures" / "real-topographies.png", dpi=80)
    return {"surfaces": rows}


def normalised(curves: list[Any]) -> np.ndarray:
    """Mean displacement at shares of the full friction, over that of full sliding."""
    u = np.mean([np.asarray(c.u) for c in curves], axis=0)
    return np.asarray(u / u[-1])


def spectral_hurst(lines: np.ndarray, spacing: float) -> float:
    """From the slope of the mean power spectrum of lines, without its lowest waves and its upper three quarters."""
    q, power = welch(lines, 1.0 / spacing, nperseg=lines.shape[1], detrend="linear", axis=1)
    inside = slice(4, lines.shape[1] // 8)
    slope = np.polyfit(np.log(q[inside]), np.log(power.mean(axis=0)[inside]), 1)[0]
    return float(-0.5 * (slope + 1.0))


@styled
def surface_curves(drawn: dict[str, Any]) -> Any:
    """Static creep of measured lines and of the random lines nearest to them."""
    made, axes = figure(1, len(drawn), width=10.0, height=3.6)
    loads = np.asarray(default_loads())
    for axis, (name, (own, near, best)) in zip(axes[0], drawn.items(), strict=True):
        axis.plot(own, loads, color=DARK, label="mean of measured lines")
        axis.plot(near, loads, "--", color=MIDDLE, label=f"random lines, H = {best:.2f}")
        axis.set(xlabel="u / u_max", ylabel="force / full friction", title=plain(name.replace(", ", "\n")))
        axis.legend(fontsize="x-small")
    return made


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


@styled
def hysteresis(base: Any, last: Any, title: str) -> Any:
    """Force against displacement of a run, measured and by the first and the last model, and what either leaves."""
    problem = base.problem
    chosen = len(problem.runs) // 2
    own = np.flatnonzero(problem.run == chosen)
    run = problem.runs[chosen]
    x, length = scaled_to(run.mean @ run.x, "m")
    force, newton = scaled_to(base.forces.measured[own], "N")
    made, axes = figure(1, 2, width=10.0, height=4.0)
    left, right = axes[0]
    left.plot(x, force, ".", ms=3, color=DARK, label="measured")
    for fit, color, line in ((base, LIGHT, "-"), (last, MIDDLE, "--"))[: 1 + (last is not base)]:
        share = force / base.forces.measured[own]
        names = ["base", *(e.tag for e in fit.problem.composition.effects)]
        left.plot(x, force - fit.marginal[own] * share, line, color=color, lw=1.0, label=plain("\n+ ".join(names)))
        right.plot(run.at - run.at[0], 100.0 * fit.marginal[own] / base.strength, line, color=color, lw=1.0)
    left.set(xlabel=f"displacement / {length}", ylabel=f"force / {newton}", title=plain(title))
    right.set(xlabel="time / s", ylabel="measured - model / % of the strength", title=plain(run.name))
    made.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="x-small")
    return made


def scaled_to(values: np.ndarray, unit: str) -> tuple[np.ndarray, str]:
    """Values in a unit with a prefix that suits them."""
    k, name = scaled(values, unit)
    return values * k, name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default=os.environ.get("STICKSLIP_REAL_DATA", str(DEFAULT)))
    parser.add_argument("--only", nargs="*", help="parts or records to make anew; the others stay")
    asked = parser.parse_args()
    data = Path(asked.folder).resolve()
    if not data.is_dir():
        raise SystemExit(f"there is no folder {data}; name it, or set STICKSLIP_REAL_DATA")
    (DOCS / "figures").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        made = (paper, together, robot, fault, classroom, prescribed, topographies)
        only = asked.only
        parts = {f.__name__: f(data, work) for f in made if only is None or f.__name__ in only}
        single = {n: diagnosed(n, data / f, work / n) for n, f in PRESCRIBED.items() if only and n in only}
    head = {"version": __version__, "date": date.today().isoformat(), "command": "python docs/make_real_data.py"}
    for name in parts:
        parts[name] |= head
    path = DOCS / "results" / "real_data.json"
    known = json.loads(path.read_text(encoding="utf-8")) if asked.only is not None else {}
    for name, record in single.items():
        known["prescribed"]["records"][name] = {**record, **head}
    text = json.dumps({**known, **head, **parts}, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
