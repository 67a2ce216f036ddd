"""Pictures of the force along the measured motion, drawn from a run folder alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from ..plots.style import DARK, LIGHT, MIDDLE, figure, label, medians, plain, scaled, signed_log, styled
from .figures import series

if TYPE_CHECKING:
    import xarray

_AGAINST = (
    ("displacement", "m", "displacement"),
    ("velocity", "m/s", "velocity of the block"),
    ("spring_force", "N", "spring force"),
    ("time_in_contact", "s", "time since the arrest"),
    ("time", "s", "time in the run"),
)


def runs_of(data: xarray.Dataset) -> list[int]:
    """Numbers of the runs whose force the data hold."""
    return [i for i in range(len(data.variables)) if f"force{i}_time" in data]


@styled
def cycle_picture(data: xarray.Dataset, names: list[str]) -> Figure:
    """Measured force and the model's in one cycle of every run, against time from the onset; the difference below."""
    runs = runs_of(data)[:4]
    made, axes = figure(2, len(runs), width=max(3.4 * len(runs), 6.0), height=5.2)
    for column, r in enumerate(runs):
        top, low = axes[0, column], axes[1, column]
        event = data[f"force{r}_event"].values
        chosen = int(np.median(np.unique(event)))
        own = np.flatnonzero(event == chosen)
        own = own[np.argsort(data[f"force{r}_time"].values[own])]
        t, measured, model, residual, floor, before = (
            data[f"force{r}_{name}"].values[own]
            for name in ("time", "measured", "model", "residual", "floor", "base_residual")
        )
        t = t - t[0]
        k, unit = scaled(measured, "N")
        top.plot(t, measured * k, color=DARK, lw=1.6, label="measured")
        top.plot(t, model * k, color=MIDDLE, ls="--", lw=1.2, label="model")
        top.set_title(plain(f"{names[r] if r < len(names) else r}, cycle {chosen + 1}", 28), fontsize=9)
        k, small = scaled(np.concatenate([residual, before]), "N")
        low.fill_between(t, -2 * floor * k, 2 * floor * k, color=LIGHT, alpha=0.35, lw=0, label="two floors")
        if not np.allclose(before, residual):
            low.plot(t, before * k, color=LIGHT, lw=1.0, label="base model")
        low.plot(t, residual * k, color=MIDDLE, lw=1.0, label="last model")
        low.set(xlabel="time in the cycle / s")
        if column == 0:
            top.set_ylabel(f"force of the contact / {unit}")
        low.set_ylabel(f"measured - model / {small}")
    axes[0, 0].legend(loc="lower right", fontsize=8)
    axes[1, 0].legend(loc="best", fontsize=8)
    return made


@styled
def residual_picture(data: xarray.Dataset, names: list[str]) -> Figure:
    """Residual force of the base over its floor against what it may depend on, by run, with running medians."""
    runs = runs_of(data)
    made, axes = figure(1, len(_AGAINST), width=3.1 * len(_AGAINST), height=3.6)
    for ax, (name, unit, text) in zip(axes[0], _AGAINST, strict=True):
        values = [data[f"force{r}_{name}"].values for r in runs]
        k, shown = scaled(np.concatenate(values), unit)
        for i, (r, x) in enumerate(zip(runs, values, strict=True)):
            z = data[f"force{r}_base_residual"].values / data[f"force{r}_floor"].values
            medians(ax, x * k, z, i, plain(names[r] if r < len(names) else str(r), 20))
        if name in ("velocity", "time_in_contact"):
            signed_log(ax, np.concatenate(values) * k)
        ax.axhline(0.0, color=LIGHT, lw=0.8)
        ax.set(xlabel=label(text, shown), ylim=(-4, 4))
    axes[0, 0].set_ylabel("residual force / floor")
    made.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=max(len(runs), 1), fontsize=8
    )
    return made


@styled
def backbone_picture(data: xarray.Dataset, law: dict[str, Any]) -> Figure:
    """The measured backbone of the contact with its band, the nearest rough lines, and the power law fitted to it."""
    u, force, std, fitted = (series(data, "backbone", n) for n in ("displacement", "force", "std", "law"))
    assert u is not None and force is not None and std is not None and fitted is not None
    line, later, sooner = (series(data, "backbone", n) for n in ("line", "line_later", "line_sooner"))
    made, axes = figure(1, 2, width=9.0, height=3.6)
    k, unit = scaled(force, "N")
    for ax, scale in zip(axes[0], ("linear", "log"), strict=True):
        m, length = scaled(u, "m")
        ax.fill_between(u * m, (force - 2 * std) * k, (force + 2 * std) * k, color=LIGHT, alpha=0.5, lw=0)
        ax.plot(u * m, force * k, color=DARK, lw=1.6, label="measured, two standard deviations")
        ax.plot(u * m, fitted * k, color=MIDDLE, ls="--", lw=1.2, label="power law 1 - (1 - u/u_max)^p")
        if line is not None and later is not None and sooner is not None:
            ax.plot(
                u * m, line * k, color=DARK, ls=":", lw=1.2, label="nearest rough lines, and how such contacts differ"
            )
            for edge in (later, sooner):
                ax.plot(u * m, edge * k, color=DARK, ls=":", lw=0.6, alpha=0.6)
        ax.set(xlabel=f"displacement from the force-free contact / {length}", ylabel=f"force / {unit}")
        if scale == "log":
            ax.set(xscale="log", yscale="log", ylim=(max(1e-4 * force[-1] * k, 1e-300), None))
        else:
            ax.set_xlim(0.0, 1.6 * float(law["u_max"]) * m)
    axes[0, 0].legend(loc="lower right", fontsize=8)
    return made
