"""The rough line against a boundary-element solution of the surface: ``docs/results/boundary_element.json``, picture.

    pip install tamaas        # nothing else of this repository needs it
    python docs/make_boundary_element.py
    python docs/make_boundary_element.py --draw        # the picture alone, from the numbers; without tamaas

Lengths in units of the rms height h (heights, depth) and of the length L (in the plane), forces in E* L h: elastic
half-spaces have no other scale. Surface and line have the same spectrum, the same longest wave L and the same shortest
wave 2 L/N. The surface is periodic; depth is the way of its mean plane after the first touch.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip.physics.contact import Moduli, RoughLines, static_contact
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, MIDDLE, figure, logarithmic, styled
from tests.kept_results import keep, kept

OUT = ROOT / "docs" / "paper"
N = 256
SURFACES, LINES = 8, 200
HURST = (0.3, 0.5, 0.7, 0.9)
FORCES = np.geomspace(0.02, 2.0, 9)
PAPER = 0.31 / (1.1538e11 * 20e-6 * 2.46e-6)


def surface(hurst: float, seed: int) -> np.ndarray:
    """A periodic self-affine surface of unit rms height with random phases and fixed amplitudes."""
    rng = np.random.default_rng(seed)
    k = np.fft.fftfreq(N, 1.0 / N)
    radius = np.hypot(k[:, None], k[None, :])
    inside = (radius >= 1) & (radius <= N / 2)
    amplitude = np.where(inside, np.maximum(radius, 1.0) ** -(hurst + 1.0), 0.0)
    noise = np.fft.fft2(rng.standard_normal((N, N)))
    z = np.fft.ifft2(amplitude * noise / np.maximum(np.abs(noise), 1e-300)).real
    z -= z.mean()
    return z / z.std()


def approach(heights: np.ndarray, forces: np.ndarray, exact: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Depth after first touch and share of the area in contact, at each force."""
    import tamaas as tm

    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0  # E* = 1
    solver = tm.PolonskyKeerRey(model, heights, 1e-8 if exact else 1e-6)
    solver.max_iter = 5000
    depth, area = [], []
    for force in forces:
        error = solver.solve(float(force))  # mean pressure: the area is one
        if not error < 1e-3:
            raise SystemExit(f"the boundary-element solution did not converge: {error:g}")
        gap = model.displacement - heights
        gap -= gap.min()  # the surface touches where it carries load
        depth.append(float(heights.max() - heights.mean() - gap.mean()))
        area.append(float((model.traction > 0).mean()))
    return np.array(depth), np.array(area)


def hertz() -> float:
    """Largest pressure over Hertz's for a small sphere in the periodic cell."""
    import tamaas as tm

    x = (np.arange(N) + 0.5) / N - 0.5
    radius = 1.0
    heights = -(x[:, None] ** 2 + x[None, :] ** 2) / (2 * radius)
    force = 4.0 / 3.0 * np.sqrt(radius) * (5e-3) ** 1.5
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], [N, N])
    model.E, model.nu = 1.0, 0.0
    tm.PolonskyKeerRey(model, heights, 1e-8).solve(force)
    pressure = np.asarray(model.traction)
    return float(pressure.max() / (3 * force / (2 * np.pi * radius * 5e-3)))


def line(hurst: float, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of the lines: mean depth and share of the length in contact."""
    table = RoughLines(hurst, 1.0, 1.0, n_springs=N, lines=LINES).indentation
    made = [static_contact(table, float(f), 1.0, Moduli(1.0, 1.0)) for f in forces]
    return np.array([np.mean(c.depth) for c in made]), np.array([np.mean(c.contact_share) for c in made])


def slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def compare() -> dict[str, Any]:
    out = {}
    for hurst in HURST:
        solved = [approach(surface(hurst, seed), FORCES) for seed in range(SURFACES)]
        depth, area = (np.mean([s[i] for s in solved], axis=0) for i in (0, 1))
        mdr, share = line(hurst, FORCES)
        middle = np.sqrt(FORCES[1:] * FORCES[:-1])
        stiff = {name: np.diff(FORCES) / np.diff(d) for name, d in (("surface", depth), ("line", mdr))}
        out[f"{hurst:g}"] = {
            "surface": {"depth": depth.tolist(), "area": area.tolist(), "stiffness": stiff["surface"].tolist()},
            "line": {"depth": mdr.tolist(), "length": share.tolist(), "stiffness": stiff["line"].tolist()},
            "exponent": {name: slope(middle, k) for name, k in stiff.items()},
            "scatter": float(
                np.std([s[0] for s in solved], axis=0, ddof=1)[len(FORCES) // 2] / depth[len(FORCES) // 2]
            ),
        }
        print(hurst, json.dumps(out[f"{hurst:g}"]))
    return out


@styled
def draw(found: dict[str, Any]) -> Figure:
    made, axes = figure(1, 2, width=10.5, height=4.2)
    middle = np.sqrt(FORCES[1:] * FORCES[:-1])
    for (hurst, part), mark, line in zip(found.items(), "os^D", ("-", "--", "-.", ":"), strict=True):
        axes[0, 0].plot(part["surface"]["depth"], FORCES, mark, color=DARK, ms=5, label=f"H = {hurst}, surface")
        axes[0, 0].plot(part["line"]["depth"], FORCES, line, color=MIDDLE, label=f"H = {hurst}, line")
        axes[0, 1].plot(middle, part["surface"]["stiffness"], mark, color=DARK, ms=5)
        axes[0, 1].plot(middle, part["line"]["stiffness"], line, color=MIDDLE)
    for ax in axes[0]:
        logarithmic(ax, "x")
        logarithmic(ax, "y")
    axes[0, 0].set(xlabel="depth / h_rms", ylabel="force / (E* L h_rms)", title="force against depth")
    axes[0, 1].set(xlabel="force / (E* L h_rms)", ylabel="stiffness / (E* L)", title="stiffness against force")
    axes[0, 1].axvline(PAPER, color=DARK, ls=":", lw=1, label="force of the paper's contacts")
    axes[0, 1].legend(fontsize=8, loc="lower right")
    axes[0, 0].legend(fontsize=8)
    return made


def main() -> None:
    if sys.argv[1:] == ["--draw"]:
        known = kept("boundary_element")
        save(draw(known["by_hurst"]), OUT / "boundary_element.png")
        return
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    began = time.perf_counter()
    ratio = hertz()
    print("Hertz", ratio)
    found = compare()
    save(draw(found), OUT / "boundary_element.png")
    keep(
        "boundary_element", "python docs/make_boundary_element.py", N=N, surfaces=SURFACES, lines=LINES,
        paper_force=PAPER, hertz=ratio, tamaas=tm.__version__, forces=FORCES.tolist(), by_hurst=found,
    )  # fmt: skip
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
