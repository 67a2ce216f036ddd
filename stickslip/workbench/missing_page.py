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
        pn.Row(residual.against, residual.period), residual.figure, ladder.figure, ladder.table, bone.figure,
        bone.words, margin=(8, 12, 0, 0),
    )  # fmt: skip
    return pn.Row(left, pn.Column(listed.head, listed.part, listed.verdict, margin=(8, 0, 0, 0)))
