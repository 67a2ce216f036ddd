"""Forward-mode derivatives through diffrax against differences over a ladder of steps.

The derivative is that of the discrete solution. Differences over small steps see the same; over large ones they see the
curve that the discrete solution follows, see docs/verification.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.simulation.solve import Tolerance, integrate

from .derivatives import BASE, NAMES, Outcome, build, creep_displacements, differences, outcome, trace
from .rig import DEFAULT, tighter

pytestmark = pytest.mark.slow

START, EARLY, END = 5.13, 5.16, 5.23  # s; the slip begins at 5.18 s


@functools.cache
def _slip():
    """Outcomes of one slip by steps of 2e-5 s as a function of theta, and their derivatives (parameter, outcome)."""
    _, state = integrate(build(jnp.zeros(len(BASE))), START, tolerance=tighter(100.0))
    n = round((END - START) / 2e-5)

    def outcomes(theta):
        return jnp.stack(outcome(*trace(jnp.asarray(theta), state, START, END, Tolerance(), n, False), EARLY))

    return outcomes, _columns(outcomes)


def _columns(function):
    zero = jnp.zeros(len(BASE))
    return np.stack([np.asarray(jax.jvp(function, (zero,), (e,))[1]) for e in jnp.eye(len(BASE))])


def test_creep_onset_slip_and_peak_in_every_parameter():
    """Displacement before the slip, its onset, size and peak velocity: two rungs of the ladder."""
    function, exact = _slip()
    assert exact.shape == (len(NAMES), len(Outcome._fields))
    assert np.all(exact != 0.0)
    scale = np.max(np.abs(exact), axis=0)
    for step in (1e-7, 1e-8):
        assert differences(function, step) / scale == pytest.approx(exact / scale, rel=2e-3, abs=2e-5)


def test_creep_and_onset_hold_on_coarser_rungs():
    """Where neither ringing nor a jump of the load at the start comes in, it is the slope of the curve as well."""
    function, exact = _slip()
    smooth = [NAMES.index(n) for n in ("mass", "damping", "slip_distance", "healing_time")]
    scale = np.max(np.abs(exact[smooth]), axis=0)[:2]
    for step in (1e-4, 1e-5, 1e-6):
        seen = differences(function, step, smooth)[:, :2] / scale
        assert seen == pytest.approx(exact[smooth, :2] / scale, abs=2e-3)


def test_creep_curve_with_adaptive_steps():
    function = creep_displacements(DEFAULT, (2.0, 4.0))
    exact = _columns(function)
    scale = np.max(np.abs(exact), axis=0)
    for step in (1e-3, 1e-4, 1e-5):
        assert differences(function, step) / scale == pytest.approx(exact / scale, abs=1e-3)
    # what each parameter does to slow creep: the drive and the contact rule, inertia does not
    of = dict(zip(NAMES, exact[:, 1] / np.max(exact[:, 1]), strict=True))
    assert of["velocity"] > 0.5
    assert of["p"] < -0.1
    assert abs(of["mass"]) < 1e-4
