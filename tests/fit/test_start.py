"""Where a dynamic fit starts when springs are stated for single traces."""

import numpy as np
import pytest

from stickslip.campaign import Rig, load_campaign, load_traces
from stickslip.errors import InputError
from stickslip.features.measurement import measure
from stickslip.fit.start import FALLBACK_FREQUENCY, base_composition, ring_period, ringing
from stickslip.fit.surface import surface_prior
from stickslip.segment import segment

RIG = 'schema = 1\n[rig]\nmass = "89.4 g"\ncontacts = 4\nnormal_force = "0.31 N"\nfriction_coefficient = 0.2\n'
TRACE = """[[trace]]
name = "{name}"
file = "a.csv"
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "um" }}
drive_velocity = "50 um/s"
virgin = true
"""


@pytest.fixture
def start(tmp_path):
    """The base model of a campaign of two such traces, with what is said of springs in the rig and in the traces."""
    t = np.arange(0.0, 4.5, 1e-3)
    x = 0.5 * t
    for end in (1.0, 2.0, 3.0, 4.0):
        x += 24.75 * (1 - np.cos(np.pi * np.clip((t - end + 0.03) / 0.03, 0, 1)))
    np.savetxt(tmp_path / "a.csv", np.column_stack([t, x]), delimiter=",", fmt="%.9g")

    def compose(rig, *traces):
        path = tmp_path / "c.toml"
        path.write_text(RIG + rig + "".join(TRACE.format(name=f"t{i}") + extra for i, extra in enumerate(traces)))
        loaded = load_campaign(path)
        found = load_traces(loaded)
        return base_composition(loaded, measure(found, [segment(t) for t in found], ring_period=2e-3))

    return compose


SPRING = 'spring_stiffness = "3000 N/m"\n'


def test_springs_of_the_traces_are_as_good_as_the_rig_s(start):
    of_rig, of_traces = start(SPRING, "", ""), start("", SPRING, SPRING)
    assert of_rig.fixed["rig.spring_stiffness"] == of_traces.fixed["rig.spring_stiffness"] == 3000.0
    assert of_traces.free == of_rig.free


def test_a_trace_without_a_spring_starts_from_the_others(start):
    found = start("", SPRING, "")
    (stiffness,) = [f for f in found.free if f.name == "rig.spring_stiffness"]
    assert stiffness.start == pytest.approx(3000.0)


def test_where_no_spring_is_stated_the_slips_tell_it(start):
    found = start("", "", "")
    (stiffness,) = [f for f in found.free if f.name == "rig.spring_stiffness"]
    # half a period of the block on its spring, stretched by how a slip is timed
    assert stiffness.start == pytest.approx(0.0894 * (np.pi / 0.03) ** 2, rel=0.3)


def test_the_roughness_is_the_prior_of_the_contact(start):
    rough = 'H = 0.3\nh_rms = "2.46 um"\n'
    before = {f.name: f for f in start(SPRING, "").free}
    after = {f.name: f for f in start(SPRING + rough, "").free}
    prior = surface_prior(Rig(contacts=4, normal_force=0.31, friction_coefficient=0.2, H=0.3, h_rms=2.46e-6))
    for name, guess in (("u_max", prior.u_max), ("p", prior.p), ("spread", prior.spread)):
        assert after[f"contact.{name}"].prior == pytest.approx(guess.value)
        assert after[f"contact.{name}"].width == pytest.approx(guess.width)
        assert before[f"contact.{name}"].prior != pytest.approx(guess.value, rel=1e-3)
    # the ringing still tells where to begin, with the shape of the lines
    stiffness = [f["contact.p"].start / f["contact.u_max"].start for f in (before, after)]
    assert stiffness[0] == pytest.approx(stiffness[1])


def slips(folder, ring):
    """Five slips at 10 kHz read in counts of 8 nm, each followed by ringing of the given size (m) at 430 Hz."""
    t = np.arange(0.0, 4.5, 1e-4)
    rng = np.random.default_rng(2)
    x = 0.5e-6 * t + 5e-9 * rng.standard_normal(t.size)
    for end in (0.8, 1.6, 2.4, 3.2, 4.0):
        x += 19.6e-6 * (1 - np.cos(np.pi * np.clip((t - end + 0.03) / 0.03, 0, 1)))
        after = np.clip(t - end, 0, None)
        x += ring * np.sin(2 * np.pi * 430 * after) * np.exp(-after / 0.01)
    np.savetxt(folder / "a.csv", np.column_stack([t, np.round(x / 8e-9) * 8e-3]), delimiter=",", fmt="%.9g")
    (folder / "c.toml").write_text(RIG + SPRING + TRACE.format(name="a"))
    traces = load_traces(load_campaign(folder / "c.toml"))
    found = [segment(t) for t in traces]
    assert len(found[0].events) == 5
    return traces, found


def test_the_ringing_tells_the_contact_s_resonance(tmp_path):
    assert 1.0 / ring_period(*slips(tmp_path, 1e-7)) == pytest.approx(430.0, rel=0.05)


def test_noise_is_no_ringing(tmp_path):
    """The highest peak of noise is somewhere, often at the slow end; a contact a hundred times as soft would follow."""
    record = slips(tmp_path, 0.0)
    assert ringing(*record) is None
    assert ring_period(*record) == 1.0 / FALLBACK_FREQUENCY


def test_what_every_trace_gives_anew_is_the_rig_s(start):
    anew = SPRING + 'mass = "300 g"\nnormal_force = "0.9 N"\n'
    assert start("", anew, anew).mass == 0.3


def test_runs_of_different_rigs_are_refused(start):
    with pytest.raises(InputError, match="differ in 'mass'") as error:
        start(SPRING, "", 'mass = "300 g"\n')
    assert error.value.file is not None
    assert "t1: 0.3" in str(error.value)


def test_half_a_roughness_is_refused_with_its_place(start):
    with pytest.raises(InputError, match="says nothing without") as error:
        start(SPRING + "H = 0.3\n", "")
    assert str(error.value.file).endswith("c.toml")
