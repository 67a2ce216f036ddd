"""Without a hidden effect and on the same springs the generator moves as the package's model does.

The two share no law and no solver, so they differ by their discretisations only: the tolerance of every figure is
twice what halving the generator's step changes (it is of second order) and what ten times the solver's tolerance
changes.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from same_springs import SLIPS, Compared, compare, gap, generated, springs

pytestmark = pytest.mark.slow

VELOCITIES = (5e-5, 4e-4)


@pytest.fixture(scope="module", params=VELOCITIES)
def both(request: pytest.FixtureRequest) -> Compared:
    return compare(3, request.param)


def test_slips_and_creep_agree_within_what_the_steps_cost(both: Compared) -> None:
    assert both.made.onset.size == SLIPS
    for name, apart, halved, tenfold in zip(both.apart._fields, both.apart, both.halved, both.tenfold, strict=True):
        assert apart <= 2 * halved + tenfold, name


def test_what_the_steps_cost_is_little(both: Compared) -> None:
    """Else the tolerances above would say nothing."""
    for cost in (both.halved, both.tenfold):
        assert cost.onset < 1e-5
        assert cost.recurrence < 5e-6
        assert cost.duration < 1e-7
        assert cost.size < 1e-9
        assert cost.creep < 1e-10


def test_long_steps_cost_no_more(both: Compared) -> None:
    assert both.quiet.onset < 1e-5
    assert both.quiet.creep < 1e-10


def test_a_rig_one_per_mille_away_would_be_noticed() -> None:
    rig, bank = springs(3)
    made = generated(rig, bank, VELOCITIES[1])
    for change in ({"damping": rig.damping * 1.001}, {"mu_k": rig.mu_k * 1.001}, {"heal_time": rig.heal_time * 1.001}):
        assert gap(made, generated(replace(rig, **change), bank, VELOCITIES[1], like=made)).size > 1e-9
