"""What all runs share: the rig as the campaign file states it, and the period of the ringing."""

from __future__ import annotations

from collections.abc import Sequence

from ...data.campaign import Campaign, Rig, Unmeasured
from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import InputError
from .resonance import ringing

SHARED = ("mass", "contacts", "normal_force", "friction_coefficient", "youngs_modulus", "poisson_ratio", "line_length",
          "springs")  # fmt: skip
FALLBACK_FREQUENCY = 500.0  # Hz, contact resonance of the paper's rig
FALLBACK_PERIOD = 1.0 / FALLBACK_FREQUENCY


def ring_period(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> float:
    """Period (s) of the contact's resonance: that of the ringing, or 2 ms where none is detected."""
    return ringing(traces, segmentations) or FALLBACK_PERIOD


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
            "the runs have different guesses of 'spring_stiffness', but the dynamic model fits only one",
            file=campaign.path,
            key="trace.spring_stiffness",
            hint="state it where it is known, and one guess for all other runs, or fit them one by one",
        )
    if guesses:
        shared["spring_stiffness"] = guesses[0]
    return campaign.rig.model_copy(update=shared)
