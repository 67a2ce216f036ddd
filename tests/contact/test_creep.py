"""Creep curves: averages, virtual time, sweeps equal to loops, derivatives, speed of the end."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    RoughLines,
    bank_from_contact,
    creep_curve,
    creep_displacements,
    default_loads,
    equal_bodies,
    from_heights,
    indentation,
    power_law_bank,
    sphere,
    static_contact,
    virtual_time,
)
from stickslip.physics.model import LoadPoint

L = 20e-6
SMALL = {"lines": 6, "n_springs": 512}


def small(H=0.3, h_rms=2.46e-6, normal_force=0.31, friction=0.21, **drive):
    """A curve of few lines with few springs."""
    return creep_curve(RoughLines(H, h_rms, **SMALL).contact(normal_force, friction), **drive)


def one_line(**drive):
    return creep_curve(RoughLines(lines=1).contact(), **drive)


def test_curve_of_the_paper():
    curve = creep_curve()
    assert float(curve.force[-1]) == pytest.approx(4 * 0.21 * 0.31)
    assert 0.9e-6 < float(curve.u_max) < 1.0e-6
    assert 0.13 < float(curve.u_max_spread / curve.u_max) < 0.18
    assert float(curve.stiffness) == pytest.approx(2.5e5, rel=0.03)
    assert float(curve.contact_share) == pytest.approx(0.13, abs=0.01)
    assert curve.n_springs == 4096
    assert float(curve.u[-1]) == pytest.approx(float(curve.u_max), rel=1e-12)
    assert (np.diff(curve.u) > 0).all()
    assert (np.diff(curve.t) > 0).all()


def test_virtual_time():
    force, u = np.array([0.0, 0.1, 0.26]), np.array([0.0, 1e-7, 1e-6])
    assert np.allclose(virtual_time(force, u, 1000, 5e-5, "paper"), force / 0.05)
    exact = np.asarray(virtual_time(force, u, 1000, 5e-5))
    assert np.allclose(1000 * (5e-5 * exact - u), force, rtol=1e-12, atol=1e-18)
    assert np.allclose(small(time="paper").t, small().force / 0.05)


def test_speed_is_shared_between_spring_and_contact():
    """c_s v0/(k_t + c_s), from the virgin stiffness down to that of the last spring that sticks in each contact."""
    one = one_line()
    speeds = np.diff(one.u) / np.diff(one.t)
    start = one_line(tau=np.array([0.0, 1e-6]))
    assert float(start.u[1] / start.t[1]) == pytest.approx(1000 * 5e-5 / (4 * float(one.stiffness) + 1000), rel=1e-9)
    last_spring = 4 * equal_bodies().tangential * 20e-6 / 4096
    assert speeds[-1] == pytest.approx(1000 * 5e-5 / (last_spring + 1000), rel=1e-6)
    assert (np.diff(speeds) > -1e-9 * speeds[-1]).all()


def test_both_averages_by_hand():
    tau = default_loads(30)
    z = np.asarray(RoughLines(0.3, **SMALL).heights)
    contact = static_contact(indentation(from_heights(z, L / 512)), 0.31, 0.21)
    curve = small(tau=tau)
    assert np.allclose(curve.u, contact.displacement(tau[:, None]).mean(axis=1), rtol=1e-12)
    assert np.array_equal(curve.tau, tau)
    other = small(tau=tau, average="force")
    assert np.allclose(other.tau, contact.force(other.u[:, None]).mean(axis=1) / (0.21 * 0.31), rtol=1e-12)
    assert float(other.u[-1]) == pytest.approx(float(contact.u_max.max()))
    assert float(other.u[-1]) > 1.1 * float(curve.u[-1])


def test_default_loads_lie_evenly_in_displacement():
    steps = np.diff(creep_curve(tau=default_loads(50)).u)
    assert steps.max() < 2 * steps.mean()
    assert np.diff(creep_curve(tau=np.linspace(0, 1, 50)).u).max() > 8 * steps.mean()


def test_sweep_equals_the_loop():
    rng = np.random.default_rng(2)
    h, f, mu = (rng.uniform(*ends, (30, 1)) for ends in ((1e-6, 4e-6), (0.1, 0.5), (0.1, 1.0)))
    tau = default_loads(7)
    lines = RoughLines(0.2, 1.0, **SMALL).indentation
    sweep = creep_displacements(static_contact(lines.scaled(h), f, mu), tau, memory=80 * 6 * 7 * 4)
    loop = np.stack([small(0.2, *map(float, p), tau=tau).u for p in np.hstack([h, f, mu])])
    assert sweep.shape == (30, 7)
    assert np.allclose(sweep, loop, rtol=1e-12, atol=1e-20)


def test_scalars_broadcast_in_a_sweep():
    lines = RoughLines(0.3, 1.0, **SMALL).indentation
    sweep = creep_displacements(
        static_contact(lines.scaled(np.array([[1e-6], [2e-6], [3e-6]])), 0.31, 0.21), [0.5, 1.0]
    )
    assert (np.diff(sweep, axis=0) > 0).all()


def test_vmap_over_H_equals_the_loop():
    H = jnp.array([0.2, 0.4, 0.8])
    together = jax.vmap(lambda h: small(h).u)(H)
    assert np.allclose(together, np.stack([small(float(h)).u for h in H]), rtol=1e-12, atol=1e-22)


@pytest.fixture(scope="module")
def differentiable():
    """A curve of four loads as a function of (H, h_rms, normal_force, friction), where, and its Jacobians both ways."""
    tau = np.array([0.2, 0.5, 0.9, 1.0])
    curve = jax.jit(lambda q: creep_curve(RoughLines(*q[:2], lines=20, n_springs=2048).contact(*q[2:]), tau=tau).u)
    point = np.array([0.3, 2.46e-6, 0.31, 0.21])
    return curve, point, np.asarray(jax.jacfwd(curve)(point)), np.asarray(jax.jacrev(curve)(point))


@pytest.mark.parametrize("which", range(4), ids=["H", "h_rms", "normal_force", "friction"])
def test_derivatives_against_a_ladder_of_steps(differentiable, which):
    """Steps that pass no spring's first touch agree to rounding; larger ones to the size of the kinks they pass."""
    curve, point, forward, reverse = differentiable
    exact, direction = forward[:, which] * point[which], np.eye(4)[which] * point[which]
    assert (np.abs(exact) > 1e-9).all()
    assert np.allclose(forward[:, which], reverse[:, which], rtol=1e-9)
    for step, tolerance in ((1e-1, 5e-2), (1e-2, 3e-2), (1e-3, 2e-2), (1e-4, 5e-3), (1e-5, 1e-6), (1e-6, 1e-6)):
        difference = np.asarray(curve(point + step * direction) - curve(point - step * direction)) / (2 * step)
        assert np.abs(difference / exact - 1).max() < tolerance, step


def test_derivatives_pass_through_the_whole_curve():
    gradient = jax.jacfwd(lambda q: small(*q[:4], spring_stiffness=q[4], velocity=q[5]).t[-1])(
        jnp.array([0.3, 2.46e-6, 0.31, 0.21, 1000.0, 5e-5])
    )
    assert np.isfinite(gradient).all()
    assert float(gradient[5]) == pytest.approx(-float(small().t[-1]) / 5e-5, rel=1e-12)


def test_creep_accelerates_with_the_power_of_the_remaining_time():
    """v ~ (t_end - t)^-(1 - 1/p): a sphere, p = 1.5, in the form of time without the block's own motion."""
    curve = creep_curve(
        static_contact(indentation(sphere(30e-6, 100_000, 1e-3)), 0.31, 0.21),
        tau=1 - np.geomspace(1, 1e-4, 60),
        time="paper",
    )
    end = 4 * 0.21 * 0.31 / 0.05
    v = np.diff(curve.u) / np.diff(curve.t)
    left = end - 0.5 * np.asarray(curve.t[1:] + curve.t[:-1])
    slope = np.polyfit(np.log(left[20:]), np.log(v[20:]), 1)[0]
    assert slope == pytest.approx(-(1 - 1 / 1.5), abs=0.01)


@pytest.mark.parametrize(
    "change",
    [
        {"H": 1.2},
        {"h_rms": 0.0},
        {"normal_force": -1.0},
        {"friction": 0.0},
        {"velocity": 0.0},
        {"spring_stiffness": -5.0},
        {"contacts": 0},
        {"tau": [0.5, 1.5]},
        {"average": "displacment"},
        {"time": "papr"},
    ],
    ids=str,
)
def test_bad_input_is_refused(change):
    with pytest.raises(InputError):
        small(**change)


@pytest.mark.parametrize(
    "change",
    [
        {"length": 0.0},
        {"n_springs": 3},
        {"lines": 0},
        {"lines": 2.5},
        {"h_rms": "0 um"},
        {"h_rms": [1e-6, 2e-6]},
        {"roll_off": -1e-6},
        {"cut_off": 0.0},
        {"length": "2 kg"},
    ],
    ids=str,
)
def test_bad_lines_are_refused(change):
    with pytest.raises(InputError):
        RoughLines(**{**SMALL, **change})


def test_lengths_are_text_with_a_unit_too_and_heights_a_list():
    one = RoughLines(h_rms="2 um", length="10 um", cut_off="0.1 um", **SMALL)
    same = RoughLines(h_rms=[2e-6] * 6, length=1e-5, cut_off=1e-7, **SMALL)
    assert np.abs(np.asarray(one.heights - same.heights)).max() < 1e-12 * 2e-6
    assert np.allclose(same.contact([0.31] * 6).displacement(0.5), one.contact(0.31).displacement(0.5), rtol=1e-12)


def test_what_is_no_contact_or_has_unequal_loads_is_refused_with_the_way_out():
    lines = RoughLines(**SMALL)
    for make in (creep_curve, bank_from_contact, lambda c: creep_displacements(c, [1.0])):
        with pytest.raises(InputError, match=r"RoughLines\(H=0\.3\)\.contact\(\)"):
            make(lines)
    unequal = lines.contact(np.linspace(0.1, 0.5, 6))
    with pytest.raises(InputError, match="bank_from_contact takes unequal contacts"):
        creep_curve(unequal)
    with pytest.raises(InputError, match=r"shape \(P, 1\)"):
        creep_displacements(unequal, [1.0])
    alone = creep_displacements(static_contact(lines.indentation, 0.31, 0.21), [0.5, 1.0])
    assert np.allclose(alone, [small(tau=np.array([0.5, 1.0])).u], rtol=1e-12)


def test_a_curve_shows_its_ends_and_not_its_points():
    curve = creep_curve(RoughLines(lines=2, n_springs=64).contact())
    text = repr(curve)
    assert len(text) < 250 and "400 points; u: 0 m to " in text and "force: 0 N to 260.4 mN" in text
    assert "260.4 mN (of all contacts)" in text and "kN/m (of one contact)" in text
    assert "n_springs: 64" in text and f"{1e9 * float(curve.u[-1]):.4g} nm" in text
    seen = []
    jax.jit(lambda c: seen.append(repr(c)) or c.u)(curve)
    assert seen == ["CreepCurve(400 points, traced)"]


def test_text_with_a_unit_is_the_same_as_its_number_in_si():
    lines, same = RoughLines(H="0.3", h_rms="2 um", **SMALL), RoughLines(0.3, 2e-6, **SMALL)
    text = creep_curve(
        lines.contact("310 mN", "0.21", equal_bodies("210 GPa")), spring_stiffness="1 N/mm", velocity="50 um/s"
    )
    number = creep_curve(same.contact(0.31, 0.21, equal_bodies(210e9)), spring_stiffness=1000.0, velocity=5e-5)
    assert all(np.array_equal(a, b) for a, b in zip(text, number, strict=True))
    several = same.contact(["310 mN", "0.4 N", *[0.3] * (same.lines - 2)])
    np.testing.assert_allclose(several.normal_force, [0.31, 0.4, *[0.3] * (same.lines - 2)], rtol=1e-15)
    point = static_contact(indentation(sphere("0.1 mm", 64, "3 mm")), "300 mN", 0.2)
    assert float(point.strength) == pytest.approx(0.06, rel=1e-15)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: RoughLines(**SMALL).contact(normal_force="310 mm"), "normal_force: the unit 'mm' is not one of N"),
        (lambda: RoughLines(**SMALL).contact(normal_force="310"), "normal_force: the unit is missing"),
        (lambda: RoughLines(**SMALL).contact(normal_force="-3 mN"), "normal_force: the normal force is out of range"),
        (lambda: creep_curve(spring_stiffness="1 kg"), "spring_stiffness: the unit 'kg' is not one of N/m"),
        (lambda: RoughLines(roll_off="2 s"), "roll_off: the unit 's' is not one of m"),
        (lambda: equal_bodies("210"), "youngs_modulus: the unit is missing"),
        (lambda: power_law_bank("0.26 N", "0 um", 2.0), "u_max: u_max is out of range"),
        (lambda: LoadPoint(["0 s", "1 s"], ["0 m", "5 kg"]), "load_point.positions: the unit 'kg' is not one of m"),
    ],
)
def test_a_text_that_cannot_be_a_quantity_is_named_with_its_argument(make, said):
    with pytest.raises(InputError, match=f"^{said}"):
        make()


def test_traced_quantities_pass():
    """Checks of ranges and units leave what jit, a derivative or vmap goes through as it is."""

    def reach(force):
        return RoughLines(n_springs=64, lines=2).contact(force, 0.21).u_max.mean() * force

    value, slope = jax.value_and_grad(reach)(jnp.asarray(0.31))
    assert float(jax.jit(reach)(0.31)) == pytest.approx(float(value), rel=1e-9) and np.isfinite(slope)
    strengths = jax.vmap(lambda f: power_law_bank(f, "1 um", 2.0).total_strength)(jnp.array([0.1, 0.2]))
    np.testing.assert_allclose(strengths, [0.1, 0.2], rtol=1e-9)


def test_contacts_and_banks_show_sizes_with_units_and_no_arrays():
    contact = RoughLines(lines=3, n_springs=64).contact("310 mN")
    moduli = "Moduli(normal=115.4 GPa, tangential=95.02 GPa)"
    said = f"StaticContact(normal_force=310 mN, friction=0.21, moduli={moduli}, lines=3, n_springs=64)"
    bank = power_law_bank("0.26 N", "1 um", 2.0)
    text = "Bank(128 elements, total_stiffness=518.6 kN/m, total_strength=260 mN, threshold=5.217 nm to 1 µm)"
    assert (repr(contact), repr(bank), repr(contact.moduli)) == (said, text, moduli)
    assert "h_rms=1 µm to 2 µm" in repr(RoughLines(h_rms=[1e-6, 2e-6], lines=2))
    seen = []
    jax.jit(lambda *parts: seen.extend(map(repr, parts)))(contact, bank)
    moduli = "Moduli(normal=traced, tangential=traced)"
    assert seen == [
        f"StaticContact(normal_force=traced, friction=traced, moduli={moduli}, lines=3, n_springs=64)",
        "Bank(stiffness=f64[128], strength=f64[128])",
    ]
    jax.jit(lambda x: seen.append(repr(contact) + repr(bank)) or x)(1.0)  # known, though within what is traced
    assert seen[-1] == said + text
    for part in eqx.partition((contact, bank), lambda leaf: False):
        assert "StaticContact" in repr(part)
