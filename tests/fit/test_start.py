"""Where a dynamic fit starts from what the campaign file says, and the ringing that is detected in the records."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.errors import InputError
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.fit.stated_rig import FALLBACK_FREQUENCY, ring_period, ringing

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

    def compose(more, *traces, rig=RIG):
        path = tmp_path / "c.toml"
        path.write_text(rig + more + "".join(TRACE.format(name=f"t{i}") + extra for i, extra in enumerate(traces)))
        loaded = load_campaign(path)
        found = load_traces(loaded)
        return prepare(loaded, found, [segment(t) for t in found]).problem.composition

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


def test_a_guessed_mass_is_fitted_within_its_bounds(start):
    weighed = start(SPRING, "")
    text = '{ guess = "90 g", lower = "80 g", upper = "100 g" }'
    found = start(SPRING, "", rig=RIG.replace('"89.4 g"', text))
    (mass,) = [f for f in found.free if f.name == "rig.mass"]
    assert (mass.start, mass.lower, mass.upper) == pytest.approx((0.09, 0.08, 0.1))
    assert not [f for f in weighed.free if f.name == "rig.mass"]


def test_a_guess_of_a_spring_in_a_trace_counts(start):
    guess = 'spring_stiffness = { guess = "2500 N/m", lower = "2000 N/m", upper = "3500 N/m" }\n'
    found = start("", SPRING, guess)
    (stiffness,) = [f for f in found.free if f.name == "rig.spring_stiffness"]
    assert (stiffness.lower, stiffness.upper, stiffness.prior) == pytest.approx((2000.0, 3500.0, 2500.0))
    with pytest.raises(InputError, match="different guesses"):
        start("", guess, guess.replace("2500", "2600"))


RATE, COUNT = 1e4, 8e-9
ARRESTS = (0.8, 1.6, 2.4, 3.2, 4.0)


def bare_slips(ring, frequency=430.0, lasting=0.01):
    """Positions at 10 kHz of five slips, each followed by ringing of the given size (m), without noise and counts."""
    t = np.arange(0.0, 4.5, 1 / RATE)
    x = 0.5e-6 * t
    for end in ARRESTS:
        x += 19.6e-6 * (1 - np.cos(np.pi * np.clip((t - end + 0.03) / 0.03, 0, 1)))
        after = np.clip(t - end, 0, None)
        x += ring * np.sin(2 * np.pi * frequency * after) * np.exp(-after / lasting)
    return t, x


def counted(x):
    return np.round(x / COUNT) * COUNT


def slips(folder, ring, **decay):
    """Five slips read with noise in counts of 8 nm."""
    t, x = bare_slips(ring, **decay)
    x = counted(x + 5e-9 * np.random.default_rng(2).standard_normal(t.size))
    np.savetxt(folder / "a.csv", np.column_stack([t, x * 1e6]), delimiter=",", fmt="%.9g")
    (folder / "c.toml").write_text(RIG + SPRING + TRACE.format(name="a"))
    traces = load_traces(load_campaign(folder / "c.toml"))
    found = [segment(t) for t in traces]
    assert len(found[0].events) == len(ARRESTS)
    return traces, found


def test_the_ringing_tells_the_contact_s_resonance(tmp_path):
    assert 1.0 / ring_period(*slips(tmp_path, 1e-7)) == pytest.approx(430.0, rel=0.05)


@pytest.mark.parametrize(("frequency", "lasting"), [(500.0, 3e-3), (500.0, 2e-3), (800.0, 1.5e-3), (250.0, 5e-3)])
def test_ringing_that_dies_within_a_few_periods_is_detected(tmp_path, frequency, lasting):
    detected = ringing(*slips(tmp_path, 1e-7, frequency=frequency, lasting=lasting))
    assert detected is not None
    assert 1.0 / detected == pytest.approx(frequency, rel=0.08)


def test_noise_is_no_ringing(tmp_path):
    """The highest peak of noise is somewhere, often at the slow end; a contact a hundred times as soft would follow."""
    record = slips(tmp_path, 0.0)
    assert ringing(*record) is None
    assert ring_period(*record) == 1.0 / FALLBACK_FREQUENCY


def coloured(rng, size, slope):
    """Noise whose power falls as the frequency to the power ``slope``, as loud as 5 nm of white noise at 300 Hz."""
    frequency = np.fft.rfftfreq(size, 1 / RATE)
    spectrum = rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)
    weight = np.where(frequency > 0.2, np.maximum(frequency, 0.2) / 300.0, np.inf) ** (-slope / 2)
    return np.fft.irfft(5e-9 * np.sqrt(size / 2) * spectrum * weight, size)


@pytest.mark.slow
@pytest.mark.parametrize("events", [1, 2, 5])
@pytest.mark.parametrize("noise", ["white", "counts", "1/f", "1/f^2", "drift"])
def test_noise_of_any_colour_rings_in_less_than_one_record_of_a_hundred(tmp_path, noise, events):
    (trace,), (found,) = slips(tmp_path, 0.0)
    found = replace(found, events=found.events[:events])
    clean = bare_slips(0.0)[1]
    rng = np.random.default_rng(events)
    detected, draws = 0, 100
    for _ in range(draws):
        x = clean + {"counts": 1e-9}.get(noise, 5e-9) * rng.standard_normal(clean.size)
        if noise in ("1/f", "1/f^2", "drift"):
            x += (10.0 if noise == "drift" else 1.0) * coloured(rng, clean.size, 1.0 if noise == "1/f" else 2.0)
        detected += ringing([trace.replace(displacement=counted(x))], [found]) is not None
    assert detected < 0.01 * draws


@pytest.mark.parametrize("size", [2e-8, 1e-6])
def test_hum_is_no_ringing(tmp_path, size):
    (trace,), found = slips(tmp_path, 0.0)
    hum = size * np.sin(2 * np.pi * 150.0 * np.asarray(trace.time))
    assert ringing([trace.replace(displacement=trace.displacement + hum)], found) is None


def test_settling_is_no_ringing(tmp_path):
    (trace,), found = slips(tmp_path, 0.0)
    x = np.array(trace.displacement)
    for end in ARRESTS:
        after = np.clip(np.asarray(trace.time) - end, 0, None)
        x += 1e-7 * (1 - np.exp(-after / 5e-3)) + 1e-7 * np.log1p(after / 1e-3)
    assert ringing([trace.replace(displacement=x)], found) is None


def test_what_every_trace_gives_anew_is_the_rig_s(start):
    anew = SPRING + 'mass = "300 g"\nnormal_force = "0.9 N"\n'
    assert start("", anew, anew).mass == 0.3


def test_runs_of_different_rigs_are_refused(start):
    with pytest.raises(InputError, match="differ in 'mass'") as error:
        start(SPRING, "", 'mass = "300 g"\n')
    assert error.value.file is not None
    assert "t1: 0.3" in str(error.value)
