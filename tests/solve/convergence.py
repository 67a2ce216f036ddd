"""Convergence in step, tolerance and number of elements, and with the phase of the ringing."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.interpolate import CubicHermiteSpline

from stickslip.physics.contact import Bank
from stickslip.physics.effects.direct_effect import DirectEffect
from stickslip.physics.model import Model, State
from stickslip.simulation.solve import Tolerance, integrate
from stickslip.simulation.solve.stepper import ContactStepper

from . import brute_force
from .rig import FAR, MASS, Slips, bank, drive, order, rig, slips, tighter
from .slip_events import run

TERM = diffrax.ODETerm(lambda t, y, args: y)
QUANTITIES = ("onset", "slip", "peak", "recurrence")


@jax.jit
def _fixed(model: Model, state: State, t0: Array, t1: Array, step: Array) -> tuple[Array, Array]:
    solution = diffrax.diffeqsolve(
        TERM, ContactStepper(Tolerance(1e-9, 1e-18, 1e-15)), t0, t1, step, state, args=(model, model.shaped()),
        saveat=diffrax.SaveAt(t1=True, fn=lambda t, y, args: (y.x, y.v)), adjoint=diffrax.ForwardMode(),
        stepsize_controller=diffrax.ConstantStepSize(), max_steps=200_000,
    )  # fmt: skip
    x, v = solution.ys
    return x[0], v[0]


@functools.partial(jax.jit, static_argnums=2)
def _every(model: Model, end: Array, most: int, step: Array) -> tuple[Array, Array, Array]:
    """Time, displacement and velocity at the start and after each equal step, at most so many."""
    return diffrax.diffeqsolve(
        TERM, ContactStepper(Tolerance(1e-9, 1e-18, 1e-15)), 0.0, end, step, model.rest(),
        args=(model, model.shaped()), saveat=diffrax.SaveAt(t0=True, steps=True, fn=lambda t, y, args: (t, y.x, y.v)),
        adjoint=diffrax.ForwardMode(), stepsize_controller=diffrax.ConstantStepSize(), max_steps=most,
    ).ys  # fmt: skip


def fixed_steps(model: Model, state: State, t0: float, t1: float, steps: int) -> tuple[float, float]:
    """Displacement (m) and velocity (m/s) at ``t1`` after so many equal steps."""
    x, v = _fixed(model, state, jnp.asarray(t0), jnp.asarray(t1), jnp.asarray((t1 - t0) / steps))
    return float(x), float(v)


def oscillator(damping: float = 5.0, effects: tuple = ()) -> tuple[Model, State, float, float]:
    """A block whose contact never slides; its angular frequency and decay rate (1/s)."""
    stuck = Bank(jnp.array([1e5]), jnp.array([1e3]))
    model = rig(springs=stuck, load_point=drive((FAR, 0.0)), damping=damping, ratio=1.0, effects=effects)
    decay = damping / (2.0 * MASS)
    return model, model.rest(v=1e-3), float(np.sqrt(101e3 / MASS - decay**2)), decay


def oscillator_errors(steps: np.ndarray, end: float = 0.05, followed: bool = True) -> np.ndarray:
    """Error of displacement over its amplitude at ``end`` (s), for numbers of equal steps.

    Unless the oscillation is to be ``followed``, what would slide has a law that is too steep for that.
    """
    steep = DirectEffect(strengthening=1e-3, cutoff_velocity=1e-8)
    model, state, omega, decay = oscillator(effects=() if followed else (steep,))
    exact = 1e-3 / omega * np.exp(-decay * end) * np.sin(omega * end)
    return np.array([abs(fixed_steps(model, state, 0.0, end, n)[0] - exact) for n in steps]) * omega / 1e-3


@functools.cache
def before_slip(start: float = 5.165) -> tuple[Model, State, float]:
    """The rig shortly before its first slip, which begins at 5.18 s and ends at 5.21 s."""
    model = rig()
    return model, integrate(model, start, tolerance=tighter(10.0))[1], start


def slip_errors(steps: np.ndarray, end: float = 5.195, fine: int = 16_000) -> np.ndarray:
    """Error of displacement (m) in the middle of a slip, for numbers of equal steps."""
    model, state, start = before_slip()
    exact = fixed_steps(model, state, start, end, fine)[0]
    return np.array([abs(fixed_steps(model, state, start, end, n)[0] - exact) for n in steps])


def second_event(springs: int = 128, factor: float = 1.0, **options: float) -> np.ndarray:
    """Onset of the first event; slip, peak velocity and recurrence of the second (QUANTITIES; s, m, m/s, s)."""
    e = run(rig(springs=bank(springs), **options), 6.3, tighter(factor)).events
    return np.array([e.onset[0], e.size[1], e.peak[1], e.recurrence[0]])


QUICK = {"spring_stiffness": 3000.0, "ratio": 0.7}  # of a rig that slips four times within a second


EVENT_QUANTITIES = ("onset", "arrest", "slip", "peak velocity", "recurrence", "creep")


@functools.cache
def _quick_reference(end: float) -> brute_force.Path:
    load_point = drive((FAR, 2e-4))
    b = bank()
    return brute_force.simulate(
        b.stiffness, b.strength, duration=end, mass=MASS, damping=10.0, slip_distance=1e-6, healing_time=0.02,
        times=load_point.times, positions=load_point.positions, dt=1e-7, every=200, **QUICK,
    )  # fmt: skip


def event_quantities(t: np.ndarray, x: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
    """Of every slip: EVENT_QUANTITIES (s, s, m, m/s, s, m); creep is that before it."""
    found = slips(t, x, v)
    creep = found.begin - np.concatenate([[0.0], found.end[:-1]])
    return dict(zip(EVENT_QUANTITIES, (
        found.onset, found.arrest, found.size, _peaks(t, v, found), found.recurrence, creep,
    ), strict=True))  # fmt: skip


def _peaks(t: np.ndarray, v: np.ndarray, found: Slips) -> np.ndarray:
    """Peak velocities between samples: tops of parabolas."""
    tops = []
    for onset, arrest in zip(found.onset, found.arrest, strict=True):
        inside = np.flatnonzero((t > onset) & (t < arrest))
        top = inside[np.argmax(v[inside])]
        before, at, after = v[top - 1 : top + 2]
        tops.append(at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after)))
    return np.array(tops)


@functools.cache
def slip_to_slip(step: float, grids: int = 16, end: float = 1.1) -> dict[str, np.ndarray]:
    """Errors of EVENT_QUANTITIES of four slips by steps of about so many seconds, each of shape (grids, slips).

    Of times over the period, of the others over their mean. Each of the grids has steps longer by 0.14 % than those
    before, and meets the slips elsewhere in a step.
    """
    model, path = rig(2e-4, **QUICK), _quick_reference(end)
    exact = event_quantities(*path)
    scale = {name: float(np.mean(values)) for name, values in exact.items()}
    scale |= dict.fromkeys(("onset", "arrest"), scale["recurrence"])
    found: dict[str, list[np.ndarray]] = {name: [] for name in exact}
    for longer in 1.0 + 0.00137 * np.arange(grids):
        made = np.array(_every(model, jnp.asarray(end), round(end / step) + 2, jnp.asarray(longer * step)))
        t, x, v = made[:, np.isfinite(made[0])]
        curve, at = CubicHermiteSpline(t, x, v), path.t[path.t < t[-1]]
        for name, values in event_quantities(at, curve(at), curve(at, 1)).items():
            found[name].append((values - exact[name]) / scale[name])
    return {name: np.array(errors) for name, errors in found.items()}


def event_orders(steps: Sequence[float]) -> dict[str, tuple[float, list[float]]]:
    """Order of every quantity in the step, and its errors: root mean squares over grids and slips."""
    made = [slip_to_slip(step) for step in steps]
    errors = {name: [float(np.sqrt(np.mean(m[name] ** 2))) for m in made] for name in EVENT_QUANTITIES}
    return {name: (order(np.array(steps), np.array(e)), e) for name, e in errors.items()}


def onset_scatter(damping: float, kicks: np.ndarray, tolerance: Tolerance, duration: float = 9.0) -> np.ndarray:
    """Onsets (s) after kicks (m/s) to the block at the start, shape (kicks, events common to all)."""
    model = rig(damping=damping)
    made = [integrate(model, duration, state=model.rest(v=float(kick)), tolerance=tolerance)[0].steps for kick in kicks]
    return _common([slips(s.t, s.x, s.v).onset for s in made])


def brute_onsets(damping: float, kicks: np.ndarray, duration: float = 9.0, dt: float = 1e-6) -> np.ndarray:
    """The same by brute force."""
    elements = bank()
    paths = [
        brute_force.simulate(
            np.asarray(elements.stiffness), np.asarray(elements.strength), duration=duration, mass=MASS,
            spring_stiffness=1000.0, damping=damping, ratio=0.85, slip_distance=1e-6, healing_time=0.02,
            times=[0.0, 1.0], positions=[0.0, 5e-5], dt=dt, every=round(2e-5 / dt), v=float(kick),
        )
        for kick in kicks
    ]  # fmt: skip
    return _common([slips(p.t, p.x, p.v).onset for p in paths])


def _common(onsets: Sequence[np.ndarray]) -> np.ndarray:
    number = min(len(o) for o in onsets)
    return np.array([o[:number] for o in onsets])
