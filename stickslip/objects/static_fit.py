"""The paper's static model, fitted to every creep process by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from ..errors import InputError
from ..system.object_repr import facts
from ..system.progress import reporting
from ..system.units import to_si
from .result_base import Savable, Tell, dataset, head

if TYPE_CHECKING:
    from .campaign import Campaign

Align = Literal["consistent", "paper"]
Time = Literal["exact", "paper"]
Sampling = Literal["log", "uniform"]


class StaticFit(Savable):
    """The paper's static model, every creep process fitted by itself.

    Attributes:
        campaign: what was fitted.
        result: plain data, as in ``result.json``.
        arrays: measured and fitted creep.
    """

    def __init__(self, campaign: Campaign, result: dict[str, Any], variables: dict[str, Any]) -> None:
        self.campaign, self.result = campaign, result
        self.arrays = dataset(variables, campaign.title)

    def _parts(self) -> list[Any]:
        said = [self.result[key]["text"] for key in ("static", "ramps") if self.result.get(key)]
        return [facts({"campaign": self.campaign.title, "model": "static"}), *said]


def fit_static(
    campaign: Campaign,
    *,
    align: Align = "consistent",
    time: Time = "exact",
    v_lim: float | str = 1e-6,
    sampling: Sampling = "log",
    progress: Tell | None = None,
) -> StaticFit:
    """Fit the paper's static model (Grzemba 2014) to every creep process by itself.

    Args:
        campaign: the runs; called as its method, the campaign itself.
        align: the point of the model's curve that is shifted onto the measured passage of ``v_lim``: its own
            passage, or ("paper") its end.
        time: virtual time with the block's own motion ("exact") or without it ("paper").
        v_lim: speed of the block at which a creep process ends (m/s, or text with a unit).
        sampling: windows even in the logarithm of the time left ("log"), or in time as in the paper ("uniform").
        progress: told the stage and the share of it done.

    Raises:
        InputError: nothing in the runs can be compared with the static model, or the rig lacks what it takes.
    """
    from ..data.trace import Trace
    from ..inference.fit.static_table import StaticRig
    from ..show.report.excerpts import trace_sections
    from ..show.report.static_result import static_result

    file = campaign.description.path
    traces, found = campaign.traces, campaign.scaled[0]

    def rig_of(trace: Trace) -> StaticRig:
        return StaticRig.of(campaign.description.rig_of(trace.name), spring_stiffness=trace.spring_stiffness)

    try:
        with reporting("creep processes", progress) as tell:
            result, variables = static_result(
                traces,
                found,
                rig_of,
                align=align,
                form=time,
                v_lim=to_si(v_lim, "m/s", key="v_lim"),
                sampling=sampling,
                springs=campaign.rig.springs,
                progress=lambda done, of: tell(f"{done} of {of} fitted", done / of),
            )
    except InputError as error:
        raise error.at(file=file) from None
    notes = list(campaign.scaled[1])
    if kept := [t.name for t in traces if t.role == "held-out"]:
        notes.append(
            f"creep of held-out runs ({', '.join(kept)}) is fitted as well: every creep process is fitted by itself"
        )
    described, pictured = trace_sections(traces, found)
    whole = {
        **head(campaign, "fit"),
        "model": "static",
        **result,
        **described,
        "rig": [finding.plain() for finding in campaign.findings],
        "notes": notes,
        "dropped": [*campaign.left_out, *result["dropped"]],
    }
    return StaticFit(campaign, whole, variables | pictured)
