"""Rough lines and effects of geometry as laws of a measured backbone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from stickslip.blind.generator.lines import Surface, press, rough_line
from stickslip.data.campaign import Rig
from stickslip.effects import make
from stickslip.errors import InputError
from stickslip.inference.diagnose.backbone_laws import Shape, judged, section, shape_of
from stickslip.inference.diagnose.stepwise_selection import Verdict, with_shape
from stickslip.inference.fit.static_table import StaticRig
from stickslip.inference.force import geometry
from stickslip.inference.force.backbone import Backbone, power_law
from stickslip.inference.force.geometry import Laws, geometry_laws, in_logarithms
from stickslip.inference.force.rough_contacts import RoughContacts, rough_contacts
from stickslip.physics.contact import Bank, RoughLines, bank_from_contact

pytestmark = pytest.mark.slow

HURST, HEIGHT, LOAD, FRICTION, CONTACTS = 0.3, 2.46e-6, 0.31, 0.21, 4
KNOWN = {"contacts": CONTACTS, "normal_force": LOAD, "friction_coefficient": FRICTION, "line_length": 20e-6}
STATED = {"H": HURST, "h_rms": HEIGHT}
NODES, BAND = 40, 1e-3
STATIC = StaticRig(LOAD, FRICTION, CONTACTS, 1000.0)


@pytest.fixture(scope="module", autouse=True)
def table() -> RoughContacts:
    """Of four contacts, made once."""
    return rough_contacts(CONTACTS, 4096)


def measured(force: Callable[[np.ndarray], np.ndarray], seed: int, band: float = BAND) -> Backbone:
    """What a free bank would say of a curve: a polygon through it, with an error whose covariance is known."""
    u = np.geomspace(2e-9, 4e-6, 600)
    f = force(u)
    strength = f[-1]
    # nodes where the curve bends, as a fit places them
    bend = np.maximum(-np.gradient(np.gradient(f, u), u) * u**2, 0.0)
    density = np.cbrt(np.convolve(bend, np.full(20, 0.05), "same"))
    share = 0.75 * np.cumsum(density) / density.sum() + 0.25 * np.arange(1, u.size + 1) / u.size
    nodes = np.exp(np.interp(np.linspace(share[5], 1.0, NODES), share, np.log(u)))
    play = np.vstack([np.minimum(u[:, None] / nodes, 1.0), np.full(NODES, 30.0)])
    weights, _ = nnls(play, np.append(f, 30.0 * strength), maxiter=50 * NODES)
    curve = np.minimum(nodes[:, None] / nodes, 1.0) @ weights
    correlation = np.exp(-0.5 * (np.log(nodes[:, None] / nodes) / 0.3) ** 2) + 0.01 * np.eye(NODES)
    covariance = band**2 * np.outer(curve, curve) * correlation
    error = np.linalg.cholesky(covariance + 1e-30 * np.eye(NODES)) @ np.random.default_rng(seed).standard_normal(NODES)
    return Backbone(nodes, np.maximum.accumulate(curve + error), np.sqrt(np.diag(covariance)), covariance)


def independent(seed: int) -> Callable[[np.ndarray], np.ndarray]:
    """Four contacts of the challenge's generator, pressed and pulled spring by spring by code that shares nothing."""
    surface, rng = Surface(hurst=HURST, h_rms=HEIGHT), np.random.default_rng(seed)
    caps = np.concatenate([FRICTION * press(surface, rough_line(surface, rng), LOAD) for _ in range(CONTACTS)])
    caps.sort()
    below = np.append(0.0, np.cumsum(caps))

    def force(u: np.ndarray) -> np.ndarray:
        pull = surface.tangential_spring * u
        sliding = np.searchsorted(caps, pull)
        return below[sliding] + pull * (caps.size - sliding)

    return force


def of_bank(bank: Bank) -> Callable[[np.ndarray], np.ndarray]:
    return lambda u: np.asarray(bank.backbone(u))


def rig_with(**more: Any) -> Rig:
    return Rig(**{name: value for name, value in (KNOWN | more).items() if value is not None})


def laws(curve: Backbone, tags: tuple[str, ...] | None = None, **rig: Any) -> Shape:
    found = geometry_laws(curve, rig_with(**rig), tags)
    return judged(curve, power_law(curve, CONTACTS), found)


def test_lines_of_another_simulator_come_back_within_the_stated_errors():
    lines = [laws(measured(independent(seed), seed), ()).line for seed in range(10)]
    hurst, std = np.array([(line.hurst, line.hurst_std) for line in lines if not line.edge]).T
    assert hurst.size >= 7
    pulls = (hurst - HURST) / std
    assert abs(pulls.mean()) < 1.0
    assert 0.5 < np.sqrt(np.mean(pulls**2)) < 1.6
    heights = np.log([line.h_rms / HEIGHT for line in lines])
    assert abs(heights.mean()) < 0.15
    assert 0.5 < np.std(hurst) / std.mean() < 1.6
    assert all(line.misfit < 1.3 for line in lines)
    assert all(0.3 < line.correlation < 1.0 for line in lines if not line.edge)


def test_the_truth_is_as_far_from_the_nearest_line_as_two_parameters_allow():
    """With the roughness stated chi-square is that of the shape, and lies little above that of the nearest line."""
    far = []
    for seed in range(12):
        curve = measured(independent(100 + seed), seed)
        stated = geometry._Comparison(curve, Rig(**KNOWN, **STATED))
        line, _ = stated.rough_line()
        assert (line.hurst, line.h_rms, line.hurst_std, line.h_rms_std) == (HURST, HEIGHT, 0.0, 0.0)
        free = geometry._Comparison(curve, Rig(**KNOWN))
        free.white = stated.white
        begun = (np.array([h, np.log(HEIGHT)]) for h in (0.15, 0.35, 0.6))
        far.append(line.cost - min(free._solve(free.free, z).cost for z in begun))
    assert 0.4 < np.median(far) < 3.5  # 1.4; the mean says little, for now and then a line has one high summit
    assert min(far) > -1e-6


def test_the_table_is_that_of_lines_sorted_for_these_parameters():
    alone = RoughContacts(1, 1024, lines=40)
    rig = StaticRig(LOAD, FRICTION, 1, 1000.0, n_springs=1024)
    for hurst, height in ((0.23, 3e-6), (0.66, 1.7e-6)):
        lines = RoughLines(hurst, height, rig.length, n_springs=1024, lines=40)
        u = np.asarray(lines.contact(LOAD, FRICTION).displacement(alone.tau[:, None]))
        expected = np.log(u).mean(axis=1)
        part = alone.tau > 0.02
        found = np.log(alone.displacement(rig, hurst, height))
        assert np.abs(found - expected)[part].max() < 1e-2  # a twentieth of the scatter
        spread = np.log(u)[alone.sparse].std(axis=1, ddof=1) * np.sqrt(1.0 + 1.0 / 40.0) / np.sqrt(1.0 - 1.0 / 40.0)
        assert np.sqrt(np.diag(alone.covariance(rig, hurst, height))) == pytest.approx(spread, rel=0.05)


def test_contacts_scatter_as_those_of_another_simulator(table):
    tau = np.array([0.1, 0.5, 0.9])
    logs = []
    for seed in range(60):
        u = np.geomspace(2e-9, 4e-6, 3000)
        f = independent(seed)(u)
        logs.append(np.log(np.interp(tau, f / f[-1], u)))
    place = np.searchsorted(table.tau[table.sparse], tau)
    variance = np.diag(table.covariance(STATIC, HURST, HEIGHT))[place]
    assert np.std(logs, axis=0) == pytest.approx(np.sqrt(variance), rel=0.3)  # three times its error
    mean = np.interp(tau, table.tau, np.log(table.displacement(STATIC, HURST, HEIGHT)))
    assert np.abs(np.mean(logs, axis=0) - mean).max() < 4.0 * np.sqrt(variance.max() * (1 / 60 + CONTACTS / 300))


def test_the_covariance_of_logarithms_is_that_of_curves_drawn_anew():
    curve = measured(independent(3), 3, band=3e-4)
    tau = np.linspace(0.1, 0.9, 9)
    _, covariance = in_logarithms(curve, tau)
    exact, sag = in_logarithms(Backbone(curve.displacement, curve.force, 0 * curve.std, 0 * curve.covariance), tau)
    assert (np.diag(sag) > 0.0).all() and np.count_nonzero(sag) == tau.size
    rng = np.random.default_rng(0)
    root = np.linalg.cholesky(curve.covariance)
    drawn = []
    for _ in range(2000):
        force = curve.force + root @ rng.standard_normal(NODES)
        other = Backbone(curve.displacement, force, 0 * curve.std, 0 * curve.covariance)
        drawn.append(in_logarithms(other, tau)[0] - exact)
    wanted = np.cov(np.array(drawn).T)
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((covariance - sag - wanted) / np.outer(scale, scale)).max() < 0.15


def test_an_error_common_to_all_forces_is_none_of_the_shape():
    curve = measured(independent(3), 3)
    common = Backbone(curve.displacement, curve.force, 0.01 * curve.force, 1e-4 * np.outer(curve.force, curve.force))
    exact = Backbone(curve.displacement, curve.force, 0 * curve.std, 0 * curve.covariance)
    tau = np.linspace(0.1, 0.9, 9)
    (_, covariance), (_, sag) = (in_logarithms(c, tau) for c in (common, exact))
    assert np.abs(covariance - sag).max() < 1e-12


def test_an_effect_at_its_null_is_the_line():
    comparison = geometry._Comparison(measured(independent(0), 0), Rig(**KNOWN, **STATED))
    values = comparison._values(np.zeros(0))
    u, tau, strength = comparison._law(values, None, 0.0)
    assert strength == pytest.approx(CONTACTS * LOAD * FRICTION)
    for tag in ("curvature", "roll-off", "plasticity", "adhesion", "unequal-contacts"):
        added = geometry._Added(tag, {}, {})
        v, share, total = comparison._law(values, added, added.span[0])
        assert total == pytest.approx(strength, rel=1e-9)
        assert np.interp(u, v, share) == pytest.approx(tau, abs=1e-9)
    half = geometry._Added("roll-off", {}, {})
    v, share, _ = comparison._law(values, half, half.free.inward(0.5))
    assert np.abs(np.interp(u, v, share) - tau).max() > 0.02


def test_an_amplitude_at_the_limit_of_what_is_visible_gains_five_deviations_squared(table):
    """Without an error of any kind: the mean curve itself, reshaped."""
    u = table.displacement(STATIC, HURST, HEIGHT)
    slope = np.diff(table.tau * STATIC.friction_force, prepend=0.0) / np.diff(u, prepend=0.0)
    stiffness = np.maximum(slope - np.append(slope[1:], 0.0), 0.0)
    bank = Bank(stiffness, stiffness * u)
    tags = ("machine-compliance",)

    def found(amplitude: float) -> Any:
        shaped = make("machine-compliance", where="series", compliance=amplitude).reshape(bank)
        reach = np.sort(np.asarray(shaped.threshold))
        force = np.asarray(shaped.backbone(reach))
        covariance = np.diag((1e-6 * force) ** 2)
        curve = Backbone(reach, force, 1e-6 * force, covariance)
        return laws(curve, tags, **STATED).laws[0].shaped

    none = found(0.0)
    assert none.gain < 0.01
    seen = found(none.visible)
    assert seen.gain == pytest.approx(25.0, rel=0.05)
    assert seen.amplitude == pytest.approx(none.visible, rel=0.02)


def test_an_effect_of_ten_deviations_is_told_where_the_roughness_is_known_and_only_there():
    lines = bank_from_contact(RoughLines(HURST, HEIGHT, lines=CONTACTS, seed=200).contact(LOAD, FRICTION), 400)
    compliance = 9e-7
    curve = measured(of_bank(make("machine-compliance", where="series", compliance=compliance).reshape(lines)), 1)
    tags = ("adhesion", "curvature", "machine-compliance")
    known = laws(curve, tags, **STATED)
    (named,) = known.close
    # the same gain over lines of a roughness that nobody measured names nothing
    unsure = replace(known.line, stated=("H",))
    nothing = judged(curve, known.power, Laws(unsure, None, tuple(law.shaped for law in known.laws)))
    assert nothing.close == () and not any(row["unique"] for row in section(nothing)["laws"])
    assert "h_rms is not stated" in section(nothing)["laws"][0]["text"]
    assert named.tag == "machine-compliance"
    assert abs(named.shaped.amplitude - compliance) < 3.0 * named.shaped.std < compliance
    assert named.shaped.gain > 50.0
    row = next(r for r in section(known)["laws"] if r["tag"] == named.tag)
    assert row["unique"] and row["amplitude"]["unit"] == "m/N"
    assert "machine-compliance" in section(known)["text"]
    # some other roughness has the same curve
    assert known.unstated.cost < known.line.cost - 50.0
    unknown = laws(curve, tags)
    assert unknown.close == ()
    assert max(law.shaped.gain for law in unknown.laws) < 25.0
    assert not any(row["unique"] for row in section(unknown)["laws"])
    assert "not stated" in section(unknown)["laws"][0]["text"]


def test_indistinguishable_effects_are_a_set():
    """A flank as of a smooth sphere and asperities that all yield: both bring the last elements nearer to the first."""
    lines = bank_from_contact(RoughLines(HURST, HEIGHT, lines=CONTACTS, seed=200).contact(LOAD, FRICTION), 400)
    known = laws(measured(of_bank(make("curvature", share=1.0).reshape(lines)), 1), **STATED)
    assert {law.tag for law in known.close} == {"curvature", "plasticity"}
    assert not any(row["unique"] for row in section(known)["laws"])
    assert "cannot distinguish it from" in section(known)["text"]


def test_where_nothing_is_hidden_nothing_is_named():
    for seed in range(3):
        curve = measured(independent(300 + seed), seed)
        found = laws(curve, **STATED)
        assert found.close == ()
        assert all(law.chance > 0.01 for law in found.laws)
        assert {law.tag for law in found.laws} >= {
            "curvature",
            "roll-off",
            "plasticity",
            "adhesion",
            "unequal-contacts",
        }
        assert all(law.shaped.visible is None or law.shaped.visible > 0.0 for law in found.laws)


def test_a_guessed_roughness_is_a_prior():
    curve = measured(independent(0), 0)
    guess = {"H": {"guess": 0.3, "lower": 0.25, "upper": 0.35},
             "h_rms": {"guess": 2.46e-6, "lower": 2.2e-6, "upper": 2.75e-6}}  # fmt: skip
    line = laws(curve, (), **guess).line
    assert line.stated == ("H", "h_rms")
    assert 0.0 < line.hurst_std < 0.026
    assert laws(curve, ()).line.hurst_std > 0.08
    assert abs(line.hurst - 0.3) < 0.05


def test_what_is_guessed_of_the_rig_widens_the_height():
    curve = measured(independent(6), 6)
    known = laws(curve, ()).line
    height = laws(curve, (), H=HURST).line
    assert (height.hurst, height.hurst_std, height.stated) == (HURST, 0.0, ("H",))
    length = laws(curve, (), H=HURST, line_length={"guess": 20e-6, "lower": 5e-6, "upper": 80e-6}).line
    assert length.guessed == ("line_length",)
    assert length.h_rms_std / length.h_rms > 1.5 * height.h_rms_std / height.h_rms
    # a friction that is guessed is what the strength says, whatever the guess
    friction = laws(curve, (), friction_coefficient={"guess": 0.27, "lower": 0.1, "upper": 0.6}).line
    assert friction.hurst == pytest.approx(known.hurst, abs=0.02)
    assert friction.h_rms == pytest.approx(known.h_rms, rel=0.03)


@pytest.mark.parametrize("missing", ["normal_force", "friction_coefficient"])
def test_without_load_or_friction_it_says_what_is_missing(missing, monkeypatch):
    curve = measured(independent(7), 7)
    with pytest.raises(InputError, match=missing):
        laws(curve, **{missing: None})
    monkeypatch.setattr("stickslip.inference.diagnose.backbone_laws.backbone", lambda fit: curve)
    found = section(shape_of(SimpleNamespace(), rig_with(**{missing: None})))
    assert missing in found["text"]
    assert (found["rough_line"], found["laws"]) == (None, [])
    assert found["u_max"] > 0.0


def test_what_the_backbone_names_is_missing():
    def shape(*tags: str) -> Any:
        return SimpleNamespace(close=tuple(SimpleNamespace(tag=tag) for tag in tags))

    none = Verdict("complete")
    assert with_shape(none, shape()) is none
    assert with_shape(none, shape("curvature")) == Verdict("missing", ("curvature",), ("curvature",))
    both = with_shape(Verdict("missing", ("wear",), ("wear",)), shape("curvature", "plasticity"))
    assert (both.kind, both.effects) == ("ambiguous", ("wear", "curvature"))
    assert both.set == ("wear", "curvature", "plasticity")
    assert with_shape(Verdict("unknown"), shape("curvature")).kind == "unknown"
