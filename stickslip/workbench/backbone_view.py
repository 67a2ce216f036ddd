"""The backbone of the contact with its band, a rough contact's law, and the nearest rough lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..system.units import shown_with
from .figures import figure, label, legend, look, source, unit_of
from .session import Session, watch
from .widgets import Words


class Backbone:
    """The contact's backbone as measured, with its band, a rough contact's law, and the nearest rough lines."""

    def __init__(self, session: Session) -> None:
        self._session = session
        theme = look()
        self._data = source(u=[], force=[], low=[], high=[], law=[])
        self._line = source(u=[], force=[], low=[], high=[])
        self._of: Any = None
        self._scale, self._told, self._widest = (1.0, 1.0), "", 0.0
        self.figure = figure("backbone of the contact", height=260, output_backend="canvas")
        self.figure.varea(
            "u", "low", "high", source=self._data, color=theme.band, fill_alpha=0.45,
            legend_label="two standard deviations",
        )  # fmt: skip
        self.figure.line("u", "force", source=self._data, color=theme.measured, line_width=2.5, legend_label="measured")
        self.figure.line(
            "u", "law", source=self._data, color=theme.model, line_width=2, line_dash="dashed",
            legend_label="rough contact: 1 - (1 - u/u_max)^p",
        )  # fmt: skip
        for edge in ("low", "high"):
            dots = {
                "color": theme.soft,
                "line_width": 1,
                "line_dash": "dotted",
                "name": f"nearest rough lines ({edge})",
            }
            self.figure.line("u", edge, source=self._line, **dots)
        self.figure.line(
            "u", "force", source=self._line, color=theme.runs[2], line_width=2, line_dash="dotdash",
            legend_label="nearest rough lines",
        )  # fmt: skip
        legend(self.figure, ncols=2)
        self.words = Words(margin=(0, 0, 0, 12))
        watch(session, ["rough"], self.draw_line)
        watch(session, ["steps", "at"], self.update, now=True)

    def update(self) -> None:
        """Draw that of the last model that was fitted."""
        fit = self._session.fitted
        if fit is None or fit is self._of:
            return
        self._of = fit
        data = fit.backbone
        u_max = float(data.attrs["u_max"])
        use = data.displacement.values <= 1.6 * u_max
        u, force, std, law = (
            a[use] for a in (data.displacement.values, data.force.values, data["std"].values, data.law.values)
        )
        k, unit = unit_of(force, "N")
        m, length = unit_of(u, "m")
        self._data.data = {
            "u": u * m, "force": force * k, "low": (force - 2 * std) * k, "high": (force + 2 * std) * k, "law": law * k,
        }  # fmt: skip
        self.figure.xaxis.axis_label = label("displacement from the force-free contact", length)
        self.figure.yaxis.axis_label = label("force", unit)
        own = data.attrs
        self._scale = m, k
        self._told = f"u_max = {shown_with(u_max, own['u_max_std'], 'm')}, p = {shown_with(own['p'], own['p_std'])}"
        self._widest = float(u[-1])
        self.words.text = self._told
        self._session.find_rough_line()
        self.draw_line()

    def draw_line(self) -> None:
        """Draw the rough lines nearest to it, once they are found."""
        fit, line = self._session.rough
        if fit is None or fit is not self._of or line is None:
            self._line.data = {"u": [], "force": [], "low": [], "high": []}
            return
        m, k = self._scale
        own = line.isel(displacement=np.flatnonzero(line.displacement.values <= self._widest))
        self._line.data = {
            "u": own.displacement.values * m, "force": own.force.values * k, "low": own.later.values * k,
            "high": own.sooner.values * k,
        }  # fmt: skip
        a = line.attrs
        self.words.text = (
            f"{self._told}; nearest rough lines: H = {shown_with(a['H'], a['H_std'])}, h_rms = "
            f"{shown_with(a['h_rms'], a['h_rms_std'], 'm')} (dotted: how such contacts differ)"
        )
