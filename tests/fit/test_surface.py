"""The prior of a contact that follows from the roughness of a rig."""

import contextlib
import io
import json

import numpy as np
import pytest
import xarray

from stickslip.campaign import Rig
from stickslip.challenge.generator.lines import Surface, press, rough_line
from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.fit.effective import effective_line
from stickslip.fit.static_table import StaticRig
from stickslip.fit.surface import nearest_exponent, sensitivity, surface_prior
from stickslip.report.fit_figures import residual_plots
from stickslip.uncertainty import null_directions

from . import synthetic

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


@pytest.fixture
def short_run(tmp_path):
    """One run of the model with known parameters, two slips under noise of 30 nm: too little to tell the contact.

    The normal load is recorded beside it, growing by a tenth from 1.2 N.
    """
    (trace,) = synthetic.traces((1e-4,), slips=2.6)
    um = 1e6 * np.asarray(trace.displacement) + 0.03 * np.random.default_rng(3).standard_normal(trace.time.size)
    load = 1.2 * (1 + 0.1 * np.asarray(trace.time) / trace.time[-1])
    np.savetxt(tmp_path / "a.csv", np.column_stack([trace.time, um, load]), delimiter=",", fmt="%.10g")

    def fitted(more):
        path = tmp_path / "c.toml"
        path.write_text(
            f"""schema = 1
[rig]
mass = "89.4 g"
contacts = 4
normal_force = "0.31 N"
friction_coefficient = {0.26 / 4 / 0.31}
spring_stiffness = "1000 N/m"
{more}
[[trace]]
name = "a"
file = "a.csv"
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "um" }}
normal_load = {{ column = 3, unit = "N" }}
drive_velocity = "100 um/s"
virgin = true
"""
        )
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            where = ["--out", str(tmp_path / "out"), "--force"]
            assert run(["fit", str(path), "--starts", "1", "--most-events", "2", "--json", *where]) == 0
        return json.loads(out.getvalue())

    return fitted


def test_the_roughness_narrows_a_whole_fit_and_follows_from_it(short_run, tmp_path):
    true = {"contact.u_max": synthetic.TRUTH["contact.u_max"][1], "contact.p": synthetic.TRUTH["contact.p"][1]}
    line = effective_line(*true.values(), StaticRig(0.31, 0.26 / 4 / 0.31, 4, 1000.0))
    without, known = short_run(""), short_run(f'H = {line.hurst}\nh_rms = "{1e6 * line.h_rms} um"')
    prior = surface_prior(rig(friction_coefficient=0.26 / 4 / 0.31, H=line.hurst, h_rms=line.h_rms))
    for name, guess in (("contact.u_max", prior.u_max), ("contact.p", prior.p)):
        far, near = (result["parameters"][name] for result in (without, known))
        assert near["std"] / near["value"] < 0.6 * far["std"] / far["value"]
        # it is the mean of what the data say alone and of the prior, by their widths
        own, prior_width = far["std"] / far["value"], guess.width
        mean = np.average(np.log([far["value"], guess.value]), weights=[own**-2, prior_width**-2])
        assert abs(np.log(near["value"]) - mean) < near["std"] / near["value"]
        assert near["std"] / near["value"] < 1.1 * prior_width
        assert abs(near["value"] - true[name]) < 2 * near["std"]
    # both say which rough line has the curve of all contacts together
    spread = synthetic.TRUTH["contact.spread"][1]
    together = effective_line(*true.values(), StaticRig(0.31, 0.26 / 4 / 0.31, 4, 1000.0), spread)
    for result in (without, known):
        found = result["effective"]
        assert abs(found["H"] - together.hurst) < 2 * found["H_std"]
        assert abs(found["h_rms"] - together.h_rms) < 2 * found["h_rms_std"]
    assert known["effective"]["H"] == pytest.approx(together.hurst, abs=0.1)
    assert known["effective"]["h_rms"] == pytest.approx(together.h_rms, rel=0.2)
    assert known["effective"]["H_std"] < without["effective"]["H_std"] < 0.5
    for result in (without, known):
        assert f"H = {result['effective']['H']:.2f}" in result["effective"]["text"]
        assert any("h_rms" in text and "line_length" in text for text in result["identifiability"])
    assert "Prior of the contact from the rig's H and h_rms: u_max = 890 nm" in known["effective"]["text"]
    assert "Prior" not in without["effective"]["text"]
    # the load that was measured is not in the model: said, and the errors stand beside it
    assert "a: normal_load is not used by the models" in known["dropped"][0]
    with xarray.open_dataset(tmp_path / "out" / "arrays.nc") as arrays:
        load = arrays["cycle_normal_load"].values
        assert residual_plots(arrays).axes[4].get_xlabel() == "measured normal load / N"
    assert 1.2 < load[0] < load[-1] < 1.32
