"""*What is missing*: the residual against a variable, the catalogue by its evidence, the ladder, the backbone."""

from __future__ import annotations

from typing import Any

import panel as pn

from .backbone_view import Backbone
from .catalogue_view import Listed
from .ladder_view import Ladder
from .residual_view import Residual
from .session import Session


def page(session: Session) -> Any:
    """The page of a session."""
    residual, ladder, bone = Residual(session), Ladder(session), Backbone(session)
    listed = Listed(session, residual)
    left = pn.Column(
        pn.Row(residual.against, residual.period, sizing_mode="stretch_width"),
        pn.pane.Bokeh(residual.figure, sizing_mode="stretch_width"),
        pn.pane.Bokeh(ladder.figure, sizing_mode="stretch_width"),
        ladder.table,
        pn.pane.Bokeh(bone.figure, sizing_mode="stretch_width"),
        bone.words,
        sizing_mode="stretch_width", margin=(8, 12, 0, 0),
    )  # fmt: skip
    right = pn.Column(listed.head, listed.part, listed.verdict, sizing_mode="stretch_width", margin=(8, 0, 0, 0))
    return pn.Row(left, right, sizing_mode="stretch_width")
