"""Pictures of a fit: ``fit.plot.force()`` and the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, nearest
from ..show.plots.style import DARK, LIGHT, MIDDLE, label, medians, panels, plain, scaled, signed_log, styled

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .fit import Fit

AGAINST = {
    "age": "time_in_contact",
    "time": "time",
    "place": "displacement",
    "velocity": "velocity",
    "spring force": "spring_force",
    "slip path": "slip_path",
    "load point": "load_point",
    "event": "event",
}
NAMED = {"age": "time in contact", "place": "displacement", "event": "number of the event"}
WIDEST = 4.0  # floors that are shown


class FitPlots:
    """The pictures of a fit, each of which returns its matplotlib figure.

    All but :meth:`browse` take ``ax``: axes to draw in, of a figure of one's own; texts, grid and frames are by
    ``rcParams``.
    """

    def __init__(self, fit: Fit) -> None:
        self._fit = fit

    @styled
    def trace(self, run: str | None = None, *, ax: Axes | None = None) -> Figure:
        """Displacement and load point of a run (default the first), with onsets."""
        name = self._run(run)
        prepared = self._fit.climbed.prepared
        number = [k.name for k in prepared.runs].index(name)
        measured, events = prepared.traces[number], prepared.segmentations[number].events
        made, (ax,) = panels(ax, width=8.0, height=3.4)
        every = slice(None, None, max(measured.time.size // 20000, 1))
        assert measured.displacement is not None and measured.drive is not None
        k, unit = scaled(measured.displacement, "m")
        t = measured.time[every]
        ax.plot(t, measured.drive.position(t) * k, color=MIDDLE, ls="--", lw=1.0, label="load point")
        ax.plot(t, measured.displacement[every] * k, color=DARK, lw=1.0, label="block")
        onsets = np.array([e.t_onset for e in events])
        at = np.interp(onsets, measured.time, measured.displacement)
        ax.plot(onsets, at * k, "v", ms=4, color=MIDDLE, label="onset")
        ax.set(xlabel="time / s", ylabel=f"displacement / {unit}", title=plain(name))
        ax.legend(loc="upper left")
        return made

    @styled
    def force(self, run: str | None = None, event: int | None = None, *, ax: Sequence[Axes] | None = None) -> Figure:
        """Measured and model force in one cycle, the difference below with the band that noise and scatter allow.

        Args:
            run: default the first. event: number of the cycle in the run from 0; default the middle one.
            ax: two axes, the one for the difference last.
        """
        own, name, number = self._cycle(run, event)
        made, (top, low) = panels(ax, rows=2, width=8.0, height=5.2)
        t = own.time.values - own.time.values[0]
        k, unit = scaled(own.measured.values, "N")
        top.plot(t, own.measured.values * k, color=DARK, lw=1.6, label="measured")
        model = plain(" + ".join(self._fit.parts))
        top.plot(t, own.model.values * k, color=MIDDLE, ls="--", lw=1.2, label=model)
        top.set(ylabel=f"force of the contact / {unit}", title=plain(f"{name}, cycle {number + 1}"))
        top.legend(loc="lower right")
        k, unit = scaled(own.residual.values, "N")
        band = expected_band(own) * k
        low.fill_between(t, -band, band, color=LIGHT, alpha=0.35, lw=0, label="two standard deviations")
        low.plot(t, own.residual.values * k, color=MIDDLE, lw=1.0)
        low.set(xlabel="time in the cycle / s", ylabel=f"measured - model / {unit}")
        low.legend(loc="best")
        return made

    @styled
    def browse(self, run: str | None = None) -> Figure:
        """:meth:`force` of one cycle after the other, with a slider: ``fit.plot.browse("v050")``.

        A window opens with ``matplotlib.pyplot.show()``; a notebook needs ``%matplotlib widget``.

        Args:
            run: default all runs, one after the other.

        Returns:
            The figure, whose attribute ``slider`` a script can move: ``figure.slider.set_val(3)`` is the third cycle.
        """
        from matplotlib import pyplot
        from matplotlib.widgets import Slider

        data = self._fit.force
        names = list(dict.fromkeys(data.run.values)) if run is None else [self._run(run)]
        cycles = [(name, int(e)) for name in names for e in np.unique(data.event.values[data.run.values == name])]
        made: Any = pyplot.figure(figsize=(8.0, 5.8), layout="constrained")
        top, low, below = made.subplots(3, 1, height_ratios=(1.0, 1.0, 0.08))

        @styled
        def show(number: float) -> Figure:
            for ax in (top, low):
                ax.clear()
            drawn = self.force(*cycles[int(number) - 1], ax=(top, low))
            made.canvas.draw_idle()
            return drawn

        count = len(cycles)
        # kept with the figure, for matplotlib keeps no widget alive
        made.slider = Slider(
            below, "cycle", 0.5, count + 0.5, valinit=1, valstep=np.arange(1, count + 1), valfmt=f"%d of {count}",
            color=LIGHT, initcolor="none",
        )  # fmt: skip
        made.slider.on_changed(show)
        return show(1)

    @styled
    def creep(self, run: str | None = None, event: int | None = None, *, ax: Axes | None = None) -> Figure:
        """Displacement before an onset against the time to it, measured and where the model would be in balance."""
        own, name, number = self._cycle(run, event)
        own = own.isel(point=np.flatnonzero(own.phase.values == "creep"))
        made, (ax,) = panels(ax, width=7.0, height=3.8)
        runs = {k.name: k for k in self._fit.climbed.prepared.runs}
        spring = runs[name].stiffness or self._fit.values["rig.spring_stiffness"]
        x, model, t = own.displacement.values, balanced(own, spring), own.time.values
        k, unit = scaled(x - x[0], "m")
        ax.plot(t - t[-1], (x - x[0]) * k, color=DARK, lw=1.6, label="measured")
        ax.plot(t - t[-1], (model - x[0]) * k, color=MIDDLE, ls="--", lw=1.2, label="model")
        title = plain(f"{name}, cycle {number + 1}")
        ax.set(xlabel="time before the onset / s", ylabel=f"creep / {unit}", title=title)
        ax.legend(loc="upper left")
        return made

    @styled
    def residual(self, against: str = "age", *, ax: Axes | None = None) -> Figure:
        """Residual force over its floor against a variable, by run, with medians: ``fit.plot.residual("place")``.

        Args:
            against: "age" (time in contact), "time", "place", "velocity", "spring force", "slip path" (from the
                start of the run), "load point" or "event".
            ax: axes to draw in; default a figure of its own.
        """
        if against not in AGAINST:
            raise InputError("no such variable", key="against", value=against, hint=nearest(against, list(AGAINST)))
        data = self._fit.force
        kept = data.isel(point=np.flatnonzero(~data.left_out.values))
        own_figure = ax is None
        made, (ax,) = panels(ax, width=7.5, height=4.2)
        name = AGAINST[against]
        x, z = kept[name].values, kept.residual.values / kept.floor.values
        k, unit = (1.0, "") if name == "event" else scaled(x, str(kept[name].attrs["units"]))
        for i, run in enumerate(dict.fromkeys(kept.run.values)):
            own = kept.run.values == run
            medians(ax, x[own] * k, z[own], i, plain(run, 24), bold=True)
        if name in ("velocity", "time_in_contact"):
            signed_log(ax, x * k)
        ax.axhline(0.0, color=LIGHT, lw=0.8)
        ax.set(xlabel=label(NAMED.get(against, against), unit), ylabel="residual force / floor", ylim=(-WIDEST, WIDEST))
        if own_figure:
            made.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
        else:
            ax.legend()
        return made

    @styled
    def backbone(self, *, ax: Axes | None = None) -> Figure:
        """The contact's backbone as measured, with its band, and a rough contact's law."""
        data = self._fit.backbone
        made, (ax,) = panels(ax, width=7.0, height=4.2)
        u, f, std = data.displacement.values, data.force.values, data["std"].values
        m, length = scaled(u[u < 2.0 * data.attrs["u_max"]], "m")
        k, unit = scaled(f, "N")
        ax.fill_between(u * m, (f - 2 * std) * k, (f + 2 * std) * k, color=LIGHT, alpha=0.5, lw=0)
        ax.plot(u * m, f * k, color=DARK, lw=1.6, label="measured, two standard deviations")
        law = "rough contact: 1 - (1 - u/u_max)^p"
        ax.plot(u * m, data.law.values * k, color=MIDDLE, ls="--", lw=1.2, label=law)
        ax.set(xlabel=f"displacement from the force-free contact / {length}", ylabel=f"force / {unit}")
        ax.set_xlim(0.0, 1.6 * data.attrs["u_max"] * m)
        ax.legend(loc="lower right")
        return made

    @styled
    def errors(self, *, ax: Axes | None = None) -> Figure:
        """Error by phase of the cycle and run."""
        from matplotlib.colors import TwoSlopeNorm

        found: Any = self._fit.errors
        values = found.to_numpy(float)
        made, (ax,) = panels(ax, width=1.8 + 1.1 * values.shape[1], height=1.2 + 0.5 * values.shape[0])
        norm = TwoSlopeNorm(1.0, 0.0, max(float(np.nanmax(values)), 2.0))
        ax.imshow(values, cmap="PuOr_r", norm=norm, aspect="auto")
        ax.grid(False)
        ax.set_xticks(range(values.shape[1]), [plain(c, 16) for c in found.columns], rotation=30, ha="right")
        ax.set_yticks(range(values.shape[0]), list(found.index))
        for (i, j), v in np.ndenumerate(values):
            ax.text(j, i, f"{v:.2f}", ha="center", va="center", color=DARK if norm(v) < 0.8 else "white")
        ax.set_title("error in floors")
        return made

    def _run(self, run: str | None) -> str:
        names = [k.name for k in self._fit.climbed.prepared.runs]
        if run is None:
            return names[0]
        if run not in names:
            raise InputError("no run of that name was fitted", key="run", value=run, hint=nearest(run, names))
        return run

    def _cycle(self, run: str | None, event: int | None) -> tuple[xarray.Dataset, str, int]:
        name = self._run(run)
        data = self._fit.force
        numbers = np.unique(data.event.values[data.run.values == name])
        chosen = int(np.median(numbers)) if event is None else event
        if chosen not in numbers:
            raise InputError("no such cycle", key="event", value=event, allowed=f"0 to {numbers.max()}")
        return one_cycle(data, name, chosen), name, chosen


def one_cycle(data: xarray.Dataset, run: str, event: int) -> xarray.Dataset:
    """The points of one cycle in :attr:`stickslip.Fit.force`, in their order of time."""
    own = np.flatnonzero((data.run.values == run) & (data.event.values == event))
    return data.isel(point=own[np.argsort(data.time.values[own])])


def expected_band(cycle: xarray.Dataset) -> np.ndarray:
    """Two floors at every point of a cycle of :attr:`stickslip.Fit.force` (N), as drawn around zero.

    Points that are left out have the strength of the contact as their floor; they take that of the points beside them.
    """
    t, floor, used = cycle.time.values, cycle.floor.values, ~cycle.left_out.values
    return 2.0 * (np.interp(t, t[used], floor[used]) if used.any() else floor)


def balanced(own: xarray.Dataset, spring: float) -> np.ndarray:
    """Displacement (m) at which the model's contact and the spring would be in balance, as far as the tangent tells."""
    stiffness = np.maximum(own.stiffness.values, 0.0) + spring
    return np.asarray(own.displacement.values + own.residual.values / stiffness)
