"""A posterior sample of a fit, as ArviZ InferenceData, and whether it can be trusted, in words."""

from __future__ import annotations

import itertools
from contextlib import suppress
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inference.fit.parameters import to_si
from ..inference.force.point import Point
from ..inference.force.posterior import PosteriorDensity, posterior_density
from ..system.extras import need
from ..system.progress import reporting
from .fit_tables import STRENGTH
from .result_base import Tell

if TYPE_CHECKING:
    import arviz

    from .fit import Fit

CONVERGED = 1.05  # largest R-hat of chains that agree
FEW = 100  # effective draws below which a 95 % interval is rough
LOOK = 0.1  # s between two looks at whether the chains are done


def sample(
    fit: Fit, draws: int = 200, tune: int = 100, chains: int = 2, seed: int = 0, progress: Tell | None = None
) -> arviz.InferenceData:
    """Draw from the posterior by the No-U-Turn sampler (Hoffman & Gelman, JMLR 15 (2014) 1593; by nutpie).

    Sampled are the free parameters, with exact gradients. The covariance of the residuals is held as the fit found
    it, what differs from event to event is marginalised, and what the force is linear in (the strengths of the
    elements, errors that all cycles share, phases) is at its best for every draw, so that its uncertainty is not
    in the sample.

    Args:
        fit: what is sampled; called as its method, the fit itself.
        draws, tune: of each chain, kept and for adaptation.
        chains: side by side.
        seed: of the draws.
        progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.

    Returns:
        ``posterior`` holds the free parameters (SI, ``attrs["units"]``) and ``contact.strength``; its
        ``attrs["trust"]`` says in words whether divergences or R-hat speak against it.

    Raises:
        InputError: nutpie is not installed, or a number below one.
    """
    if min(draws, tune, chains) < 1:
        raise InputError(
            "out of range", key="draws, tune, chains", value=f"{draws}, {tune}, {chains}", allowed="1 or more"
        )
    need("sampling", "posterior", "nutpie", "arviz")
    import nutpie
    from nutpie.compiled_pyfunc import from_pyfunc

    density, names = posterior_density(fit.force_fit), [f.name for f in fit.free]
    done, drawn, total = itertools.count(1), SimpleQueue[int](), chains * (draws + tune)

    def expand(x: np.ndarray) -> dict[str, Any]:
        drawn.put(next(done))
        return _expanded(density, names, x)

    model = from_pyfunc(
        density.size,
        lambda: lambda x, **_: density.at(np.asarray(x))[1:],
        lambda *_: lambda x, **__: expand(np.asarray(x)),
        [np.dtype(np.float64)] * (len(names) + 1),
        [()] * (len(names) + 1),
        [*names, STRENGTH],
        make_initial_point_fn=lambda s: 0.5 * np.random.default_rng(s).standard_normal(density.size),
    )
    sampler: Any = nutpie.sample(
        model, draws=draws, tune=tune, chains=chains, cores=chains, seed=seed, progress_bar=False, save_warmup=False,
        blocking=False,
    )  # fmt: skip
    # told in this thread, which an interruption reaches: nutpie by itself ends with the draws so far as the sample
    found: Any = None
    try:
        with reporting("sampling", progress) as tell:
            while found is None:
                with suppress(TimeoutError):
                    found = sampler.wait(timeout=LOOK)
                while not drawn.empty():
                    n = drawn.get()
                    tell(f"{n} of {total} draws", n / total)
    except BaseException:
        if found is None:
            sampler.cancel()
        raise
    units = {f.name: f.unit for f in fit.free} | {STRENGTH: "N"}
    for name, unit in units.items():
        found.posterior[name].attrs["units"] = unit
    found.posterior.attrs.update(title=fit.campaign.title, model=" + ".join(fit.parts), trust=" ".join(trust(found)))
    return found


def drawn_points(fit: Fit, found: Any) -> list[Point]:
    """The draws of :func:`sample` as points of the fit's model, what was not drawn at its best."""
    density, posterior = posterior_density(fit.force_fit), found.posterior
    values = np.stack([posterior[f.name].values.ravel() for f in fit.free], axis=1)
    return [density.best(np.array([f.inward(v) for f, v in zip(fit.free, row, strict=True)])) for row in values]


def _expanded(density: PosteriorDensity, names: list[str], x: np.ndarray) -> dict[str, Any]:
    """The parameters (SI) at whitened coordinates."""
    point, _, _ = density.at(x)
    values = to_si(density.fit.problem.composition.shared, point.z)
    return {**{name: np.asarray(values[name]) for name in names}, STRENGTH: np.asarray(point.weights.sum())}


def trust(found: Any) -> list[str]:
    """Sentences on whether a sample can be trusted: divergences, chains that disagree, few independent draws."""
    import arviz

    said = []
    lost, total = int(found.sample_stats["diverging"].sum()), int(found.sample_stats["diverging"].size)
    if lost:
        said.append(
            f"{lost} of {total} draws diverged: the density has edges that the sampler cannot follow, and the tails "
            "may be too short."
        )
    names = list(found.posterior.data_vars)
    if found.posterior.sizes["chain"] > 1:
        rhat = arviz.rhat(found)
        apart = [name for name in names if float(rhat[name]) > CONVERGED]
        if apart:
            said.append(f"The chains do not agree on {', '.join(apart)} (R-hat above {CONVERGED:g}): draw more.")
    size = arviz.ess(found)
    few = [name for name in names if float(size[name]) < FEW]
    if few:
        said.append(f"Fewer than {FEW} independent draws of {', '.join(few)}: intervals are rough.")
    if said:
        return said
    chains = "; the chains agree" if found.posterior.sizes["chain"] > 1 else " of a single chain"
    return [f"No divergence in {total} draws{chains}."]
