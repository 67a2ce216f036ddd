"""*Simulate*: the model run freely beside a measured run, over velocities, and rival effects in one experiment."""

from __future__ import annotations

from typing import Any

import panel as pn

from . import vibrometer_files
from .background_work import Show, Tell, background
from .page_parts import head, progress, starter
from .rivals_view import Rivals
from .session import Session
from .simulated_view import SimulatedView
from .simulation_form import SimulationForm, needed
from .sweep_view import SweepView
from .widgets import field


def page(session: Session) -> Any:
    """The page of a session."""
    asked = SimulationForm(session)
    return pn.Column(
        asked.view, SimulatedView(session, asked).view, SweepView(session, asked).view, Rivals(session, asked).view,
        _Synthetic(session, asked).view, margin=(8, 0, 24, 0),
    )  # fmt: skip


class _Synthetic:
    """A synthetic record of what is asked for, in a folder of its own."""

    def __init__(self, session: Session, asked: SimulationForm) -> None:
        self._session, self._asked = session, asked
        self._work = background(session, "synthetic")
        self.name = field(pn.widgets.TextInput, "folder beside the campaign", 240, value="synthetic")
        begin = starter(self._work, "Write a record", self.start)
        words = "What is set above as a vibrometer would record it: record.csv and campaign.toml in a new folder"
        self.view = pn.Column(
            head(words), pn.FlexBox(self.name, begin, gap="6px 10px"), progress(self._work),
            visible=session.data.description.filed,
        )  # fmt: skip

    def start(self) -> None:
        """Simulate and write it."""
        setting, name, campaign = self._asked.setting(), self.name.value, self._session.data

        def make(tell: Tell, show: Show) -> Any:
            folder = vibrometer_files.write(needed(self._session), setting, campaign, name, tell)
            self._work.said = f"written: stickslip open {folder.name}/campaign.toml"
            return folder

        self._work.do("simulating the record", make)
