"""The form of a simulation: its fields on the page, the model that is simulated, and the result."""

from __future__ import annotations

from functools import partial
from typing import Any

import panel as pn

from ..errors import InputError
from ..objects.experiments import Setting
from ..objects.fit import Fit
from ..system.units import shown
from .page_parts import head
from .saved_fields import SavedFields
from .selection import chosen
from .session import Session, watch
from .widgets import field


class SimulationForm:
    """What is to be simulated."""

    def __init__(self, session: Session) -> None:
        self._session = session
        text: Any = partial(field, pn.widgets.TextInput, width=150)
        self.run = field(pn.widgets.Select, "beside the run", 170, options=[])
        self.velocity = text(name="velocity of the drive")
        self.hold = text(name="a hold of", placeholder="such as 10 s")
        self.step = text(name="a step to the velocity", placeholder="such as 1 mm/s")
        self.spring, self.mass = text(name="spring"), text(name="mass")
        self.events = field(
            pn.widgets.IntInput, "number of slips", 150, value=7, start=1, end=100,
            description="At a velocity written here, and in the sweep",
        )  # fmt: skip
        self.load = text(name="normal load, times", placeholder="such as 0.5 or 2")
        self.back = field(pn.widgets.Checkbox, "and back over the same track", 210, margin=(24, 10, 0, 0))
        names = ("run", "velocity", "hold", "step", "spring", "mass", "load", "events", "back")
        self.fields: dict[str, Any] = {name: getattr(self, name) for name in names}
        self.row = pn.FlexBox(*self.fields.values(), gap="6px 0")
        self.view = pn.Column(head("What is left empty is as in the measured run."), self.row)
        self._kept = SavedFields(session, "simulate", self.fields)
        self.run.param.watch(lambda event: self._placeholders(), "value")
        watch(session, ["campaign", "run"], self._runs)
        watch(session, ["steps", "at"], self._placeholders)
        self._runs()
        self._kept.restore()

    def _runs(self) -> None:
        campaign, fit = self._session.data, self._session.fit
        names = campaign.names if fit is None else [k.name for k in fit.climbed.prepared.runs]
        run = chosen(self._session)[0]
        with self._kept.aside():
            self.run.param.update(options=names, value=run if run in names else names[0])
        self._placeholders()

    def _placeholders(self) -> None:
        """What it is in the measured run."""
        campaign, fit = self._session.data, self._session.fit
        if self.run.value not in campaign.names:
            return
        trace = campaign[self.run.value]
        holds = trace.drive is not None and trace.drive.breakpoints.size > 0
        speed = trace.drive_velocity
        self.velocity.placeholder = "as measured" if speed is None or holds else shown(speed, "m/s")
        if fit is not None:
            spring = trace.spring_stiffness or fit.values.get("rig.spring_stiffness")
            self.spring.placeholder = "" if spring is None else shown(spring, "N/m")
            mass = fit.values.get("rig.mass", campaign.rig.mass)
            self.mass.placeholder = shown(mass, "kg") if isinstance(mass, float) else ""

    def setting(self) -> Setting:
        """As it is written now."""
        written = {name: each.value for name, each in self.fields.items()}
        return Setting(**{**written, "run": str(self.run.value), "events": int(self.events.value or 1)})


def needed(session: Session) -> Fit:
    """The model as it stands.

    Raises:
        InputError: there is none yet.
    """
    if session.fit is None:
        raise InputError("there is no model yet", hint="wait until the base model is fitted")
    return session.fit


def named(fit: Fit, now: Fit | None) -> str:
    """What a curve is of: the model as it stands, or one that stood before."""
    parts = " + ".join(fit.parts)
    return f"model: {parts}" if fit is now else f"an earlier model: {parts}"
