"""Contacts, drives and initial states that a scenario asks for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import RoughLines, bank_from_contact, equal_bodies, power_law_backbone
from stickslip.simulation.scenario import build, load_scenario, make_scenario, static_creep
from stickslip.simulation.scenario.contacts import build_contact

from .conftest import rig

LOAD, MU = 0.31, 0.21
COMMON = {"contacts": 4, "normal_force": LOAD, "friction_coefficient": MU}
ROUGH = {"kind": "rough-line", **COMMON, "H": 0.5, "h_rms": 2.46e-6, "springs": 1024, "bins": 200, "seed": 3}


def contact(**table):
    return make_scenario(rig(contact=table)).file.contact


def test_rough_contacts_have_each_their_own_line():
    built = build_contact(contact(**ROUGH))
    lines = RoughLines(0.5, 2.46e-6, lines=4, n_springs=1024, seed=3)
    reference = bank_from_contact(lines.contact(LOAD, MU), 200)
    np.testing.assert_allclose(built.bank.stiffness, reference.stiffness, rtol=1e-9, atol=1e-6)
    assert built.strength == pytest.approx(4 * MU * LOAD, rel=1e-12)
    assert 0.0 < built.contact_share < 0.5


def test_mean_of_lines_is_the_mean_displacement_at_equal_load():
    table = contact(**ROUGH, realisation="mean", lines=20)
    built = build_contact(table)
    curve = static_creep(make_scenario(rig(contact={**ROUGH, "lines": 20})))
    assert repr(curve).startswith("StaticCreep(400 points; u: 0 m to ") and len(repr(curve)) < 100
    inside = slice(1, -1)
    force = np.asarray(built.bank.backbone(curve.u))
    np.testing.assert_allclose(force[inside] / built.strength, curve.tau[inside], atol=2e-4)


def test_unequal_contacts_add_up():
    """A bank of contacts that differ is the sum of the banks of each alone."""
    each = [{"normal_force": 0.2, "h_rms": 1.5e-6}, {"normal_force": 0.4}, {"H": 0.7, "friction_coefficient": 0.3}]
    base = {k: v for k, v in ROUGH.items() if k != "contacts"}
    together = build_contact(contact(**base, each=each)).bank
    u = np.linspace(0.0, 2e-6, 60)
    total = 0.0
    for i, own in enumerate(each):
        table = {**base, **own, "contacts": 3, "bins": 2000}
        lines = build_contact(contact(**table)).bank  # all three lines under the settings of one
        rest = build_contact(contact(**table, each=[{"normal_force": 1e-9} if j == i else {} for j in range(3)])).bank
        total = total + np.asarray(lines.backbone(u)) - np.asarray(rest.backbone(u))
    strength = MU * (0.2 + 0.4) + 0.3 * LOAD
    np.testing.assert_allclose(np.asarray(together.backbone(u)), total, atol=2e-3 * strength)
    assert float(together.total_strength) == pytest.approx(strength, rel=1e-12)


def test_the_binning_error_of_a_rough_contact_is_small():
    """Straight pieces of its backbone, where rounding decides the sign of a bend, do not blow the bound up."""
    path = Path(__file__).parents[2] / "scenarios" / "grzemba2014.toml"
    assert 1e-6 < build(load_scenario(path)).contact.binning_error < 1e-3


def test_the_number_of_springs_of_the_line_changes_a_rough_contact():
    coarse, fine = (build_contact(contact(**{**ROUGH, "H": 0.2, "springs": n})) for n in (256, 8192))
    assert abs(coarse.stiffness / fine.stiffness - 1) > 0.05


def test_sphere_is_cattaneo_mindlin():
    radius = 5e-3
    built = build_contact(contact(kind="sphere", **COMMON, radius=radius, springs=8192, bins=400))
    moduli = equal_bodies()
    a = (0.75 * LOAD * radius / moduli.normal) ** (1 / 3)
    u_max = 3 * MU * LOAD / (4 * moduli.tangential * a)
    assert built.u_max == pytest.approx(u_max, rel=1e-5)
    u = np.linspace(0.05, 0.95, 10) * u_max
    expected = power_law_backbone(u, u_max, 4 * MU * LOAD, 1.5)
    np.testing.assert_allclose(built.bank.backbone(u), expected, rtol=2e-4)
    assert built.warnings == ()


def test_cone_has_the_exponent_two():
    built = build_contact(contact(kind="cone", **COMMON, slope=0.02, springs=8192, bins=400))
    u = np.linspace(0.05, 0.95, 10) * built.u_max
    expected = power_law_backbone(u, built.u_max, 4 * MU * LOAD, 2.0)
    np.testing.assert_allclose(built.bank.backbone(u), expected, rtol=5e-4)


def test_flat_punch_slides_all_at_once():
    built = build_contact(contact(kind="flat-punch", **COMMON, half_width=1e-5))
    u = np.array([0.5, 1.0, 2.0]) * built.u_max
    np.testing.assert_allclose(built.bank.backbone(u) / built.strength, [0.5, 1.0, 1.0], rtol=1e-9)


def test_heights_from_a_file_are_the_profile_they_describe(tmp_path):
    """A measured parabola is the sphere's line."""
    x = np.linspace(-4e-5, 4e-5, 4001)
    rows = "\n".join(f"{a * 1e6!r},{-(a**2) / 5e-3 * 1e9!r}" for a in x.tolist())
    (tmp_path / "scan.csv").write_text(f"x [um],z [nm]\n{rows}\n")
    table = {
        "kind": "heights",
        **COMMON,
        "file": "scan.csv",
        "height": {"column": "z", "unit": "nm"},
        "position": {"column": "x", "unit": "um"},
        "bins": 300,
    }
    measured = build_contact(contact(**table), tmp_path)
    sphere = build_contact(contact(kind="sphere", **COMMON, radius=5e-3, bins=300))
    assert measured.u_max == pytest.approx(sphere.u_max, rel=1e-3)
    assert measured.stiffness == pytest.approx(sphere.stiffness, rel=2e-2)
    with pytest.raises(InputError, match="not there"):
        build_contact(contact(**{**table, "file": "other.csv"}), tmp_path)


def test_saturation_is_a_warning_and_then_an_error():
    half = build_contact(contact(**{**ROUGH, "h_rms": 2.5e-7}))
    assert any("line_length" in text for text in half.warnings)
    with pytest.raises(InputError, match="h_rms"):
        build_contact(contact(**{**ROUGH, "h_rms": 1e-9}))


def test_steady_start_has_the_velocity_of_loading():
    setup = build(make_scenario(rig(drive__start="steady")))
    k = 1000.0
    assert float(setup.start.v) == pytest.approx(k * 2e-4 / (k + setup.contact.stiffness), rel=1e-12)


def test_residual_load_is_balanced_by_the_spring():
    setup = build(make_scenario(rig(contact__residual=1.0)))
    force = float(setup.start.force.sum())
    assert force == pytest.approx(0.7 * setup.contact.strength, rel=1e-9)  # F_r = 2 F_k - F_s at a ratio of 0.85
    pull = 1000.0 * float(setup.model.lead(0.0) - setup.start.x)
    assert pull == pytest.approx(force, rel=1e-9)


def test_drive_in_pieces_and_from_a_file_agree(tmp_path):
    pieces = [{"velocity": 1e-4, "duration": 1}, {"velocity": 0, "duration": 2}, {"velocity": -2e-4, "duration": 1}]
    made = build(make_scenario(rig(drive={"piece": pieces}))).motion
    assert made.stops == (1.0, 3.0)
    assert made.duration == 4.0
    t = np.linspace(0.0, 4.0, 401)
    position = np.interp(t, [0, 1, 3, 4], [0, 1e-4, 1e-4, -1e-4])
    np.testing.assert_allclose(made.position(t), position, atol=1e-15)
    rows = "\n".join(f"{a!r},{b * 1e6!r}" for a, b in zip(t.tolist(), position.tolist(), strict=True))
    (tmp_path / "drive.csv").write_text(f"time,pos\n{rows}\n")
    drive = {"file": "drive.csv", "position": {"column": "pos", "unit": "um"}}
    sampled = build(make_scenario(rig(drive=drive), tmp_path)).motion
    np.testing.assert_allclose(sampled.position(t), position, atol=1.01e-9)
    assert sampled.duration == pytest.approx(4.0)


def test_a_drive_from_a_file_needs_a_unit_and_increasing_times(tmp_path):
    (tmp_path / "drive.csv").write_text("time,pos\n0,0\n1,1\n0.5,2\n")
    with pytest.raises(InputError, match="unit"):
        build(make_scenario(rig(drive={"file": "drive.csv", "position": {"column": "pos"}}), tmp_path))
    drive = {"file": "drive.csv", "position": {"column": "pos", "unit": "um"}}
    with pytest.raises(InputError, match="do not increase"):
        build(make_scenario(rig(drive=drive), tmp_path))


def test_rough_lines_have_more_elements_unless_told_otherwise():
    """Their last springs slide one by one, which 128 elements do not resolve; a smooth backbone needs no more."""
    rough = {key: value for key, value in ROUGH.items() if key != "bins"}
    assert build_contact(contact(**rough)).bank.stiffness.size == 256
    assert build_contact(contact(kind="power-law", **COMMON, u_max=1e-6, p=3.2)).bank.stiffness.size == 128
