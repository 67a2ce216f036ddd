"""The law of a rough contact that is fitted to a measured backbone."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.backbone import Backbone, power_law
from stickslip.physics.contact import power_law_bank

STRENGTH, U_MAX, P, CONTACTS = 0.26, 0.95e-6, 3.3, 3


@pytest.mark.slow
def test_the_law_scatters_by_the_deviations_it_states():
    u = np.linspace(0.02, 1.6, 60) * 1e-6
    true = np.asarray(power_law_bank(STRENGTH, U_MAX, P, 0.15, contacts=CONTACTS, n=96).backbone(u))
    std, rng = np.full(u.size, 0.004 * STRENGTH), np.random.default_rng(3)
    std[-1] = 1e-6 * STRENGTH  # the law takes its strength from there
    curves = [true + rng.normal(size=u.size) * std for _ in range(30)]
    found = [power_law(Backbone(u, force, std, np.diag(std**2)), CONTACTS) for force in curves]
    for value, name in ((U_MAX, "u_max"), (P, "p")):
        off = np.array([(getattr(law, name) - value) / getattr(law, f"{name}_std") for law in found])
        assert np.sqrt(np.mean(off**2)) == pytest.approx(1.0, rel=0.3)
