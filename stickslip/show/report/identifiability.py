"""What a fit of the dynamic model cannot tell, and what its backbone says of the surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...inference.fit.composition import run_of
from ...inference.fit.serialised import Fitted
from ...inference.fit.surface import sensitivity
from ...inference.uncertainty import flat_directions, null_directions, relative


def identifiability(fit: Fitted, rig: Any, line: dict[str, Any] | None) -> list[str]:
    """The identifiability table in words: directions that the fit leaves open, and what is behind u_max and p.

    Args:
        fit: its covariance, and so its words, are those of the data and the priors together.
        rig: of the campaign.
        line: (H, h_rms) of the rough lines nearest to the fitted backbone; None where there are none.
    """
    shared = [i for i, f in enumerate(fit.composition.free) if run_of(f.name) is None]
    free, z = [fit.composition.free[i] for i in shared], [float(fit.z[i]) for i in shared]
    names, logs = [f.name for f in free], [f.scale == "log" for f in free]
    kept, covariance, lost = relative(names, z, fit.covariance[np.ix_(shared, shared)], logs)
    names = [names[i] for i in kept]
    widths = [free[i].width if logs[i] else np.inf for i in kept]
    lines = [d.text for d in flat_directions(names, covariance, widths=widths)] + lost
    if line is None:
        return lines
    try:
        behind = sensitivity(rig.model_copy(update={"H": line["H"], "h_rms": line["h_rms"]}))
    except InputError:
        return lines
    seen = [k for k, name in enumerate(behind.outputs) if name in names]
    at = [names.index(behind.outputs[k]) for k in seen]
    known = covariance[np.ix_(at, at)] + behind.scatter[np.ix_(seen, seen)]
    found = null_directions(behind.names, behind.jacobian[seen], known)
    return lines + [f"behind the contact: {d.text}" for d in found]
