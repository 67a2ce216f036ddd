"""A fit as an interactive object, for a notebook or a page of one's own: pictures of the workbench without a server."""

from __future__ import annotations

from typing import TYPE_CHECKING

import panel as pn

from ..errors import ArgumentError
from .backbone_view import Backbone
from .figures import look
from .model_page import Cycle
from .residual_view import Residual
from .session import Session, watch
from .widgets import Words

if TYPE_CHECKING:
    from ..objects.fit import Fit

WIDE = {"sizing_mode": "stretch_width"}


def fit_view(fit: Fit) -> pn.Column:
    """One cycle with its residual, the residual against a variable, the backbone; see ``stickslip.workbench.view``."""
    from ..objects.fit import Fit

    if not isinstance(fit, Fit):
        hint = "campaign.fit() makes one; ss.workbench(campaign) shows a campaign"
        raise ArgumentError(
            "only a fit of the dynamic model has these pictures", key="fit", value=type(fit).__name__, hint=hint
        )
    session = Session(campaign=fit.campaign)
    session.first(fit)
    cycle, residual, said = Cycle(session, keys=""), Residual(session), Words(**WIDE)

    def tell() -> None:
        said.text = session.said

    watch(session, ["said"], tell)
    parts = [cycle.chooser, cycle.force, cycle.residual, cycle.creep, pn.Row(residual.against, residual.period), said]
    parts.append(residual.figure)
    if not fit.by_hand:
        bone = Backbone(session)
        parts += [bone.figure, bone.words]
    theme = look()
    colours = "; ".join(
        f"--wb-{name}: {getattr(theme, name)}" for name in ("text", "soft", "line", "surface", "accent")
    )
    return pn.Column(*parts, stylesheets=[f":host {{ {colours} }}"], **WIDE)
