"""The prior of a contact that follows from the roughness of a rig."""

import numpy as np
import pytest

from stickslip.campaign import Rig
from stickslip.challenge.generator.lines import Surface, press, rough_line
from stickslip.errors import InputError
from stickslip.fit.surface import nearest_exponent, sensitivity, surface_prior
from stickslip.uncertainty import null_directions

KNOWN = {"contacts": 4, "normal_force": 0.31, "friction_coefficient": 0.21, "H": 0.3, "h_rms": 2.46e-6}


def rig(**more) -> Rig:
    return Rig(**{k: v for k, v in (KNOWN | more).items() if v is not None})


def test_a_power_law_is_found_exactly():
    tau = np.linspace(0.05, 0.95, 19)
    p, mismatch = nearest_exponent(tau, 1 - (1 - tau) ** (1 / 2.7))
    assert np.exp(p) == pytest.approx(2.7, rel=1e-6)
    assert mismatch < 1e-7


def test_the_prior_is_what_real_lines_do():
    """200 lines of the challenge's generator, pressed and pulled spring by spring, by code that shares nothing."""
    surface, rng = Surface(hurst=0.3, h_rms=2.46e-6), np.random.default_rng(5)
    tau = np.linspace(0.02, 0.98, 25)
    found = []
    for _ in range(200):
        normal = press(surface, rough_line(surface, rng), 0.31)
        slide = 0.21 * normal / surface.tangential_spring  # displacement at which each spring slides, ascending
        force = np.array([np.minimum(surface.tangential_spring * u, 0.21 * normal).sum() for u in slide])
        u = np.interp(tau, force / (0.21 * 0.31), slide)
        found.append((np.log(slide[-1]), nearest_exponent(tau, u / slide[-1])[0]))
    lines = np.array(found)
    prior = surface_prior(rig())
    for guess, ln in zip((prior.u_max, prior.p), lines.T, strict=True):
        error = ln.std() * np.sqrt(1 / 200 + 1 / 60)
        assert np.log(guess.value) == pytest.approx(ln.mean(), abs=4 * error)
        # four contacts have half the scatter of one line, but a power law is not quite their curve
        assert ln.std() / 2 * 0.7 < guess.width < ln.std()
    assert prior.spread.value == pytest.approx(lines[:, 0].std() * np.sqrt(3 / 4), rel=0.35)


def test_what_is_guessed_widens_it_and_contacts_narrow_it():
    known = surface_prior(rig())
    vague = surface_prior(rig(h_rms={"guess": 2.46e-6, "lower": 1e-6, "upper": 5e-6}))
    assert vague.u_max.value == known.u_max.value
    assert vague.u_max.width > 1.5 * known.u_max.width
    assert "(guessed)" in vague.text
    assert "(guessed)" not in known.text
    single = surface_prior(rig(contacts=1))
    assert single.u_max.width > 1.5 * known.u_max.width
    assert single.spread is None
    load = surface_prior(rig(normal_force={"guess": 0.31, "lower": 0.1, "upper": 0.9}))
    assert load.u_max.width > known.u_max.width


def test_no_roughness_no_prior():
    assert surface_prior(rig(H=None, h_rms=None)) is None


@pytest.mark.parametrize("missing", ["H", "h_rms", "normal_force", "friction_coefficient"])
def test_half_of_it_is_refused(missing):
    with pytest.raises(InputError) as error:
        surface_prior(rig(**{missing: None}))
    assert missing in str(error.value)
    assert error.value.key == f"rig.{missing}"


@pytest.mark.parametrize("more", [{"youngs_modulus": {"guess": 2e11, "lower": 5e10, "upper": 8e11}},
                                  {"line_length": {"guess": 2e-5, "lower": 5e-6, "upper": 8e-5}}])  # fmt: skip
def test_elasticity_and_length_that_are_guessed_widen_it(more):
    assert surface_prior(rig(**more)).u_max.width > 1.1 * surface_prior(rig()).u_max.width


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


def test_the_derivatives_are_those_of_the_prior():
    """A load 20 % higher moves the prior as the derivatives say; the modulus acts as the length does."""
    found = sensitivity(rig(normal_force=GUESSED["normal_force"]))
    column = {name: found.jacobian[:, k] for k, name in enumerate(found.names)}
    low, high = (surface_prior(rig(normal_force=0.31 * f)) for f in (1.2**-0.5, 1.2**0.5))
    change = [np.log(b.value / a.value) / np.log(1.2) for a, b in zip(low[:2], high[:2], strict=True)]
    assert column["normal_force"][:2] == pytest.approx(change, rel=0.02, abs=1e-3)
    assert column["youngs_modulus"][:2] == pytest.approx(column["line_length"][:2], rel=1e-3, abs=1e-6)
    assert column["normal_force"][found.outputs.index("contact.strength")] == 1.0


def test_lines_pressed_flat_are_no_prior():
    with pytest.raises(InputError, match="touch over their whole length"):
        surface_prior(rig(h_rms=1e-9))
