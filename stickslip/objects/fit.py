"""A fit: the model as it stands, how far it is from the measurement, and what can be changed in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, InputError, nearest
from ..inference.diagnose.free_simulation import Confirmation
from ..inference.diagnose.model_ladder import Climbed, chosen, climb, extended, replaced, shortened
from ..inference.diagnose.model_record import fitted_model
from ..inference.fit.parameters import Free, effect_parameters
from ..inference.fit.serialised import Fitted
from ..inference.force.backbone import backbone, power_law
from ..inference.force.errors import Sums, deviation, error, sums
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.fit import deviations
from ..inference.force.heldout import heldout_residual
from ..inference.force.residual import coordinates
from ..inference.uncertainty import TIED
from ..physics.effects import catalogue
from ..physics.effects.effects_from_text import with_form
from ..simulation.conformance import try_laws
from ..system.lazy_method import LazyMethod
from ..system.object_repr import facts
from ..system.progress import portion, reporting
from ..system.runstore import Run
from .fit_arrays import backbone_curve, contact_force, parameter_covariance, residual_deviation, rough_lines
from .fit_plots import FitPlots
from .fit_result import fit_result
from .fit_tables import (
    STRENGTH,
    correlation_table,
    error_table,
    ladder_table,
    origins,
    parameter_table,
    statistics_of,
)
from .fitted_model import FittedModel
from .free_cycles import free_run_errors, simulated_cycles
from .parameters_by_hand import intervals, moved, profile, refitted
from .result_base import Savable, Tell, dataset, finish, several

if TYPE_CHECKING:
    import pandas
    import xarray

    from .campaign import Campaign
    from .derived import derived as _derived
    from .posterior import sample as _sample

FLOOR = (
    "Errors are in floors of this model: 1 is as good as noise and its own scatter allow, of which a wrong model has "
    "more. Models are compared in floors of one of them: ladder, ss.compare."
)


class Fit(FittedModel, Savable):
    """The dynamic model along the measured motion, with the effects that were added.

    It does not change: whatever changes the model returns another.

    Args:
        campaign: what was fitted.
        climbed: the models, the last of which is the model as it stands.
        moved: the last model with parameters set by hand after its fit; None as it was fitted.

    Attributes:
        campaign: as given.
        plot: pictures.
    """

    def __init__(self, campaign: Campaign, climbed: Climbed, moved: ForceFit | None = None) -> None:
        self.campaign, self._climbed, self._moved = campaign, climbed, moved
        self.plot = FitPlots(self)
        self._confirmation: Confirmation | None = None

    def bare(self) -> Fit:
        """A copy without cached results (some 20 MB), which are computed again on demand."""
        if self._moved is not None:
            made = Fit(self.campaign, self._climbed, replace(self._moved))
        else:
            rungs = [replace(r, fit=None if r.fit is None else replace(r.fit)) for r in self._climbed.ladder]
            made = Fit(self.campaign, replace(self._climbed, ladder=tuple(rungs)))
        made._confirmation = self._confirmation
        return made

    # what it is

    @property
    def by_hand(self) -> bool:
        """Whether parameters were set by hand after the last fit."""
        return self._moved is not None

    @cached_property
    def climbed(self) -> Climbed:
        """The fitted models in order, from the static one to the present one."""
        return self._climbed if self._moved is None else replaced(self._climbed, self._moved)

    @property
    def title(self) -> str:
        """Title of the campaign."""
        return self.campaign.title

    @property
    def parts(self) -> tuple[str, ...]:
        """Tags of what is in the model, such as ``("static", "inertia", "contact-ageing")``."""
        return self._climbed.ladder[-1].model

    @property
    def effects(self) -> tuple[str, ...]:
        """Tags of the effects that were added to the base."""
        return tuple(e.tag for e in self.force_fit.problem.composition.effects)

    @property
    def effect_forms(self) -> tuple[str, ...]:
        """Tags of the added effects, with the form of a law that is not the usual one, as :meth:`add` takes them."""
        return tuple(with_form(e) for e in self.force_fit.problem.composition.effects)

    @property
    def free(self) -> tuple[Free, ...]:
        """Free parameters that all runs share, with bounds and priors."""
        return self.force_fit.free

    @property
    def values(self) -> dict[str, float]:
        """Name -> value (SI) of every parameter that all runs share, and the contact's strength."""
        return {STRENGTH: self.force_fit.strength, **self.force_fit.values}

    @cached_property
    def std(self) -> dict[str, float]:
        """Name -> standard deviation (SI) of the contact's strength and every free parameter that all runs share."""
        found = self.covariance
        deviations = np.sqrt(np.maximum(np.diag(found), 0.0))
        return dict(zip(found.parameter.values.tolist(), deviations.tolist(), strict=True))

    @cached_property
    def parameters(self) -> pandas.DataFrame:
        """Value and standard deviation (SI), unit, prior and meaning of every parameter that all runs share."""
        return parameter_table(self)

    @cached_property
    def covariance(self) -> xarray.DataArray:
        """Covariance (SI) of the contact's strength and the free parameters that all runs share, shape (a, a)."""
        return parameter_covariance(self)

    @property
    def correlations(self) -> pandas.DataFrame:
        """Correlations of the contact's strength and the free parameters that all runs share, the strongest pair first.

        A row for each pair, ``of`` one ``and`` the other, with their ``correlation`` (-1 to 1).
        """
        return correlation_table(self)

    # how far it is from the measurement

    @cached_property
    def force(self) -> xarray.Dataset:
        """Measured force of the contact and the model's at every point (N), with where and when it was.

        ``residual`` is measured less model with the random effects of events at zero, ``floor`` the standard
        deviation that noise and the scatter of events make.
        """
        return contact_force(self, self._where, self._floor)

    @property
    def residuals(self) -> xarray.DataArray:
        """Residual force over the floor of this fit at every point (1), near 1 if the model is right."""
        found = (self.force.residual / self.force.floor).rename("residual")
        return found.assign_attrs(units="1", long_name="residual force / floor")

    @cached_property
    def residual_std(self) -> xarray.DataArray:
        """Standard deviation that the uncertainty of what all runs share gives ``residual`` of :attr:`force` (N).

        To first order, by the derivatives and the covariance of the fit: parameters, elements of the contact, what is
        the same in all cycles. An event of its own deviates by ``floor`` besides, so that a prediction is off by
        ``numpy.hypot(fit.residual_std, fit.force.floor)``. Errors of the reading that are the same in all cycles are
        part of the difference of measured and model force, so that this is the deviation of neither alone.
        """
        return residual_deviation(self)

    @cached_property
    def statistics(self) -> pandas.Series:
        """Numbers of points and parameters, likelihood, chi-square and information criteria, by name.

        Those of several fits are a table, ``pandas.DataFrame({"base": base.statistics, "aged": aged.statistics})``.

        ``points`` are those in use, of so many ``events``. ``free parameters`` are the fitted ones of
        :attr:`parameters`, where others are given or measured; ``effective parameters`` are all that the data
        determine, elements of the contact included, priors taken off; ``sizes`` of noise, misfit and scatter are
        estimated besides. ``evaluations`` of the model led to the last one. Counts are whole numbers, so that the
        series holds objects: ``fit.statistics.astype(float)`` is one to calculate with.
        ``cost`` is -2 log-likelihood and priors. The likelihood lacks log(2 pi) for each point; an outlier stays in it,
        with the strength of the contact as its deviation. Each fit finds outliers anew: ``cost``, ``AIC`` and ``BIC``
        compare fits with the same ``points``, :attr:`ladder` and :func:`stickslip.compare` others too.

        ``chi-square`` is that of residuals made independent by their covariance, for those of one event go together;
        reduced, it is over points less effective parameters. The sizes are estimated from the same residuals, so that
        it is near 1 by itself, and reveals a wrong model less clearly than :attr:`error` does.

        ``AIC`` and ``BIC`` count effective parameters and sizes. More points within an event tell little that is new:
        what counts as an independent datum in ``BIC`` is an event. :func:`stickslip.compare` assumes less.
        """
        return statistics_of(self)

    @cached_property
    def errors(self) -> pandas.DataFrame:
        """Rms of the residual force over the floor of this fit, with a row for each phase and a column for each run.

        The floor is what noise and scatter of this model cause. Models are compared in :attr:`ladder`.
        """
        return self._errors(self.force_fit.marginal, error)

    @cached_property
    def unseen_errors(self) -> pandas.DataFrame:
        """As :attr:`errors`, on runs that are left out of the fit, each in turn."""
        return self._errors(self._unseen, error)

    @cached_property
    def error_deviations(self) -> pandas.DataFrame:
        """Standard deviations of :attr:`errors`, by how much events differ, for residuals within one go together."""
        return self._errors(self.force_fit.marginal, deviation)

    @cached_property
    def unseen_error_deviations(self) -> pandas.DataFrame:
        """Standard deviations of :attr:`unseen_errors`, as :attr:`error_deviations` are."""
        return self._errors(self._unseen, deviation)

    @property
    def error(self) -> float:
        """Rms of the residual force of all runs over the floor of this fit (1), near 1 if the model is right."""
        return float(self.errors.loc["all", "all"])

    @property
    def unseen_error(self) -> float:
        """As :attr:`error`, on runs that are left out of the fit, each in turn; nan where there is a single event."""
        return float(self.unseen_errors.loc["all", "all"])

    @property
    def error_std(self) -> float:
        """Standard deviation of :attr:`error`."""
        return float(self.error_deviations.loc["all", "all"])

    @property
    def unseen_error_std(self) -> float:
        """Standard deviation of :attr:`unseen_error`."""
        return float(self.unseen_error_deviations.loc["all", "all"])

    @cached_property
    def ladder(self) -> pandas.DataFrame:
        """A row for each model on the way here, with its fitted and unseen error and by how much its effect helps.

        All errors are in floors of the last model, so that they can be compared with one another.

        ``error std`` and ``unseen std`` are their standard deviations, by how much events differ.
        """
        return ladder_table(self, self._summed)

    @cached_property
    def backbone(self) -> xarray.Dataset:
        """The contact's backbone as measured (N over m) with its standard deviation, and a rough contact's law.

        Attributes ``u_max`` (m), ``p`` and their standard deviations, ``spread`` and ``misfit`` are of the law.
        """
        curve = backbone(self.force_fit)
        return backbone_curve(curve, power_law(curve, self._contacts))

    @cached_property
    def rough_line(self) -> xarray.Dataset | None:
        """The rough lines nearest to the backbone, one for each contact; None where the rig says too little of them.

        Returns:
            ``force`` (N) over ``displacement`` (m); ``later`` and ``sooner``, one deviation to either side, by which
            other contacts of the same surface differ. Attributes ``H``, ``h_rms`` (m) and their deviations, ``misfit``.
        """
        return rough_lines(self)

    # what can be changed

    def with_values(self, values: Mapping[str, float | str]) -> Fit:
        """The model with parameters set by hand, nothing fitted: ``fit.with_values({"rig.damping": "7 N s/m"})``.

        Args:
            values: name -> value in SI, or text with a unit; those of :attr:`free`, and ``contact.strength``.

        Raises:
            InputError: no free parameter of that name, or a value beyond its bounds.
        """
        made = Fit(self.campaign, self._climbed, moved(self, values))
        if "rig.spring_stiffness" not in values:
            made.__dict__["_where"] = self._where
        return made

    def refit(self, locked: str | Sequence[str] = ()) -> Fit:
        """Fitted anew from where it stands: ``fit.refit(locked="rig.damping")``.

        Args:
            locked: parameters that stay as they are.

        Raises:
            InputError: no free parameter of that name.
        """
        with _told("refitting", "all parameters"):
            return Fit(self.campaign, replaced(self.climbed, refitted(self, several(locked))))

    def add(self, effect: str) -> Fit:
        """The model with an effect more, fitted: ``fit.add("contact-ageing")``.

        Args:
            effect: tag, or ``tag:name=value`` for another form of its law than the usual one.

        Raises:
            InputError: no such effect or form, one that is in the model already, or that only shapes the backbone.
            FitError: it could not be fitted.
        """
        ((tag, form),) = chosen([effect], "effect")
        if tag in self.effects:
            raise InputError("the effect is in the model already", key="effect", value=effect)
        try_laws([catalogue.get(tag)])
        with _told("fitting", f"adding {tag}"):
            return Fit(self.campaign, extended(self.climbed, tag, form))

    def remove(self, effect: str) -> Fit:
        """The model without one of its effects, fitted anew.

        Raises:
            InputError: it is not in the model.
        """
        if effect not in self.effects:
            raise InputError(
                "the effect is not in the model", key="effect", value=effect, hint=nearest(effect, self.effects)
            )
        with _told("fitting", f"without {effect}"):
            return Fit(self.campaign, shortened(self.climbed, effect))

    # what it predicts

    def predict(self, progress: Tell | None = None) -> pandas.DataFrame:
        """Errors of the model run freely, from arrest to arrest, through runs it was not fitted to.

        Args:
            progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.

        Returns:
            A row for each run: relative errors (1) of recurrence, slip and creep before the onset; slips missed.
        """
        return free_run_errors(self.confirm(progress), self.parts)

    def simulate_cycles(self, run: str) -> xarray.Dataset:
        """Free simulation of every cycle of a measured run, each begun at the measured arrest before it.

        Returns:
            Over ``cycle`` and ``step``: ``time`` (s, of the record) and ``displacement`` (m, as the sensor shows it); a
            shorter cycle repeats its last step. Over ``cycle``: when half of the slip is done (``half``, s), its size
            (``slip``, m) and its end (``arrest``, s), NaN where it does not slip in time. Of the data:
            ``measured_half``, ``_slip``, ``_onset``, ``_arrest``, and ``measured_place`` at the onset (m).

        Raises:
            InputError: no run of that name whose cycles can be run.
        """
        return simulated_cycles(self._climbed.prepared, self.force_fit, run)

    @cached_property
    def fitted(self) -> Fitted:
        """The model as a family that can be simulated; the contact by the law fitted to its backbone."""
        law = power_law(backbone(self.force_fit), self._contacts)
        return fitted_model(self.force_fit, law, self.climbed.prepared.traces, self._contacts, self.campaign.rig)

    def profile(self, name: str, progress: Tell | None = None) -> dict[str, Any]:
        """Profile likelihood of a parameter: held at values around its best one, all others fitted.

        ``fit.profile("weakening.drop")`` says how far the data know it where its cost is no parabola.

        Returns:
            ``name``, ``unit``, ``value`` (SI), ``rise`` (of the cost, in units of chi-square and halved: what is random
            is not known better), ``interval`` (95 %; None for an open end) and ``text``.

        Raises:
            InputError: no free parameter of that name.
        """
        with reporting(f"profile of {name}", progress) as tell:
            return profile(self, name, tell)

    def intervals(self, names: str | Sequence[str] = (), progress: Tell | None = None) -> pandas.DataFrame:
        """Intervals of 95 % of parameters by their :meth:`profile` likelihoods, which need not be symmetric.

        Args:
            names: of the parameters; default all of :attr:`free`.
            progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.

        Returns:
            A row for each: ``value``, ``low`` and ``high`` (SI; nan where an end is open), and their distances from the
            value in its standard deviations, which differ where the cost is no parabola.

        Raises:
            InputError: no free parameter of that name.
        """
        with reporting("intervals", progress) as tell:
            return intervals(self, several(names), tell)

    if TYPE_CHECKING:
        sample, derived = _sample, _derived
    else:
        sample = LazyMethod("stickslip.objects.posterior")
        derived = LazyMethod("stickslip.objects.derived")

    # what is kept

    def confirm(self, progress: Tell | None = None) -> Confirmation:
        """Base and last model run freely through the measured cycles; simulated once."""
        if self._confirmation is None:
            with reporting("running freely", progress) as tell:
                self._confirmation = self.climbed.confirmed(tell)
        return self._confirmation

    @cached_property
    def _sections(self) -> tuple[dict[str, Any], dict[str, Any]]:
        return fit_result(self, self.confirm())

    @property
    def result(self) -> dict[str, Any]:
        """Plain data, as in ``result.json``."""
        return self._sections[0]

    @cached_property
    def arrays(self) -> xarray.Dataset:
        """Measured and model force, the backbone and the runs thinned for pictures, as in ``arrays.nc``."""
        return dataset(self._sections[1], self.campaign.title)

    @property
    def force_fit(self) -> ForceFit:
        """The numbers behind it, an optimum or where parameters were set by hand."""
        return self._climbed.fit if self._moved is None else self._moved

    @property
    def _contacts(self) -> int:
        return int(self.campaign.rig.contacts or 1)

    @cached_property
    def _where(self) -> dict[str, np.ndarray]:
        return coordinates(self.force_fit)

    @cached_property
    def _unseen(self) -> np.ndarray:
        """Residual force on runs that are left out (N), shape (p,); nan where nothing is fitted that could see them."""
        return np.full(self.force_fit.dropped.shape, np.nan) if self.by_hand else heldout_residual(self.force_fit)

    @cached_property
    def _floor(self) -> np.ndarray:
        return deviations(self.force_fit)

    def _summed(self, residual: np.ndarray) -> Sums:
        return sums(self.force_fit, residual, self._floor)

    def _errors(self, residual: np.ndarray, measure: Callable[[np.ndarray, np.ndarray], float]) -> pandas.DataFrame:
        return error_table(self.force_fit, self._summed(residual), measure)

    def _finish(self, run: Run) -> None:
        finish(run, self)

    def _parts(self) -> list[Any]:
        unseen = f"{self.unseen_error:.3g} on unseen runs"
        if not np.isfinite(self.unseen_error):
            unseen = "none on unseen runs, " + ("for nothing is fitted" if self.by_hand else "with one event only")
        what = {
            "campaign": self.campaign.title,
            "model": " + ".join(self.parts),
            "error": f"{self.error:.3g} floors of this model on fitted runs, {unseen}",
            "parameters": "set by hand" if self.by_hand else None,
        }
        rows = self.correlations.itertuples(index=False)
        tied = ", ".join(f"{one} and {other} ({r:.2f})" for one, other, r in rows if abs(r) > TIED)
        table = self.parameters[["value", "std", "unit"]].assign(origin=origins(self.parameters))
        return [facts(what), FLOOR, table, *([f"determined only together: {tied}"] if tied else []), self.errors]


@contextmanager
def _told(title: str, text: str) -> Iterator[None]:
    """Shows the shares of the work within, where somebody sees them."""
    with reporting(title, None) as tell, portion(0.0, 1.0, partial(tell, text)):
        yield


def fit(
    campaign: Campaign, effects: str | Sequence[str] = (), *, holdout: str | Sequence[str] = (),
    key: str = "effects", profiles: Sequence[str] = (), progress: Tell | None = None,
) -> Fit:  # fmt: skip
    """Fit the dynamic model along the measured motion (see :meth:`Campaign.fit`).

    Args:
        campaign: the runs.
        effects: to add to the base, in this order.
        holdout: runs that no fit sees.
        key: what an error calls the effects.
        profiles: parameters that will be asked for: a wrong name is an error before anything is fitted.
        progress: told the stage and the share of it done.
    """
    forms = chosen(several(effects), key)
    try_laws(catalogue.get(tag) for tag, _ in forms)
    prepared = campaign.prepare(holdout)
    own = [f.name for tag, form in forms for f in effect_parameters(catalogue.get(tag)(**form))]
    known = [f.name for f in prepared.problem.composition.shared] + own
    for name in profiles:
        if name not in known:
            raise ArgumentError("no free parameter of that name", key="profiles", value=name, hint=nearest(name, known))
    with reporting("fitting", progress) as tell:
        return Fit(campaign, climb(prepared, forms, tell))
