"""How the power law of a contact follows from the rough lines behind it."""

import numpy as np
import pytest

from stickslip.data.campaign import Rig
from stickslip.errors import InputError
from stickslip.inference.fit.surface import LINES, LOADS, nearest_exponent, sensitivity
from stickslip.inference.uncertainty import null_directions
from stickslip.physics.contact import RoughLines

KNOWN = {"contacts": 4, "normal_force": 0.31, "friction_coefficient": 0.21, "H": 0.3, "h_rms": 2.46e-6}


def rig(**more) -> Rig:
    return Rig(**{k: v for k, v in (KNOWN | more).items() if v is not None})


def test_a_power_law_is_found_exactly():
    tau = np.linspace(0.05, 0.95, 19)
    p, mismatch = nearest_exponent(tau, 1 - (1 - tau) ** (1 / 2.7))
    assert np.exp(p) == pytest.approx(2.7, rel=1e-6)
    assert mismatch < 1e-7


GUESSED = {"normal_force": {"guess": 0.31, "lower": 0.1, "upper": 0.9},
           "friction_coefficient": {"guess": 0.21, "lower": 0.1, "upper": 0.4}}  # fmt: skip


def together(outputs=None, **more):
    """Names and words of what acts only together behind a contact whose parameters are known to 3 %."""
    found = sensitivity(rig(youngs_modulus=210e9, **more))
    keep = [k for k, name in enumerate(found.outputs) if outputs is None or name in outputs]
    known = 0.03**2 * np.eye(len(keep)) + found.scatter[np.ix_(keep, keep)]
    directions = null_directions(found.names, found.jacobian[keep], known)
    return directions[0] if directions else None


def test_heights_length_and_load_act_only_together():
    """u_max and p are known, and still nothing that makes them is; what is known is u_max seen from the roughness."""
    first = together(outputs=("contact.u_max", "contact.p"), normal_force=GUESSED["normal_force"])
    assert set(first.names) == {"h_rms", "line_length", "normal_force"}
    power = dict(zip(first.names, first.weights, strict=True))
    # lines of self-similar heights: depth = h_rms g(F/(E* L h_rms)), so load and length come in by their ratio alone
    assert power["normal_force"] == pytest.approx(-power["line_length"], rel=1e-3)
    assert 0.2 < power["normal_force"] / power["h_rms"] < 0.7


def test_a_load_that_the_strength_tells_is_not_named():
    measured = together(normal_force=GUESSED["normal_force"])
    assert {"h_rms", "line_length"} <= set(measured.names)
    assert "normal_force" not in measured.names
    # unless friction is not known either
    both = together(**GUESSED)
    assert {"h_rms", "line_length", "normal_force"} <= set(both.names)
    assert "normal_force * friction_coefficient is known to 2.9 %" in both.text


def test_the_derivatives_are_those_of_lines():
    """A load 20 % higher moves the mean u_max and p of lines as the derivatives say; the modulus acts as the length."""
    found = sensitivity(rig(normal_force=GUESSED["normal_force"]))
    column = {name: found.jacobian[:, k] for k, name in enumerate(found.names)}
    change = []
    for load in (0.31 * 1.2**-0.5, 0.31 * 1.2**0.5):
        contact = RoughLines(lines=LINES).contact(load, 0.21)
        curves = np.asarray(contact.displacement(np.append(LOADS, 1.0)[:, None])).T
        shapes = [nearest_exponent(LOADS, u[:-1] / u[-1])[0] for u in curves]
        change.append([np.mean(np.log(curves[:, -1])), np.mean(shapes)])
    slope = (np.array(change[1]) - change[0]) / np.log(1.2)
    assert column["normal_force"][:2] == pytest.approx(slope, rel=0.02, abs=1e-3)
    assert column["youngs_modulus"][:2] == pytest.approx(column["line_length"][:2], rel=1e-3, abs=1e-6)
    assert column["normal_force"][found.outputs.index("contact.strength")] == 1.0


def test_lines_pressed_flat_have_no_power_law():
    with pytest.raises(InputError, match="touch over their whole length"):
        sensitivity(rig(h_rms=1e-9))


def test_the_smoothest_lines_have_derivatives_too():
    """A step of the Hurst exponent beyond 1 would be no surface."""
    found = [sensitivity(rig(H=hurst)) for hurst in (0.97, 0.93)]
    at = found[0].names.index("H")
    here, there = (f.jacobian[:2, at] for f in found)
    np.testing.assert_allclose(here, there, rtol=0.25, atol=0.2)
