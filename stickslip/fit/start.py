"""Where a fit of the dynamic model starts: what the campaign file says, and what a glance at the events tells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..campaign import Campaign, Rig, Unmeasured
from ..errors import InputError
from ..features.measurement import Measurement
from ..segment import Segmentation
from ..trace import Trace
from .composition import START, Composition
from .parameters import Free
from .resonance import ringing
from .surface import Guess, surface_prior

SHARED = ("mass", "contacts", "normal_force", "friction_coefficient", "youngs_modulus", "poisson_ratio", "line_length",
          "springs")  # fmt: skip
SHAPE = 3.3  # exponent of the backbone of a self-affine line with H about 0.3
SHAPE_WIDTH = 0.2  # of its logarithm, where the roughness is not known
SPREAD = Guess(0.15, 0.6)  # of ln(u_max) over the contacts, where the roughness is not known
BINS = 96
DAMPING_SHARE = 0.017  # of the critical damping of the contact resonance
FALLBACK_STIFFNESS = 1000.0  # N/m, of a spring of which nothing is known
FALLBACK_FREQUENCY = 500.0  # Hz, contact resonance of the paper's rig
FALLBACK_PERIOD = 1.0 / FALLBACK_FREQUENCY
UNHEARD = (
    f"no ringing is heard after the slips, so the contact's resonance was taken to be {FALLBACK_FREQUENCY:g} Hz, and, "
    "unless the roughness is given, contact.u_max is sought around what follows from that (within a factor of 1.6, one "
    "standard deviation)"
)


def ring_period(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> float:
    """Period (s) of the contact's resonance: that of the ringing, or 2 ms where none is heard (say so: `UNHEARD`)."""
    return ringing(traces, segmentations) or FALLBACK_PERIOD


def _known(value: Any, default: float, width: float) -> tuple[float, float, float | None, float | None, bool]:
    """Guess, width of its logarithm, bounds, and whether it was measured."""
    if isinstance(value, Unmeasured):
        spread = np.log(value.upper / value.lower) / 4.0
        return value.guess, float(max(spread, 0.02)), value.lower, value.upper, False
    if value is None:
        return default, width, None, None, False
    return float(value), 0.0, None, None, True


def shared_rig(campaign: Campaign, names: Sequence[str]) -> Rig:
    """The rig of all runs. What a trace gives anew counts where all agree; springs may differ from run to run.

    Raises:
        InputError: the runs differ in what the dynamic model takes as one.
    """
    rigs = [campaign.rig_of(name) for name in names]
    shared = {}
    for key in SHARED:
        found = [getattr(rig, key) for rig in rigs]
        if any(value != found[0] for value in found):
            raise InputError(
                f"the runs differ in '{key}', which the dynamic model takes as one for all",
                file=campaign.path,
                key=f"trace.{key}",
                value=", ".join(f"{n}: {v}" for n, v in zip(names, found, strict=True)),
                hint="fit runs that share it as a campaign of their own",
            )
        if found:
            shared[key] = found[0]
    guesses = [rig.spring_stiffness for rig in rigs if isinstance(rig.spring_stiffness, Unmeasured)]
    if any(guess != guesses[0] for guess in guesses):
        raise InputError(
            "the runs have different guesses of 'spring_stiffness', of which the dynamic model fits one",
            file=campaign.path,
            key="trace.spring_stiffness",
            hint="state it where it is known, and one guess for all other runs, or fit them one by one",
        )
    if guesses:
        shared["spring_stiffness"] = guesses[0]
    return campaign.rig.model_copy(update=shared)


def base_composition(
    campaign: Campaign, measurement: Measurement, *, bins: int = BINS, ring: float | None = None
) -> Composition:
    """The base model of a campaign, with starts from its data and priors from its file.

    Args:
        campaign: the rig; what is not measured there is free within its bounds.
        measurement: features of the runs.
        bins: Jenkins elements.
        ring: period of the contact resonance (s); default the one the features were taken with.

    Raises:
        InputError: the mass is not given; the roughness is given by halves, or without load and friction.
    """
    rig, m, s = shared_rig(campaign, measurement.names), measurement, measurement.layout.slices()
    mass, mass_width, lightest, heaviest, weighed = _known(rig.mass, np.nan, 0.0)
    if not np.isfinite(mass):
        raise InputError(
            "the dynamic model needs the mass of the block",
            file=campaign.path,
            key="rig.mass",
            hint='write mass = "0.0894 kg", or weigh it',
        )
    contacts = int(rig.contacts or 1)
    period = float(np.asarray(m.anchors.ring_period).flat[0]) if ring is None else ring
    later = np.asarray(m.cycles.used) & (np.arange(m.values.shape[1]) > 0)
    if not later.any():
        later = np.asarray(m.cycles.used)
    size = float(np.median(m.values[later][:, s["size"]]))
    own = np.asarray(m.cycles.stiffness)
    stated = own[np.isfinite(own)]  # traces may have springs of their own where the rig has none
    usual = float(np.median(stated)) if stated.size else FALLBACK_STIFFNESS
    stiffness, stiffness_width, low, high, measured = _known(rig.spring_stiffness, usual, 0.8)
    times = m.values[later][:, s["times"]]
    # a half-cosine spends 0.75 of its time between the two levels; nucleation and damping lengthen that
    duration = float(np.median(times[:, -1] - times[:, 0])) / 0.83
    if not measured and not stated.size:
        stiffness = float(np.clip(mass * (np.pi / duration) ** 2, low or 1e-3, high or 1e9))
    load, load_width, _, _, _ = _known(rig.normal_force, np.nan, 0.0)
    friction, friction_width, _, _, _ = _known(rig.friction_coefficient, np.nan, 0.15)
    strength_width = max(float(np.hypot(friction_width, load_width)), 0.1)
    first = np.asarray(m.cycles.virgin)
    each = np.where(np.isfinite(own), own, stiffness)
    seen = (m.values[:, 0, 0] * m.velocities * each)[first]
    nominal = friction * load * contacts
    if not np.isfinite(nominal):
        nominal = float(np.median(seen)) if seen.size else 3.0 * stiffness * size
    strength = float(np.median(seen)) if seen.size else nominal
    drop = float(np.clip(0.8 * stiffness * size / strength, 0.02, 0.8))
    try:
        surface = surface_prior(rig)
    except InputError as error:
        raise error.at(file=campaign.path) from None
    shape = Guess(SHAPE, SHAPE_WIDTH) if surface is None else surface.p
    spread = SPREAD if surface is None or surface.spread is None else surface.spread
    # the ringing tells the stiffness of the unloaded contact, p/u_max of its strength
    u_max = shape.value * strength / (mass * (2 * np.pi / period) ** 2)
    reach = Guess(u_max, 0.5) if surface is None else surface.u_max

    def log(
        name: str,
        unit: str,
        start: float,
        width: float,
        lower: float,
        upper: float,
        doc: str,
        prior: float | None = None,
    ) -> Free:
        start = float(np.clip(start, lower * 1.001, upper * 0.999))
        return Free(name, unit, "log", start, start if prior is None else prior, width, lower, upper, doc)

    free = [
        log("contact.strength", "N", strength, strength_width, nominal / 4, nominal * 4,
            "friction force of all contacts at full strength", nominal),
        log("weakening.drop", "1", drop, 0.7, 0.003, 0.95, "1 - kinetic over static friction"),
        log("weakening.slip_distance", "m", 1e-6, 1.0, 1e-8, 1e-4, "slip over which strength is lost"),
        log("weakening.healing_time", "s", 0.01, 1.2, 1e-4, 10.0, "time over which strength returns"),
        log("rig.damping", "N s/m", DAMPING_SHARE * 4 * np.pi * mass / period, 1.0, 0.005, 500.0, "viscous damping"),
        log("contact.u_max", "m", u_max, reach.width, min(u_max, reach.value) / 30, max(u_max, reach.value) * 30,
            "displacement at which the last element slides", reach.value),
        log("contact.p", "1", shape.value, shape.width, 1.2, 9.0, "exponent of the backbone", shape.value),
        log("contact.spread", "1", spread.value, spread.width, 0.01, 0.8, "rms of ln(u_max) over the contacts",
            spread.value),
    ]  # fmt: skip
    fixed = {"rig.spring_stiffness": stiffness}
    if not measured and not np.isfinite(own).all():
        fixed = {}
        prior = rig.spring_stiffness.guess if isinstance(rig.spring_stiffness, Unmeasured) else stiffness
        free.append(
            log("rig.spring_stiffness", "N/m", stiffness, stiffness_width, low or stiffness / 10,
                high or stiffness * 10, "stiffness of the driving spring", prior)
        )  # fmt: skip
    if not weighed:
        assert lightest is not None and heaviest is not None
        free.append(log("rig.mass", "kg", mass, mass_width, lightest, heaviest, "mass of the block", mass))
    for r in np.flatnonzero(~np.asarray(m.cycles.virgin)).tolist():
        doc = f"how far beyond full strength the load point is at the first slip of run {m.names[r]}"
        # the base slips a little before its full strength; effects may change the force at which it slips by a third
        full = nominal / stiffness
        free.append(Free(f"{START}{r}", "m", 0.01 * full, 0.0, 0.0, 15.0, -0.5 * full, 0.5 * full, doc))
    return Composition(mass, contacts, bins, tuple(free), fixed)
