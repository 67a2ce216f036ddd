"""What a fit says as labelled arrays: force at every point, covariance of parameters, backbone and rough lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..inference.diagnose.backbone_laws import shape_of
from ..inference.force.backbone import Backbone, PowerLaw
from ..inference.force.knots import PHASES
from ..inference.force.residual import VARIABLES, WAYS
from .fit_tables import STRENGTH

if TYPE_CHECKING:
    import xarray

    from .fit import Fit

COORDINATES = ("displacement", "velocity", "spring force", "time in contact", *WAYS)


def parameter_covariance(fit: Fit) -> xarray.DataArray:
    """See :attr:`stickslip.Fit.covariance`."""
    import xarray

    names, units = [STRENGTH, *(f.name for f in fit.free)], ["N", *(f.unit for f in fit.free)]
    found, n = fit.force_fit, len(fit.free)
    made = np.zeros((n + 1, found.covariance.shape[0]))  # SI values by what is fitted
    first = n + found.point.phases.size
    made[0, first : first + found.point.weights.size] = 1.0  # the strength is the sum of the bank's weights
    made[range(1, n + 1), range(n)] = [f.slope(float(z)) for f, z in zip(fit.free, found.point.z, strict=True)]
    part = made @ found.covariance @ made.T
    return xarray.DataArray(
        part,
        dims=("parameter", "other"),
        coords={"parameter": names, "other": names, "unit": ("parameter", units), "other_unit": ("other", units)},
        name="covariance",
        attrs={"units": "unit * other_unit", "long_name": "covariance of fitted parameters"},
    )


def residual_deviation(fit: Fit) -> xarray.DataArray:
    """See :attr:`stickslip.Fit.residual_std`."""
    found = fit.force_fit
    slopes = found.slopes.shared
    variance = ((slopes @ found.covariance) * slopes).sum(axis=1)
    made = fit.force.residual.copy(data=np.sqrt(np.maximum(variance, 0.0))).rename("residual_std")
    return made.assign_attrs(long_name="standard deviation of the residual force by the parameters")


def contact_force(fit: Fit, where: dict[str, np.ndarray], floor: np.ndarray) -> xarray.Dataset:
    """See :attr:`stickslip.Fit.force`; ``where`` are the coordinates of its points, ``floor`` is theirs (N)."""
    import xarray

    found, problem = fit.force_fit, fit.force_fit.problem
    names = np.array([k.name for k in problem.runs])
    coords: dict[str, Any] = {
        "run": ("point", names[problem.run]),
        "event": ("point", problem.of - problem.first[problem.run]),
        "phase": ("point", np.array(PHASES)[problem.phase]),
        "time": ("point", problem.at, {"units": "s"}),
    }
    for name in COORDINATES:
        unit = (VARIABLES | WAYS)[name]
        coords[name.replace(" ", "_")] = ("point", where[name], {"units": unit, "long_name": name})
    data = {
        "measured": found.forces.measured, "model": found.forces.held, "residual": found.marginal, "floor": floor,
        "stiffness": found.forces.tangent,
    }  # fmt: skip
    units = {"stiffness": "N/m"}
    made = {k: ("point", v, {"units": units.get(k, "N")}) for k, v in data.items()}
    made["left_out"] = ("point", found.dropped, {"long_name": "outlier, not used in the fit"})
    return xarray.Dataset(made, coords=coords, attrs={"title": fit.campaign.title, "model": " + ".join(fit.parts)})


def backbone_curve(curve: Backbone, law: PowerLaw) -> xarray.Dataset:
    """See :attr:`stickslip.Fit.backbone`."""
    import xarray

    return xarray.Dataset(
        {
            "force": ("displacement", curve.force, {"units": "N"}),
            "std": ("displacement", curve.std, {"units": "N"}),
            "law": ("displacement", law.force, {"units": "N", "long_name": "1 - (1 - u/u_max)^p"}),
        },
        coords={"displacement": ("displacement", curve.displacement, {"units": "m"})},
        attrs={
            "u_max": law.u_max, "u_max_std": law.u_max_std, "p": law.p, "p_std": law.p_std, "spread": law.spread,
            "misfit": law.misfit,
        },
    )  # fmt: skip


def rough_lines(fit: Fit) -> xarray.Dataset | None:
    """See :attr:`stickslip.Fit.rough_line`."""
    import xarray

    shape = shape_of(fit.force_fit, fit.campaign.rig, [])
    line = shape.line
    if line is None:
        return None
    curves = {"force": line.force, "later": line.scatter[0], "sooner": line.scatter[1]}
    return xarray.Dataset(
        {name: ("displacement", values, {"units": "N"}) for name, values in curves.items()},
        coords={"displacement": ("displacement", shape.curve.displacement, {"units": "m"})},
        attrs={
            "H": line.hurst, "H_std": line.hurst_std, "h_rms": line.h_rms, "h_rms_std": line.h_rms_std,
            "misfit": line.misfit,
        },
    )  # fmt: skip
