"""Measured surfaces, and whether their lines creep as random lines do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import welch

import stickslip as ss
from stickslip.physics.contact import (
    default_loads,
    equal_bodies,
    from_heights,
    heights_from_scan,
    indentation,
    static_contact,
)
from stickslip.show.plots.style import DARK, MIDDLE, figure, plain, styled

from .campaigns import keep, rms

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
        own = normalised([ss.creep_curve(static_contact(indentation(from_heights(z, spacing)), f, 0.21))
                          for z, f in zip(kept, loads, strict=True)])  # fmt: skip
        random = {
            float(h): normalised([ss.creep_curve(ss.RoughLines(float(h), n_springs=kept[0].size).contact())])
            for h in HURSTS
        }
        off = {h: rms(own - curve) for h, curve in random.items()}
        best = min(off, key=off.__getitem__)
        hurst = spectral_hurst(np.array(kept), spacing)
        nearest_h = float(HURSTS[np.argmin(np.abs(HURSTS - hurst))])
        rows.append({"name": name, "lines": len(kept), "h_rms": height, "hurst": hurst, "best": best,
                     "off_best": off[best], "off": off[nearest_h]})  # fmt: skip
        drawn[name] = own, random[best], best
    keep(surface_curves(drawn), "real-topographies")
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
