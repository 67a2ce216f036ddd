"""Reproduce Grzemba 2014: figures and ``docs/results/paper.json``, from which docs/paper.md takes every number.

    python docs/make_paper.py

The rigs are those of scenarios/grzemba2014; takes about a minute.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.figure import Figure
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip.cli import run as command
from stickslip.data.campaign import Rig
from stickslip.data.campaign.template import campaign_text
from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.inference.fit.creep_process import V_LIM, CreepProcess, creep_processes
from stickslip.inference.fit.static import CreepFit, StaticFit, fit_static
from stickslip.inference.fit.static_table import StaticRig, static_table, virtual_curve
from stickslip.inference.force.backbone import Backbone
from stickslip.inference.force.geometry import rough_line
from stickslip.physics.contact import RoughLines, default_loads, power_law_bank
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, styled
from stickslip.simulation.scenario import load_scenario, simulate, static_creep
from stickslip.simulation.scenario.load import Scenario
from tests.kept_results import keep

RIGS = ROOT / "scenarios" / "grzemba2014"
OUT = ROOT / "docs" / "paper"
PROCESSES = 27
PAPER = {"share": 17 / 27, "hurst": 0.24, "h_rms": 1.87e-6, "example_hurst": 0.3, "example_h_rms": 2.46e-6}
PROCEDURES: dict[str, dict[str, str]] = {
    "paper": {"align": "paper", "form": "paper", "sampling": "uniform"},
    "consistent": {"align": "consistent", "form": "exact", "sampling": "log"},
}
STYLES = (("-", DARK), ("--", MIDDLE), (":", DARK), ("-.", MIDDLE), ("-", LIGHT))


def trace_of(data: xarray.Dataset, velocity: float, name: str) -> Trace:
    """What the vibrometer saw of a simulated run."""
    t = data["time"].values
    drive = Drive.constant(velocity, 0.0, float(t[-1]))
    return Trace(name=name, time=t, displacement=data["reading"].values, drive=drive, virgin=True, resolution=7.91e-9)


def rig_of(scenario: Scenario) -> StaticRig:
    contact, block = scenario.file.contact, scenario.file.block
    return StaticRig(contact.normal_force, contact.friction_coefficient, 4, block.spring_stiffness)


# --- Fig. 2 -----------------------------------------------------------------------------------------------------------


def fig2() -> dict[str, Any]:
    scenario = load_scenario(RIGS / "fig2.toml")
    assert scenario.file.sweep is not None and scenario.file.sweep.values is not None
    hursts = [float(h) for h in scenario.file.sweep.values]
    curves = {h: static_creep(scenario.changed(contact__H=h)) for h in hursts}
    save(_fig2(curves), OUT / "fig2.png")
    at = {f"{h:g}": float(np.interp(0.5, c.tau, c.u / c.u[-1])) for h, c in curves.items()}
    late = {f"{h:g}": float(np.interp(0.99, c.tau, c.u / c.u[-1])) for h, c in curves.items()}
    loads = {}
    for load in (0.03, 0.1, 0.31, 1.0):
        c = static_creep(scenario.changed(contact__normal_force=load))
        loads[f"{load:g}"] = float(np.interp(0.5, c.tau, c.u / c.u[-1]))
    number = {}
    for h in (0.3, 0.7):
        for n in (1024, 4096, 16384):
            c = static_creep(scenario.changed(contact__H=h, contact__springs=n))
            number[f"{h:g}, {n}"] = {"w": float(np.interp(0.5, c.tau, c.u / c.u[-1])), "u_max": float(c.u[-1])}
    return {"hurst": hursts, "w_half": at, "w_late": late, "w_half_by_load": loads, "by_springs": number}


@styled
def _fig2(curves: dict[float, Any]) -> Figure:
    made, axes = figure(1, 2, width=10.0, height=4.2)
    for (h, c), (line, colour) in zip(curves.items(), STYLES, strict=True):
        w = c.u / c.u[-1]
        look: dict[str, Any] = {"ls": line, "color": colour, "label": f"H = {h:g}"}
        axes[0, 0].plot(c.tau, w, **look)
        axes[0, 1].plot(c.tau, 1.0 - (1.0 - c.tau) ** (h / (h + 1.0)), **look)
    axes[0, 0].set(
        xlabel="share of full friction, F / (µ F_n)", ylabel="u / u_max", title="mean of 100 lines, N = 4096"
    )
    axes[0, 1].set(xlabel="share of full friction, τ", ylabel="u / u_max", title="power law 1 - (1 - τ)^(H/(H+1))")
    axes[0, 0].legend()
    return made


# --- Fig. 4 -----------------------------------------------------------------------------------------------------------


def fig4() -> dict[str, Any]:
    scenario = load_scenario(RIGS / "fig4.toml")
    data = simulate(scenario)
    save(_fig4(data), OUT / "fig4.png")
    return {
        "slip_um": (data["slip"].values * 1e6).tolist(),
        "recurrence_s": data["recurrence"].values[1:].tolist(),
        "creep_nm": (data["creep_before_slip"].values * 1e9).tolist(),
        "peak_velocity_mm_s": (data["peak_velocity"].values * 1e3).tolist(),
        "contact_share": data.attrs["contact_share"],
        "u_max_um": data.attrs["u_max"] * 1e6,
    }


@styled
def _fig4(data: xarray.Dataset) -> Figure:
    made, axes = figure(1, 3, width=12.5, height=3.8)
    t, y = data["time"].values, data["reading"].values
    onset, arrest = data["onset"].values, data["arrest"].values
    axes[0, 0].plot(t, y * 1e6, color=DARK)
    axes[0, 0].set(xlabel="time / s", ylabel="displacement / µm", title="trace")
    panels = ((0.0, onset[0], "creep, virgin contacts"), (arrest[1] + 0.1, onset[2], "creep after a slip"))
    for ax, (begin, end, title) in zip(axes[0, 1:], panels, strict=True):
        part = (t >= begin) & (t <= end)
        start = y[part][0]
        ax.plot(t[part] - end, (y[part] - start) * 1e9, color=DARK)
        ax.set(xlabel="time from the slip / s", ylabel="displacement / nm", title=title)
        creep = float(np.interp(end - 2e-3, t, y) - start) * 1e9
        ax.set_ylim(-0.08 * creep, 1.25 * creep)
    return made


# --- Fig. 5 -----------------------------------------------------------------------------------------------------------


def fig5() -> dict[str, Any]:
    scenario = load_scenario(RIGS / "fig5.toml")
    trace = trace_of(simulate(scenario), 5e-5, "fig5")
    found = segment(trace)
    rig = rig_of(scenario)
    shown, result = {}, {}
    for name, how in PROCEDURES.items():
        processes, _ = creep_processes(trace, found, sampling=how["sampling"])  # type: ignore[arg-type]
        fit = fit_static(processes[:1], rig, align=how["align"], form=how["form"])  # type: ignore[arg-type]
        shown[name] = fit.fits[0]
        result[name] = one(fit.fits[0])
    save(_fig5(shown), OUT / "fig5.png")
    return result


@styled
def _fig5(fits: dict[str, CreepFit]) -> Figure:
    made, axes = figure(1, 3, width=12.5, height=3.8)
    for ax, (name, fit) in zip(axes[0, :2], fits.items(), strict=True):
        p = fit.process
        ax.plot(p.time, p.displacement * 1e9, color=LIGHT, lw=4, label="simulated")
        ax.plot(p.time, fit.model * 1e9, color=DARK, label=f"H = {fit.hurst:.2f}, h_rms = {fit.h_rms * 1e6:.2f} µm")
        ax.set(xlabel="time from the passage of 1 µm/s / s", ylabel="displacement / nm", title=f"{name} procedure")
        ax.legend(loc="upper left")
    for (name, fit), (line, colour) in zip(fits.items(), STYLES, strict=False):
        residual = (fit.model - fit.process.displacement) * 1e9
        axes[0, 2].plot(fit.process.time, residual, ls=line, color=colour, label=name)
    axes[0, 2].set(xlabel="time from the passage of 1 µm/s / s", ylabel="model - data / nm", title="what is left")
    axes[0, 2].legend()
    return made


def one(fit: CreepFit) -> dict[str, float]:
    return {
        "hurst": fit.hurst,
        "h_rms_um": fit.h_rms * 1e6,
        "u_max_um": fit.u_max * 1e6,
        "nrmse": fit.nrmse,
        "creep_nm": fit.process.amplitude * 1e9,
    }


# --- section 3.3 ------------------------------------------------------------------------------------------------------


def contacts(scenario: Scenario, kind: str, seed: int) -> Scenario:
    """The rig with the seeds of one process; ``kind`` says in what its contacts differ from process to process."""
    changes: dict[str, Any] = {"sensor__seed": seed, "contact__seed": seed}
    if kind == "four, exact sensor":
        changes |= {"sensor__resolution": 0.0, "sensor__white": 0.0, "sensor__random_walk": 0.0}
    elif kind == "mean":
        changes |= {"contact__realisation": "mean", "contact__seed": 0}
    elif kind.startswith("one"):
        # four contacts with the same line are one contact under a quarter of everything
        block = scenario.file.block
        changes |= {
            "contact__contacts": 1,
            "block__mass": block.mass / 4,
            "block__spring_stiffness": block.spring_stiffness / 4,
            "block__damping": block.damping / 4,
        }
        if kind == "one, N = 65536":
            changes["contact__springs"] = 65536
    return scenario.changed(**changes)


KINDS = ("mean", "one", "four", "four, exact sensor", "one, N = 65536")


def statistics() -> dict[str, Any]:
    scenario = load_scenario(RIGS / "statistics.toml")
    rig, table = rig_of(scenario), []
    scatter: dict[str, StaticFit] = {}
    for kind in KINDS:
        runs = [simulate(contacts(scenario, kind, seed)) for seed in range(PROCESSES)]
        u_max = np.array([d.attrs["u_max"] for d in runs])
        traces = [trace_of(d, 5e-5, f"{kind} {i}") for i, d in enumerate(runs)]
        segments = [segment(t) for t in traces]
        for event, state in ((0, "virgin"), (1, "after a slip")):
            for name, how in PROCEDURES.items():
                fit, lost = fitted(traces, segments, event, rig, how)
                scatter[f"{kind}, {state}, {name}"] = fit
                row = {"contacts": kind, "state": state, "procedure": name, "left_out": lost, **summary(fit)}
                row["true_u_max_um"] = float(u_max.mean() * 1e6)
                table.append(row)
        if kind == "one":
            limits = [
                {"v_lim_um_s": v * 1e6, **summary(fitted(traces, segments, 0, rig, PROCEDURES["paper"], v)[0])}
                for v in (1e-6, 3e-6, 1e-5, 3e-5)
            ]
    save(_statistics(scatter), OUT / "statistics.png")
    truth = {"hurst": scenario.file.contact.H, "h_rms_um": scenario.file.contact.h_rms * 1e6}
    return {"truth": truth, "table": table, "limits": limits}


def fitted(
    traces: list[Trace], segments: list, event: int, rig: StaticRig, how: dict, v_lim: float = V_LIM
) -> tuple[StaticFit, int]:
    """The fits of one creep process of every trace, and how many traces had none to offer."""
    processes: list[CreepProcess] = []
    for trace, found in zip(traces, segments, strict=True):
        made, _ = creep_processes(trace, found, v_lim=v_lim, sampling=how["sampling"])
        processes += [p for p in made if p.event == event]
    return fit_static(processes, rig, align=how["align"], form=how["form"]), len(traces) - len(processes)


def summary(fit: StaticFit) -> dict[str, Any]:
    """Mean and standard deviation over the satisfactory fits, as in the paper, and of all fits."""
    good, everything = fit.good, fit.fits
    interval = binomtest(len(good), len(everything)).proportion_ci()
    at_bound = sum(bool(f.at_bound) for f in everything)
    out: dict[str, Any] = {
        "processes": len(everything),
        "satisfying": len(good),
        "share": fit.share,
        "share_low": float(interval.low),
        "share_high": float(interval.high),
        "median_nrmse": float(np.median([f.nrmse for f in everything])),
        "at_bound": at_bound,
    }
    for which, fits in (("", good), ("all_", everything)):
        for key, values in (
            ("hurst", [f.hurst for f in fits]),
            ("h_rms_um", [f.h_rms * 1e6 for f in fits]),
            ("u_max_um", [f.u_max * 1e6 for f in fits]),
        ):
            out[f"{which}{key}"] = float(np.mean(values)) if values else None
            out[f"{which}{key}_std"] = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return out


def weakening() -> list[dict[str, float]]:
    """What the weakening of friction does to static fits: mean lines and an exact sensor, so nothing scatters."""
    scenario, rows = load_scenario(RIGS / "statistics.toml"), []
    exact = contacts(scenario, "mean", 0).changed(sensor__resolution=0.0, sensor__white=0.0, sensor__random_walk=0.0)
    for ratio, distance in ((0.85, 1e-6), (0.95, 1e-6), (0.98, 1e-6), (0.85, 4e-6), (0.95, 4e-6)):
        data = simulate(exact.changed(weakening__ratio=ratio, weakening__slip_distance=distance))
        trace = trace_of(data, 5e-5, f"{ratio}, {distance}")
        fit, _ = fitted([trace], [segment(trace)], 0, rig_of(scenario), PROCEDURES["consistent"])
        rows.append({"ratio": ratio, "slip_distance_um": distance * 1e6, **one(fit.fits[0])})
    return rows


@styled
def _statistics(scatter: dict[str, StaticFit]) -> Figure:
    made, axes = figure(2, 3, width=12.5, height=7.2)
    for row, name in enumerate(PROCEDURES):
        for ax, (kind, state) in zip(
            axes[row], (("one", "virgin"), ("four", "virgin"), ("four", "after a slip")), strict=True
        ):
            fits = scatter[f"{kind}, {state}, {name}"].fits
            for good, marker, colour in ((True, "o", DARK), (False, "x", MIDDLE)):
                chosen = [f for f in fits if f.satisfying == good]
                label = "below 2 %" if good else "above"
                ax.plot([f.hurst for f in chosen], [f.h_rms * 1e6 for f in chosen], marker, color=colour, label=label)
            ax.plot(0.24, 1.87, "*", ms=14, mfc="none", mec=MIDDLE, label="truth")
            lines = {"one": "four times one line", "four": "four lines"}[kind]
            logarithmic(ax, "y")
            ax.set(xlim=(0, 1), ylim=(0.2, 30), title=f"{name}: {lines}, {state}")
            ax.set(xlabel="fitted H", ylabel="fitted h_rms / µm")
    axes[0, 0].legend()
    return made


# --- what the scatter comes from -----------------------------------------------------------------------------


def alignment() -> dict[str, Any]:
    """Where the static curve itself passes v_lim, for three springs."""
    table, out = static_table(), {}
    for stiffness in (300.0, 1000.0, 3000.0):
        rig = StaticRig(0.31, 0.21, 4, stiffness)
        u = table.displacement(rig, 0.3, 2.46e-6)
        curve = virtual_curve(rig, 5e-5, table.tau, u)
        i = int(np.flatnonzero(curve.v <= V_LIM)[-1])
        left = 1e3 * (curve.t[-1] - curve.t[i])
        out[f"{stiffness:g}"] = {"w": float(u[i] / u[-1]), "tau": float(table.tau[i]), "before_end_ms": float(left)}
    return out


def realisations() -> dict[str, float]:
    """How u_max differs from line to line at the truth of the statistics."""
    lines = RoughLines(0.24, 1.87e-6, lines=400, seed=1).contact(0.31, 0.21)
    u = np.asarray(lines.u_max)
    return {"u_max_um": float(u.mean() * 1e6), "spread": float(u.std(ddof=1) / u.mean())}


# --- what the dynamic model changes --------------------------------------------------------------------------


def extended() -> dict[str, Any]:
    """The dynamic and the static model against one rig of three velocities and its 27 creep processes."""
    scenario = load_scenario(RIGS / "statistics.toml").changed(drive__events=9)
    velocities = (5e-5, 1e-4, 2e-4)
    runs = [simulate(scenario.changed(drive__velocity=v, sensor__seed=i)) for i, v in enumerate(velocities)]
    traces = [trace_of(d, v, f"v{v * 1e6:.0f}") for d, v in zip(runs, velocities, strict=True)]
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for trace in traces:
            files.append(f"{trace.name}.csv")
            table = np.column_stack([trace.time, trace.displacement])
            header = "time,displacement"
            np.savetxt(Path(folder, files[-1]), table, delimiter=",", header=header, comments="", fmt="%.10g")
        rig = {
            "mass": scenario.file.block.mass,
            "spring_stiffness": scenario.file.block.spring_stiffness,
            "contacts": 4,
            "normal_force": scenario.file.contact.normal_force,
            "friction_coefficient": scenario.file.contact.friction_coefficient,
            "line_length": 20e-6,
        }
        path = Path(folder, "campaign.toml")
        path.write_text(campaign_text(traces, files, rig), encoding="utf-8")
        dynamic = fit_command(path, "inertial")
        paper = fit_command(path, "static", "--align", "paper", "--time", "paper", "--sampling", "uniform")
        static = fit_command(path, "static")
    values = {name: part["value"] for name, part in dynamic["parameters"].items()}
    shape = ("contact.strength", "contact.u_max", "contact.p", "contact.spread")
    bank = power_law_bank(*(values[name] for name in shape), contacts=4)
    grid = np.geomspace(1e-9, 2e-6, 400)
    force = np.asarray(bank.backbone(grid))
    return {
        "true": {
            **own_line(runs[0], velocities[0], rig_of(scenario)),
            "stiffness_N_um": float(np.mean([d.attrs["contact_stiffness"] for d in runs]) * 1e-6),
            "u_half_nm": float(np.mean([half_way(d, v) for d, v in zip(runs, velocities, strict=True)]) * 1e9),
        },
        "dynamic": {
            "hurst": dynamic["backbone"]["rough_line"]["H"],
            "h_rms_um": dynamic["backbone"]["rough_line"]["h_rms"] * 1e6,
            "stiffness_N_um": float(np.asarray(bank.total_stiffness) * 1e-6),
            "u_half_nm": float(np.interp(0.5, force / values["contact.strength"], grid) * 1e9),
        },
        "values": values,
        "ladder": dynamic["ladder"],
        "static": {
            name: static_part(result, rig_of(scenario)) for name, result in (("paper", paper), ("consistent", static))
        },
    }


def own_line(data: xarray.Dataset, velocity: float, rig: StaticRig) -> dict[str, float]:
    """The rough line that the lines of a run behave like together: what a perfect fit would find."""
    u, t = data["static_displacement"].values, data["static_time"].values
    tau = default_loads(400)[1:]
    curve = np.interp(tau, 1000.0 * (velocity * t - u) / data.attrs["friction_force"], u)
    force = tau * rig.friction_force
    known = Rig(normal_force=rig.normal_force, friction_coefficient=rig.friction, contacts=rig.contacts)
    exact = Backbone(curve, force, np.zeros(tau.size), np.zeros((tau.size, tau.size)))
    line = rough_line(exact, known)
    return {"hurst": line.hurst, "h_rms_um": line.h_rms * 1e6}


def half_way(data: xarray.Dataset, velocity: float) -> float:
    """Displacement (m) of the virgin contacts at half of full friction."""
    u, t = data["static_displacement"].values, data["static_time"].values
    return float(np.interp(0.5, 1000.0 * (velocity * t - u) / data.attrs["friction_force"], u))


def fit_command(path: Path, model: str, *more: str) -> dict[str, Any]:
    """`stickslip fit` as a user runs it."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = command(["fit", str(path), "--model", model, "--json", *more])
    if code:
        raise SystemExit(f"stickslip fit {model}: exit code {code}")
    return json.loads(out.getvalue())


def static_part(result: dict[str, Any], rig: StaticRig) -> dict[str, Any]:
    """Of the processes after a slip: medians, and how many fits are satisfactory."""
    later = [f for f in result["static"]["fits"] if "virgin" not in f["note"]]
    table = static_table()
    curves = [table.displacement(rig, f["hurst"], f["h_rms"]) for f in later]
    return {
        "processes": len(later),
        "satisfying": sum(bool(f["satisfying"]) for f in later),
        "hurst": float(np.median([f["hurst"] for f in later])),
        "h_rms_um": float(np.median([f["h_rms"] for f in later]) * 1e6),
        "stiffness_N_um": float(np.median([rig.friction_force * table.tau[1] / u[1] for u in curves]) * 1e-6),
        "u_half_nm": float(np.median([np.interp(0.5, table.tau, u) for u in curves]) * 1e9),
    }


def main() -> None:
    OUT.mkdir(exist_ok=True)
    began = time.perf_counter()
    result: dict[str, Any] = {"paper": PAPER, "v_lim_um_s": V_LIM * 1e6}
    for part in (fig2, fig4, fig5, alignment, realisations, statistics, weakening, extended):
        start = time.perf_counter()
        result[part.__name__] = part()
        print(f"{part.__name__}: {time.perf_counter() - start:.1f} s")
    keep("paper", "python docs/make_paper.py", **rounded(result))
    print(f"{time.perf_counter() - began:.0f} s")


def rounded(thing: Any) -> Any:
    """Numbers with five digits: what follows would change with the machine."""
    if isinstance(thing, dict):
        return {key: rounded(value) for key, value in thing.items()}
    if isinstance(thing, list):
        return [rounded(value) for value in thing]
    return float(f"{thing:.5g}") if isinstance(thing, float) else thing


if __name__ == "__main__":
    main()
