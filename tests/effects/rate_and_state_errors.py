"""Errors of rate-and-state friction against an independent integration (scipy) and the linearised equations.

The tests judge these numbers, and ``docs/make_verification.py`` tabulates them.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from stickslip.physics.effects.rate_and_state import RateAndState
from stickslip.physics.model import LoadPoint
from stickslip.simulation.solve import Tolerance, integrate
from tests.effects.marching import bank_of, march, spread_out, still_model

STRENGTH = 0.26
MASS = 0.0894
RIGID = bank_of(1e10, STRENGTH)  # an element that yields 26 pm before it slides
LAWS = ("ageing", "slip")
BURST_SPEEDS = (2e-5, 1e-4, 4e-4)  # m/s, at which onsets of bursts are taken
STABILITIES = (0.94, 1.0, 1.06)  # spring over the critical one


def largest(value):
    """The largest magnitude of errors."""
    return float(np.max(np.abs(value)))


def state_rate(law, phi, v, d_c, v_star):
    """d/dt ln(theta v*/D_c) from Dieterich's and Ruina's laws with V = v + v*, in their original variable."""
    theta = np.exp(phi) * d_c / v_star
    slip = (v + v_star) * theta / d_c
    return (1.0 - slip if law == "ageing" else -slip * np.log(slip)) / theta


def factor(b, ratio, v_star, phi, v):
    return 1.0 + b * (ratio * np.log(1.0 + v / v_star) + phi)


def velocity_steps(law):
    """Friction after steps up and down by a decade and down by two.

    Returns:
        The largest error of a step as a share of its own change of friction, and the least change (share of strength).
    """
    b, ratio, d_c, v_star = 0.05, 0.6, 2e-6, 1e-8
    effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
    parts = [(2.0, 3e-6, 20), (0.5, 3e-5, 31), (3.0, 3e-6, 20), (20.0, 3e-8, 10)]
    dt, v = spread_out(parts)
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
    ends = np.cumsum([n for _, _, n in parts])[:-1]
    changes = [np.ptp(part) for part in np.split(expected, ends)]
    errors = [np.max(np.abs(part)) for part in np.split(force[:, 0] - expected, ends)]
    return largest(np.divide(errors, changes)), min(changes) / STRENGTH


def steady_sliding(law):
    """Relative error of the change of friction with velocity, which is -(b - a) F ln((v2 + v*)/(v1 + v*))."""
    b, ratio = 0.04, 0.25
    effect = RateAndState(evolution=b, ratio=ratio, cutoff_velocity=1e-8, slip_distance=1e-6, law=law)
    force = [march(RIGID, [effect], *spread_out([(3e-5 / v, v, 60)]))[0][-1, 0] for v in (1e-5, 1e-4)]
    expected = -b * (1 - ratio) * STRENGTH * np.log((1 + 1e4) / (1 + 1e3))
    return largest((force[1] - force[0]) / expected - 1.0)


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
        """Displacements (m) and velocities (m/s) at ``t_eval`` (s), shape (2, m)."""

        def stops(t, y):
            return y[1]

        def loosens(t, y):
            return self.free(t, y[0], y[2], 0.0)

        stops.terminal, stops.direction = True, -1
        loosens.terminal, loosens.direction = True, 1
        out = [np.tile(y[:2, None], np.sum(t_eval <= 0.0))]
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
                    rtol=1e-8,
                    atol=[1e-13, 1e-12, 1e-10],
                    dense_output=True,
                    max_step=(end - t) / 20,
                )
                out.append(s.sol(inside[inside <= s.t[-1]])[:2])
                t, y = float(s.t[-1]), s.y[:, -1].copy()
                if s.status == 1:
                    slides = not slides
                    y[1] = 1e-15 if slides else 0.0
        return np.concatenate(out, axis=1)


def compare(law, *, ratio, spring, damping, positions, times, d_c=1e-5, v_star=1e-7, b=0.05, relative=1e-6):
    """The same motion by the package and by scipy.

    Returns:
        Times (s), positions of the load point (m), and displacement and velocity, first ours, then scipy's.
    """
    effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
    model = still_model(RIGID, effect, damping=damping, spring=spring)
    drive = LoadPoint(jnp.asarray(times), jnp.asarray(positions))
    model = type(model)(model.block, model.bank, model.weakening, drive, model.effects)
    # in balance: with a jerk the element would ring, and that slip, of which a rigid block has none, renews the state
    state = eqx.tree_at(lambda s: s.force, model.rest(), jnp.array([spring * positions[0]]))
    tolerance = Tolerance(relative, 1e-9 * relative, 1e-5 * relative)
    trajectory, _ = integrate(model, times[-1], state=state, stops=times[1:-1], tolerance=tolerance)
    t = np.linspace(0, times[-1], round(times[-1] / 1e-4) + 1)
    lead = np.interp(t, times, positions)
    reference = Rigid(law, b, ratio, d_c, v_star, spring, damping, lambda t: np.interp(t, times, positions))
    phi = np.log(-np.expm1(-100.0 * v_star / d_c))
    steps = trajectory.at(t)
    return t, lead, (steps.x, steps.v), reference.run(np.array([0.0, 0.0, phi]), times[1:], t)


def slide_hold_slide(law):
    """A spring stiff enough for steady sliding; holds of 1 s and 10 s.

    Returns:
        Errors of the spring's force over its change by the holds, and of what the longer hold adds to the peak; that
        change and the latter, as shares of the strength.
    """
    times = [0.0, 6.0, 7.0, 9.0, 19.0, 21.0]
    speed = [5e-5, 0.0, 5e-5, 0.0, 5e-5]
    positions = np.append(0.0, np.cumsum(np.diff(times) * speed))
    t, lead, (ours, _), (theirs, _) = compare(
        law, ratio=0.7, spring=3000.0, damping=1.0, positions=positions, times=times
    )
    pull = 3000.0 * (lead - np.array([ours, theirs]))
    change = np.ptp(pull[1][t > 4.0])  # of the holds, without the first breaking loose
    healing = pull[:, (t > 19.0)].max(axis=1) - pull[:, (t > 7.0) & (t < 9.0)].max(axis=1)
    force, peak = largest((pull[0] - pull[1]) / change), largest(healing[0] / healing[1] - 1.0)
    return force, peak, change / STRENGTH, healing[1] / STRENGTH


def onsets(t, v, threshold):
    """Times (s) at which the velocity rises through ``threshold``, its logarithm being linear between samples."""
    i = np.flatnonzero((v[:-1] < threshold) & (v[1:] >= threshold))
    return t[i] + (t[i + 1] - t[i]) * np.log(threshold / v[i]) / np.log(v[i + 1] / v[i])


def stick_slip(law):
    """Far below the critical stiffness the block slips by bursts.

    The damping lets it come to rest gently: a rigid block that stops with a jerk has no counterpart with elements.

    Returns:
        Errors of the times of bursts over the interval between them, of the displacement between bursts over a slip,
        and of the force over its change; the number of bursts, the least slip (m), and the share of quiet samples.
    """
    times, positions = [0.0, 6.0], [1.55e-3, 2.75e-3]
    t, lead, ours, theirs = compare(law, ratio=0.3, spring=150.0, damping=10.0, positions=positions, times=times)
    error, quiet = ours[0] - theirs[0], theirs[1] < BURST_SPEEDS[0]
    at = {speed: onsets(t, theirs[1], speed) for speed in BURST_SPEEDS}
    bursts = at[BURST_SPEEDS[-1]]
    between = np.interp((bursts[1:] + bursts[:-1]) / 2, t, theirs[0])
    slip = np.min(np.diff(between))
    late = [np.divide(onsets(t, ours[1], speed) - at[speed], np.min(np.diff(bursts))) for speed in at]
    pull = 150.0 * (lead - theirs[0])
    errors = np.concatenate(late), error[quiet] / slip, 150.0 * error / np.ptp(pull[t > bursts[0]])
    return (*map(largest, errors), bursts.size, slip, np.mean(quiet))


def growth(t, swing, start):
    """Rate of growth (1/s) and angular frequency (rad/s), as a complex number, of a wave that grows."""
    size = np.max(np.abs(swing))

    def misfit(wave):
        sine, cosine, rate, frequency = wave
        model = np.exp(rate * t) * (sine * np.sin(frequency * t) + cosine * np.cos(frequency * t))
        return model - swing / size

    found = least_squares(misfit, [0.1, 0.1, start.real, start.imag], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    return complex(*found[2:])


def growth_beside_the_critical_stiffness(law):
    """Steady sliding loses stability at (b - a) F/D_c (1 + m v^2/(a F D_c)) (Rice & Ruina 1983).

    Returns:
        For each of :data:`STABILITIES` how a small disturbance grows and oscillates (1/s, rad/s; a complex number): in
        the package, and by the linearised equations.
    """
    b, ratio, d_c, v_star, v = 0.05, 0.6, 2e-6, 1e-10, 5e-4
    a = b * ratio
    critical = (b - a) * STRENGTH / d_c * (1.0 + MASS * v**2 / (a * STRENGTH * d_c))
    out = []
    for stability in STABILITIES:
        spring = stability * critical
        roots = np.roots([MASS, MASS * v / d_c + a * STRENGTH / v, spring - (b - a) * STRENGTH / d_c, spring * v / d_c])
        pair = complex(roots[np.argmax(roots.imag)])
        effect = RateAndState(evolution=b, ratio=ratio, slip_distance=d_c, cutoff_velocity=v_star, law=law)
        model = still_model(RIGID, effect, velocity=v, spring=spring)
        phi = -np.log(1 + v / v_star)
        grip = jnp.array([STRENGTH * factor(b, ratio, v_star, phi, v)])
        rest = model.rest(x=-float(grip[0]) / spring, v=v)
        disturbed = (jnp.asarray(phi + 1e-3),)
        state = eqx.tree_at(lambda s: (s.force, s.cap, s.memory), rest, (grip, grip, disturbed))
        trajectory, _ = integrate(model, 0.25, state=state, largest_step=5e-5)
        t = np.linspace(0.03, 0.25, 4001)
        swing = trajectory.at(t).v - v
        assert np.max(np.abs(swing)) > 1e-8
        out.append((growth(t, swing, pair), pair))
    return out
