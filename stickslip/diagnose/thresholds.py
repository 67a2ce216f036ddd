"""The numbers a verdict rests on: one place, the same for every campaign.

Set on simulated development campaigns (see docs/diagnosis); not to be changed for a single case. Frozen on 22 November
2026 (all code as of commit 31d6964), before the first case of the sealed run with seed 20261127 (docs/challenge.md);
``border`` and ``fewest`` had the same values then, in ``verdict``. Rules that use them were added since: what is about
to be named, alone or in a set, must stand beside what it may be taken for and a base fitted again from where it
arrived, a model that describes all once it is fitted again is complete, and effects are taken out again from an
``unknown`` as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Thresholds:
    """When is nothing missing, and when is an effect named.

    Attributes:
        complete: phase -> largest error (floors), training and held-out, at which the model is complete. Set to what
            nearly all of the development campaigns without a missing effect stay below (docs/diagnosis).
        alike: largest that events may have in common, in any phase (standard deviations of what is expected of that).
        overall: largest error over all phases together, training and held-out, at which it is: an effect may be spread
            so thinly that no single phase shows it.
        gain: an effect must take off at least this share of the training cost.
        ample: from this share on the unseen cycles need but agree (``unseen``, ``standard_errors``); what takes
            off less must be plain there (``plain``, ``clearly``).
        unseen: share of the score on unseen cycles that must go, which few cycles tell poorly.
        plain: the same where the gain on the fitted cycles is not ample.
        adequate: factor on the limits of ``complete`` and ``alike`` that the model with the named effect must meet;
            above it something else is missing.
        remainder: factor on them up to which a misfit that no effect explains is called a small one.
        significant: an effect must lower the training cost by at least the square of this for each of its parameters.
        rival: the runner-up must cost at least this factor more; otherwise the data cannot tell them apart.
        failed: a base fit with a larger error (floors) is not ranked.
        standard_errors: least gain on held-out cycles over its standard error.
        clearly: by how many of them a rival must be worse on unseen cycles to be left out: what fits as well stays a
            rival until the unseen cycles speak plainly. And the least gain over its standard error where that on the
            fitted cycles is not ample.
        border: share of a parameter's range: nearer to an end of it than this a fit has not stopped by itself.
        fewest: unseen cycles that tell a standard error.
    """

    complete: Mapping[str, float] = field(
        default_factory=lambda: {"creep": 1.5, "slip": 1.1, "ring-down": 1.2, "recurrence": 1.6, "hold": 1.3}
    )
    alike: float = 3.0
    overall: float = 1.1
    gain: float = 0.1
    ample: float = 0.25
    adequate: float = 2.0
    remainder: float = 1.3
    significant: float = 3.0
    rival: float = 1.15
    failed: float = 300.0
    unseen: float = 0.1
    plain: float = 0.25
    standard_errors: float = 1.0
    clearly: float = 2.0
    border: float = 0.004
    fewest: int = 2


THRESHOLDS = Thresholds()
