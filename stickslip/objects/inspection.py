"""What the runs of a campaign hold: events, repairs, omissions, and what they can tell."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..system.object_repr import facts, table
from ..system.progress import reporting
from ..system.runstore import Run
from .result_base import Savable, Tell, dataset, head

if TYPE_CHECKING:
    import pandas
    import xarray

    from .campaign import Campaign


class Inspection(Savable):
    """The outcome of :meth:`Campaign.inspect`.

    Attributes:
        campaign: what was inspected.
        result: plain data, as in ``result.json``.
        variables: arrays behind the pictures, as ``(dimension, values, attributes)``.
    """

    def __init__(self, campaign: Campaign, result: dict[str, Any], variables: dict[str, tuple]) -> None:
        self.campaign, self.result, self.variables = campaign, result, variables

    @property
    def can(self) -> list[str]:
        """What these data can tell, in sentences."""
        return list(self.result["can"])

    @property
    def cannot(self) -> list[str]:
        """What these data cannot tell, in sentences."""
        return list(self.result["cannot"])

    @property
    def findings(self) -> list[str]:
        """What the motion contradicts of the file, with the value that the motion gives."""
        return [found["sentence"] for found in self.result["rig"]]

    @cached_property
    def events(self) -> pandas.DataFrame:
        """A row for each slip (SI) with onset, recurrence, slip, peak velocity, ringing and what else was measured."""
        keys = ("t_onset", "recurrence", "hold_time", "slip", "peak_velocity", "rise_time", "overshoot",
                "ring_frequency", "decay_time")  # fmt: skip
        rows: dict[Any, dict[str, Any]] = {}
        for trace in self.result["traces"]:
            for event in trace["events"]:
                own = {f"{key} ({trace['units'][key]})": event[key] for key in keys}
                rows[len(rows)] = {"run": trace["name"], "slip number": event["index"] + 1, **own}
        return table(rows, "event")

    @cached_property
    def arrays(self) -> xarray.Dataset:
        """Every run thinned for pictures, with its creep and slip."""
        from ..show.report.excerpts import reduced_record

        more: dict[str, tuple] = {}
        for i, (trace, found) in enumerate(zip(self.campaign.traces, self.campaign.events, strict=True)):
            more |= reduced_record(trace, found, i)
        return dataset(self.variables | more, self.result["title"])

    def _finish(self, run: Run) -> None:
        """The pictures of all traces, and the report."""
        from ..show.plots import save
        from ..show.report.figures import trace_picture

        for i, row in enumerate(self.result["traces"]):
            save(trace_picture(self.arrays, i, row), run.path(f"trace{i + 1}.png"))
        super()._finish(run)

    def _parts(self) -> list[Any]:
        said = [("contradicted by the motion", self.findings), ("can tell", self.can), ("cannot", self.cannot)]
        lines = ["\n".join([f"{name}:", *(f"- {line}" for line in lines)]) for name, lines in said if lines]
        return [facts({"campaign": self.result["title"]}), self.campaign.summary, *lines]


def inspect(campaign: Campaign, progress: Tell | None = None) -> Inspection:
    """Events of every run, what was mended or left out, and what these data can tell.

    Args:
        campaign: the runs; called as its method, the campaign itself.
        progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.
    """
    from ..data.checks import rig_against_motion, stopping
    from ..data.segment.stick_ripple import stick_ripple
    from ..inference.diagnose.stiffness_check import spring_finding
    from ..show.report import describe_trace, trace_pieces
    from ..show.report.ripple_text import ripple_text
    from .data_abilities import abilities

    rows: list[dict[str, Any]] = []
    variables: dict[str, tuple] = {}
    with reporting("inspecting", progress) as tell:
        traces, events = campaign.traces, campaign.events
        for i, (trace, segmentation) in enumerate(zip(traces, events, strict=True)):
            tell(trace.name, i / len(traces))
            row = describe_trace(trace, segmentation)
            ripple = stick_ripple(trace, segmentation) if trace.drive is not None else None
            if ripple is not None:
                key = f"trace{i}_ripple"
                for name, unit in (("frequency", "Hz"), ("amplitude", ripple["unit"])):
                    variables[f"{key}_{name}"] = (key, ripple.pop(name), {"units": unit})
                row["ripple"] = {**ripple, "text": ripple_text(ripple["lines"], trace, ripple["unit"])}
            variables |= trace_pieces(trace, segmentation, i)
            rows.append(row)
    able = abilities(traces, events)
    rig = list(rig_against_motion(campaign.description, traces, events))
    if not stopping(rig) and (wrong := spring_finding(campaign.description, traces, events)) is not None:
        rig.append(wrong)
    result = {
        **head(campaign, "inspect"),
        "rig": [finding.plain() for finding in rig],
        "traces": rows,
        "can": list(able.can),
        "cannot": [*able.cannot, *_lacking(campaign)],
        "dropped": [f"{t['name']}: {text}" for t in rows for text in (*t["repairs"], *t["dropped"])],
    }
    return Inspection(campaign, result, variables)


def _lacking(campaign: Campaign) -> list[str]:
    """What the campaign does not say of the rig and a fit will ask for."""
    from ..inference.fit.normalised import is_ramp
    from ..inference.fit.static_table import StaticRig

    slipping = [t for t, s in zip(campaign.traces, campaign.events, strict=True) if s.events and not is_ramp(t)]
    said = []
    for trace in slipping:
        try:
            StaticRig.of(campaign.description.rig_of(trace.name), spring_stiffness=trace.spring_stiffness)
        except InputError as error:
            said.append(f"The static model can be fitted only when the campaign has {error.key}: measured, or a guess.")
    if slipping and campaign.rig.mass is None:
        said.append("The dynamic model can be fitted only when the campaign has rig.mass: measured, or a guess.")
    return list(dict.fromkeys(said))
