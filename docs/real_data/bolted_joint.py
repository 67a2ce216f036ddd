"""The bolted joint: frequency and damping of a mode that rings down, against its amplitude."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from stickslip.inference.force.composition import BESIDE
from stickslip.inference.force.heldout import unseen
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, plain, styled

from .along_the_motion import along_runs, least, strength, told
from .campaigns import FOLDERS, keep, shipped


def bolted_joint(data: Path, work: Path) -> dict[str, Any]:
    """The diagnosis, a linear joint beside it, and every swing."""
    work = work / "bolted-joint"
    work.mkdir()
    first_mode(data / FOLDERS["bolted-joint"], work)
    made = shipped("bolted-joint", data, work).diagnose()
    assert made.found is not None
    fits = [rung.fit for rung in made.found.ladder if rung.fit is not None]
    level, seen = strength(fits[0]), first_and_last(swings(fits))
    forced = sweeps(data / FOLDERS["bolted-joint"])
    keep(amplitudes(seen, forced), "real-bolted-joint")
    return {
        **told("bolted-joint", made), "linear": [v / level for v in linear(fits[0])], "swings": seen, "forced": forced,
        "stuck": [fits[0].values[BESIDE], fits[0].std()[BESIDE]],
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


NEAR = 0.35  # Hz on either side of a resonance


def sweeps(records: Path) -> dict[str, list[float]]:
    """Of every forced sweep at one amplitude: that amplitude (m), frequency (Hz) and loss over 2 (1) of the resonance.

    No fit sees them. At one amplitude the joint is as stiff and damped all along, and the cotangent of the phase is
    ``(f0^2 - f^2) / (2 zeta f0 f)``.
    """
    table = np.genfromtxt(records / "ForcedFrequencyResponses.csv", delimiter=",", skip_header=1, dtype=None)
    out: dict[str, list[float]] = {"amplitude": [], "frequency": [], "damping": []}
    for run in sorted({int(r[1]) for r in table if str(r[0]) == "ResponseControl"}):
        own = np.array([list(r)[2:] for r in table if str(r[0]) == "ResponseControl" and int(r[1]) == run], float)
        f, _, acceleration, phase = own[np.argsort(own[:, 0])].T
        lag = -np.unwrap(phase)
        first = int(np.flatnonzero((lag[:-1] < 0.5 * np.pi) & (lag[1:] >= 0.5 * np.pi))[0])
        resonance = float(np.interp(0.5 * np.pi, lag[first : first + 2], f[first : first + 2]))
        near = np.abs(f - resonance) < NEAR
        along = (resonance**2 - f[near] ** 2) / (2.0 * resonance * f[near])
        out["amplitude"].append(float(np.interp(resonance, f, acceleration)) / (2.0 * np.pi * resonance) ** 2)
        out["frequency"].append(resonance)
        out["damping"].append(float(1.0 / np.polyfit(along, 1.0 / np.tan(lag[near]), 1)[0]))
    return out


def first_and_last(seen: dict[str, Any]) -> dict[str, Any]:
    """Swings as measured, of the base, and of the last model."""
    first = {name: seen[name] for name in ("amplitude", "measured", "base")}
    return first if list(seen)[-1] == "base" else {**first, "last model": list(seen.values())[-1]}


@styled
def amplitudes(seen: dict[str, Any], forced: dict[str, list[float]]) -> Any:
    """Frequency and damping of a swing against its amplitude, measured, of models on parts left out, and forced."""
    made, axes = figure(1, 2, width=10.0, height=4.0)
    x = 1e6 * np.array(seen["amplitude"])
    for axis, what, k, unit in zip(
        axes[0], ("frequency", "damping"), (1.0, 100.0), ("Hz", "% of critical"), strict=True
    ):
        for name, mark, color in zip([n for n in seen if n != "amplitude"], "o^s", (DARK, LIGHT, MIDDLE), strict=False):
            axis.plot(x, k * np.array(seen[name][what]), mark, ms=3, color=color, label=plain(name))
        axis.axhline(k * np.mean(seen["measured"][what]), color=DARK, lw=0.8, ls="--", label="linear joint")
        axis.plot(
            1e6 * np.array(forced["amplitude"]), k * np.array(forced[what]), "+", ms=7, color=DARK, label="forced"
        )
        axis.set(xscale="log", xlabel="amplitude / µm", ylabel=f"{what} / {unit}")
    axes[0][0].legend(fontsize="x-small")
    return made
