"""Rate-and-state friction against an independent integration (scipy) and the known critical stiffness."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from marching import bank_of, march, spread_out, still_model
from scipy.integrate import solve_ivp

from stickslip.effects.rate_and_state import RateAndState
from stickslip.model import LoadPoint
from stickslip.solve import Tolerance, integrate

STRENGTH = 0.26
MASS = 0.0894
RIGID = bank_of(1e10, STRENGTH)  # an element that yields 26 pm before it slides
LAWS = ["ageing", "slip"]


def state_rate(law, phi, v, d_c, v_star):
    """d/dt ln(theta v*/D_c) from Dieterich's and Ruina's laws with V = v + v*, in their original variable."""
    theta = np.exp(phi) * d_c / v_star
    slip = (v + v_star) * theta / d_c
    return (1.0 - slip if law == "ageing" else -slip * np.log(slip)) / theta


def factor(b, ratio, v_star, phi, v):
    return 1.0 + b * (ratio * np.log(1.0 + v / v_star) + phi)


@pytest.mark.parametrize("law", LAWS)
def test_velocity_steps(law):
    """Friction after steps up and down by a decade, and under a speed that swings by four decades."""
    b, ratio, d_c, v_star = 0.05, 0.6, 2e-6, 1e-8
    effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
    parts = [(2.0, 3e-6, 20), (0.5, 3e-5, 31), (3.0, 3e-6, 20), (20.0, 3e-8, 10)]
    dt, v = spread_out(parts)
    t = np.cumsum(dt)
    force, _, _ = march(RIGID, [effect], dt, v)
    phi = [np.log(-np.expm1(-100.0 * v_star / d_c))]
    for duration, speed, n in parts:
        at = np.linspace(0, duration, n + 1)[1:]
        solution = solve_ivp(
            lambda t, y, s=speed: [state_rate(law, y[0], s, d_c, v_star)],
            (0, duration),
            [phi[-1]],
            t_eval=at,
            method="LSODA",
            rtol=1e-11,
            atol=1e-13,
        )
        phi.extend(solution.y[0])
    expected = STRENGTH * factor(b, ratio, v_star, np.array(phi[1:]), v)
    change = np.ptp(expected)
    np.testing.assert_allclose(force[:, 0], expected, atol=1e-4 * change)
    assert t.size == expected.size and change > 0.05 * STRENGTH


@pytest.mark.parametrize("law", LAWS)
def test_steady_sliding_weakens_by_b_minus_a(law):
    b, ratio = 0.04, 0.25
    effect = RateAndState(evolution=b, ratio=ratio, cutoff_velocity=1e-8, slip_distance=1e-6, law=law)
    force = [march(RIGID, [effect], *spread_out([(3e-5 / v, v, 60)]))[0][-1, 0] for v in (1e-5, 1e-4)]
    expected = -b * (1 - ratio) * STRENGTH * np.log((1 + 1e4) / (1 + 1e3))
    assert force[1] - force[0] == pytest.approx(expected, rel=1e-6)


class Rigid:
    """The block as scipy solves it: rigid contact, events where it stops and where it breaks loose."""

    def __init__(self, law, b, ratio, d_c, v_star, spring, damping, drive):
        self.law, self.b, self.ratio, self.d_c, self.v_star = law, b, ratio, d_c, v_star
        self.spring, self.damping, self.drive = spring, damping, drive

    def free(self, t, x, phi, v):
        """Force left over to accelerate the block (N)."""
        grip = STRENGTH * factor(self.b, self.ratio, self.v_star, phi, v)
        return self.spring * (self.drive(t) - x) - grip - self.damping * v

    def sliding(self, t, y):
        x, v, phi = y
        v = max(v, 0.0)
        return [v, self.free(t, x, phi, v) / MASS, state_rate(self.law, phi, v, self.d_c, self.v_star)]

    def stuck(self, t, y):
        return [0.0, 0.0, state_rate(self.law, y[2], 0.0, self.d_c, self.v_star)]

    def run(self, y, kinks, t_eval):
        """Displacements (m) at ``t_eval`` (s)."""

        def stops(t, y):
            return y[1]

        def loosens(t, y):
            return self.free(t, y[0], y[2], 0.0)

        stops.terminal, stops.direction = True, -1
        loosens.terminal, loosens.direction = True, 1
        xs = [np.full(np.sum(t_eval <= 0.0), y[0])]
        t, slides = 0.0, y[1] > 0.0
        for end in kinks:
            while t < end:
                rate, event = (self.sliding, stops) if slides else (self.stuck, loosens)
                inside = t_eval[(t_eval > t) & (t_eval <= end)]
                s = solve_ivp(
                    rate,
                    (t, end),
                    y,
                    events=event,
                    method="Radau",
                    rtol=1e-9,
                    atol=[1e-14, 1e-13, 1e-11],
                    dense_output=True,
                    max_step=(end - t) / 20,
                )
                xs.append(s.sol(inside[inside <= s.t[-1]])[0])
                t, y = float(s.t[-1]), s.y[:, -1].copy()
                if s.status == 1:
                    slides = not slides
                    y[1] = 1e-15 if slides else 0.0
        return np.concatenate(xs)


def compare(law, *, ratio, spring, damping, positions, times, d_c=1e-5, v_star=1e-7, b=0.05, relative=1e-4):
    """The same motion by the package and by scipy: displacements (m) at equal times."""
    effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
    model = still_model(RIGID, effect, damping=damping, spring=spring)
    drive = LoadPoint(jnp.asarray(times), jnp.asarray(positions))
    model = type(model)(model.block, model.bank, model.weakening, drive, model.effects)
    trajectory, _ = integrate(
        model, times[-1], stops=times[1:-1], tolerance=Tolerance(relative, 1e-9 * relative, 1e-5 * relative)
    )
    t = np.linspace(0, times[-1], 2001)
    reference = Rigid(law, b, ratio, d_c, v_star, spring, damping, lambda t: np.interp(t, times, positions))
    phi = np.log(-np.expm1(-100.0 * v_star / d_c))
    x = reference.run(np.array([0.0, 0.0, phi]), times[1:], t)
    return t, trajectory.at(t).x, x


@pytest.mark.parametrize("law", LAWS)
def test_slide_hold_slide(law):
    """A spring stiff enough for steady sliding; holds of 1 s and 10 s; the peaks agree."""
    times = [0.0, 6.0, 7.0, 9.0, 19.0, 21.0]
    speed = [5e-5, 0.0, 5e-5, 0.0, 5e-5]
    positions = np.append(0.0, np.cumsum(np.diff(times) * speed))
    t, ours, theirs = compare(law, ratio=0.7, spring=3000.0, damping=1.0, positions=positions, times=times)
    pull = [3000.0 * (np.interp(t, times, positions) - x) for x in (ours, theirs)]
    late = t > 1.0
    change = np.ptp(pull[1][late])
    assert np.max(np.abs(pull[0] - pull[1])) < 1e-4 * STRENGTH
    assert change > 0.05 * STRENGTH


@pytest.mark.parametrize("law", LAWS)
def test_stick_slip(law):
    """Far below the critical stiffness the block slips by bursts; displacements agree wherever it is slow between them.

    The damping lets it come to rest gently: a rigid block that stops with a jerk has no counterpart with elements.
    """
    times, positions = [0.0, 6.0], [1.55e-3, 2.75e-3]
    t, ours, theirs = compare(law, ratio=0.3, spring=150.0, damping=10.0, positions=positions, times=times)
    speed = np.gradient(theirs, t)
    bursts = np.flatnonzero(np.diff((speed > 4e-4).astype(int)) == 1)
    quiet = speed < 2e-5
    assert bursts.size >= 3 and np.sum(quiet) > 100 and np.any(quiet[bursts[-1] - 200 : bursts[-1]])
    assert np.max(np.abs(ours - theirs)[quiet]) < 1e-4 * theirs[-1]


@pytest.mark.parametrize("law", LAWS)
def test_critical_stiffness(law):
    """Steady sliding loses stability at (b - a) F/D_c (1 + m v^2/(a F D_c)) (Rice & Ruina 1983).

    Around it a small disturbance grows and decays at the rate that the linearised equations have there.
    """
    b, ratio, d_c, v_star, v = 0.05, 0.6, 2e-6, 1e-10, 5e-4
    a = b * ratio
    critical = (b - a) * STRENGTH / d_c * (1.0 + MASS * v**2 / (a * STRENGTH * d_c))
    for stability in (0.94, 1.0, 1.06):
        spring = stability * critical
        roots = np.roots([MASS, MASS * v / d_c + a * STRENGTH / v, spring - (b - a) * STRENGTH / d_c, spring * v / d_c])
        pair = roots[np.argmax(roots.imag)]
        assert np.sign(np.round(pair.real, 6)) == np.sign(1.0 - stability)
        effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
        model = still_model(RIGID, effect, velocity=v, spring=spring)
        phi = -np.log(1 + v / v_star)
        grip = jnp.array([STRENGTH * factor(b, ratio, v_star, phi, v)])
        rest = model.rest(x=-float(grip[0]) / spring, v=v)
        disturbed = (jnp.asarray(phi + 1e-3),)
        state = eqx.tree_at(lambda s: (s.force, s.cap, s.memory), rest, (grip, grip, disturbed))
        trajectory, _ = integrate(model, 0.25, state=state, largest_step=2e-4)
        t = np.linspace(0.03, 0.25, 4001)
        swing = trajectory.at(t).v - v
        waves = np.exp(pair.real * t)[:, None] * np.stack([np.cos(pair.imag * t), np.sin(pair.imag * t)], axis=1)
        early, late = (np.linalg.lstsq(waves[part], swing[part], rcond=None)[0] for part in (t < 0.1, t > 0.18))
        grown = np.log(np.linalg.norm(late) / np.linalg.norm(early))  # beyond what the roots predict
        assert abs(grown) < 0.02
        assert np.linalg.norm(early) > 1e-8
