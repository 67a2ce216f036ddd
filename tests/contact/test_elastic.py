"""Effective moduli."""

import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import equal_bodies, two_bodies


def test_steel_on_steel():
    moduli = equal_bodies(210e9, 0.3)
    assert moduli.normal == pytest.approx(1.1538e11, rel=1e-4)
    assert moduli.tangential == pytest.approx(9.502e10, rel=1e-4)
    assert moduli.normal / moduli.tangential == pytest.approx(1.21429, rel=1e-5)


@pytest.mark.parametrize("nu", [0.0, 0.2, 0.3, 0.5])
def test_ratio_is_mindlins(nu):
    moduli = equal_bodies(70e9, nu)
    assert moduli.normal / moduli.tangential == pytest.approx((2 - nu) / (2 * (1 - nu)), rel=1e-14)


def test_rigid_second_body_doubles_the_moduli():
    one, both = equal_bodies(210e9, 0.3), two_bodies(210e9, 0.3, 1e30, 0.3)
    assert both.normal == pytest.approx(2 * one.normal, rel=1e-12)
    assert both.tangential == pytest.approx(2 * one.tangential, rel=1e-12)


@pytest.mark.parametrize("young, nu", [(0.0, 0.3), (-1e9, 0.3), (210e9, 0.51), (210e9, -1.0), (float("nan"), 0.3)])
def test_out_of_range(young, nu):
    with pytest.raises(InputError, match="out of range"):
        equal_bodies(young, nu)
