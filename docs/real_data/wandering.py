"""A simulated slider whose friction wanders, beside the measured one: are its slips as irregular?"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.inference.forecast.levels import levels, wandering
from stickslip.show.plots.style import DARK, MIDDLE, figure, styled

from .campaigns import DOCS, campaign, keep
from .paper_slider import PAPER, PAPER_RIG

SCENARIO = DOCS.parent / "scenarios" / "paper_slider_wandering.toml"
SHOWN = (120.0, 200.0)  # s


def paper_wandering(data: Path, work: Path) -> dict[str, Any]:
    """Both records by the same reading: slips, recurrence, and how levels of successive slips hang together."""
    file = campaign(work, "paper", "Paper on paper", PAPER_RIG.format(k=168), PAPER.format(k=168, v=42, data=data))
    (measured,) = load_traces(load_campaign(file))
    run = ss.simulate(ss.load_scenario(SCENARIO))
    simulated = Trace.from_arrays(
        "simulated", time=run.time.values, spring_force=run.spring_force.values, drive_velocity=42e-6,
        spring_stiffness=168.0,
    )  # fmt: skip
    traces = {"measured": measured, "simulated": simulated}
    rows, slips = {}, {}
    for name, trace in traces.items():
        found = segment(trace)
        read = levels(trace, found)
        slips[name] = np.sort(read.slip.values)
        rows[name] = {
            "slips": int(read.slip.size), "slip": float(read.slip.mean()), "slip_std": float(read.slip.std()),
            "recurrence": float(read.recurrence.mean()), "recurrence_std": float(read.recurrence.std()),
            **asdict(wandering(read)),
        }  # fmt: skip
    keep(picture(traces, slips), "real-paper-wandering")
    return {"records": rows}


@styled
def picture(traces: dict[str, Trace], slips: dict[str, np.ndarray]) -> Any:
    """Force of the spring of both over the same stretch of time, and the slips of both in the order of their size."""
    made, axes = figure(1, 3, width=11.0, height=3.4)
    for ax, (name, trace), color in zip(axes[0], traces.items(), (DARK, MIDDLE), strict=False):
        inside = (trace.time >= SHOWN[0]) & (trace.time <= SHOWN[1])
        assert trace.spring_force is not None
        ax.plot(trace.time[inside], 1e3 * trace.spring_force[inside], color=color, lw=0.7)
        ax.set(xlabel="time / s", ylabel="force of the spring / mN", title=name)
    for name, color in zip(slips, (DARK, MIDDLE), strict=True):
        share = (np.arange(slips[name].size) + 0.5) / slips[name].size
        axes[0, 2].plot(1e6 * slips[name], share, color=color, lw=1.4, label=name)
    axes[0, 2].set(
        xlabel="slip / µm", ylabel="share of slips that are smaller", title="sizes of slips", ylim=(0.0, 1.0)
    )
    axes[0, 2].legend(fontsize="x-small")
    low, high = (min(a.get_ylim()[0] for a in axes[0, :2]), max(a.get_ylim()[1] for a in axes[0, :2]))
    for ax in axes[0, :2]:
        ax.set_ylim(low, high)
    return made
