"""The static curve: closed form against the paper's procedure, step by step over all springs, by numpy and numba."""

from __future__ import annotations

import resource
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numba
import numpy as np

from stickslip.physics.contact import (
    Indentation,
    Profile,
    RoughLines,
    StaticContact,
    creep_displacements,
    default_loads,
    equal_bodies,
    from_heights,
    indentation,
    static_contact,
    touching,
)

from .measuring import head, keep, last_table, row, timed

LENGTH, H_RMS, HURST, LOAD, FRICTION = 20e-6, 2.46e-6, 0.3, 0.31, 0.21  # m, m, 1, N, 1: the paper's rig
HALVINGS = 50  # of the bisection: the depth to rounding
REPEATS = 25
MODULI = equal_bodies()


class Stepped(NamedTuple):
    """What a procedure in steps finds: displacement (m) and force (N), both (steps, lines)."""

    u: np.ndarray
    force: np.ndarray


def heights(lines: int = 100, springs: int = 4096) -> np.ndarray:
    """(lines, springs) heights in m."""
    return np.asarray(RoughLines(HURST, H_RMS, LENGTH, n_springs=springs, lines=lines).heights)


def own(z: jax.Array, tau: jax.Array) -> jax.Array:
    """Displacement (T,) in m at the loads ``tau``, mean over the lines; heights are sorted here."""
    dx = LENGTH / z.shape[-1]
    return again(touching(Profile(_gaps(z), dx), LOAD / (MODULI.normal * dx)), 1.0, LOAD, tau)


@jax.jit
def _gaps(z: jax.Array) -> jax.Array:
    return from_heights(z, 1.0).gaps


@jax.jit
def traced(z: jax.Array, tau: jax.Array) -> jax.Array:
    """The same where nothing is known beforehand, as under a derivative: all gaps are sorted."""
    return again(indentation(from_heights(z, LENGTH / z.shape[-1])), 1.0, LOAD, tau)


@jax.jit
def again(table: Indentation, height: jax.Array | float, load: jax.Array | float, tau: jax.Array) -> jax.Array:
    """The same from a table that is there: another rms height and load on the same lines."""
    contact = StaticContact(table.scaled(height), load, FRICTION, MODULI)
    return jnp.mean(contact.displacement(tau[:, None]), axis=-1)


def numpy_plain(z: np.ndarray, steps: int) -> Stepped:
    """Bisection for the depth, then every spring at every step."""
    normal, tangential = _springs(z)
    gaps = z.max(axis=1, keepdims=True) - z
    low, high = np.zeros(len(z)), gaps.max(axis=1) + LOAD / (normal * z.shape[1])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        light = normal * np.maximum(middle[:, None] - gaps, 0.0).sum(axis=1) < LOAD
        low, high = np.where(light, middle, low), np.where(light, high, middle)
    cap = FRICTION * normal * np.maximum(high[:, None] - gaps, 0.0)
    u = np.linspace(0.0, 1.0, steps)[:, None] * cap.max(axis=1) / tangential
    force = np.stack([np.minimum(tangential * du[:, None], cap).sum(axis=1) for du in u])
    return Stepped(u, force)


def numpy_careful(z: np.ndarray, steps: int) -> Stepped:
    """Line by line, and only with the springs that can still touch: the bisection drops the others as it goes."""
    normal, tangential = _springs(z)
    u, force = np.empty((steps, len(z))), np.empty((steps, len(z)))
    share = np.linspace(0.0, 1.0, steps)
    for i, line in enumerate(z):
        gaps = line.max() - line
        low, high = 0.0, gaps.max() + LOAD / (normal * gaps.size)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if normal * np.maximum(middle - gaps, 0.0).sum() < LOAD:
                low = middle
            else:
                high = middle
                gaps = gaps[gaps < high]
        cap = FRICTION * normal * (high - gaps)
        u[:, i] = share * (cap.max() / tangential)
        force[:, i] = np.minimum((tangential * u[:, i])[:, None], cap).sum(axis=1)
    return Stepped(u, force)


def numba_loops(z: np.ndarray, steps: int) -> Stepped:
    """The careful form in compiled loops."""
    return Stepped(*_loops(np.ascontiguousarray(z), steps, *_springs(z), LOAD, FRICTION, HALVINGS))


@numba.njit(fastmath=True, cache=True)
def _loops(z, steps, normal, tangential, load, friction, halvings):
    n, size = z.shape
    u, force = np.empty((steps, n)), np.empty((steps, n))
    gaps = np.empty(size)
    for i in range(n):
        top, bottom = z[i].max(), z[i].min()
        low, high = 0.0, top - bottom + load / (normal * size)
        count = size
        for j in range(size):
            gaps[j] = top - z[i, j]
        for _ in range(halvings):
            middle = 0.5 * (low + high)
            total = 0.0
            for j in range(count):
                total += max(middle - gaps[j], 0.0)
            if normal * total < load:
                low = middle
            else:
                high = middle
                kept = 0
                for j in range(count):
                    if gaps[j] < high:
                        gaps[kept] = gaps[j]
                        kept += 1
                count = kept
        for j in range(count):
            gaps[j] = friction * normal * (high - gaps[j])  # the caps from here on
        far = gaps[:count].max() / tangential
        for s in range(steps):
            u[s, i] = far * s / (steps - 1)
            pull = tangential * u[s, i]
            total = 0.0
            for j in range(count):
                total += min(pull, gaps[j])
            force[s, i] = total
    return u, force


def gap_to_closed_form(z: np.ndarray, found: Stepped) -> tuple[float, float]:
    """Largest difference of the force (share of full friction) and of the displacement (share of u_max)."""
    contact = static_contact(indentation(from_heights(z, LENGTH / z.shape[1])), LOAD, FRICTION)
    force = np.abs(np.asarray(contact.force(found.u)) - found.force).max() / (FRICTION * LOAD)
    tau = np.clip(found.force / (FRICTION * LOAD), 0.0, 1.0)
    u = np.abs(np.asarray(contact.displacement(tau)) - found.u)
    return float(force), float((u / np.asarray(contact.u_max)).max())


def curve(lines: int = 100, springs: int = 4096, steps: int = 400) -> dict[str, float]:
    """The table of one curve; processor time (s) of each way."""
    z, tau = heights(lines, springs), jnp.asarray(default_loads(steps))
    zj = jnp.asarray(z)
    table = indentation(from_heights(zj, LENGTH / springs))
    print(f"Static curve: {lines} lines of {springs} springs, {steps} loads. Least of {REPEATS}.")
    head("way", "processor ms", "times slower than (a)", "times slower than (b)", "force off by", "displacement off by")
    ways: dict[str, Callable[[], object]] = {
        "own (a), from heights": lambda: own(zj, tau).block_until_ready(),
        "own, from heights, inside jit (all gaps sorted)": lambda: traced(zj, tau).block_until_ready(),
        "own (b), table there, other rms height and load": lambda: again(table, 1.1, 0.3, tau).block_until_ready(),
        "numpy, every spring at every step": lambda: numpy_plain(z, steps),
        "numpy, touching springs only, line by line": lambda: numpy_careful(z, steps),
        "numba, touching springs only": lambda: numba_loops(z, steps),
    }
    spent, found = {}, {}
    for name, work in ways.items():
        work()  # compiles
        found[name], spent[name], _ = timed(work, REPEATS)
    first, second = (spent[name] for name in ways if name.startswith("own ("))
    for name, cpu in spent.items():
        answer = found[name]
        off = (f"{x:.1e}" for x in gap_to_closed_form(z, answer)) if isinstance(answer, Stepped) else ("", "")
        row(name, f"{1e3 * cpu:.2f}", f"{cpu / first:.1f}", f"{cpu / second:.1f}", *off)
    return spent


def many(sets: int = 10_000, loads: int = 400, hursts: int = 4) -> dict[str, float]:
    """Many parameter sets, one call for each exponent: time of each, and by how much the memory of the process grew."""
    side = round(np.sqrt(sets / hursts))
    h, f = np.meshgrid(np.geomspace(1e-6, 4e-6, side), np.geomspace(0.1, 0.6, side))
    h, f = h.reshape(-1, 1), f.reshape(-1, 1)
    tau = default_loads(loads)

    def curves(exponents: np.ndarray, h: np.ndarray, f: np.ndarray) -> np.ndarray:
        out = np.empty((exponents.size, h.size, tau.size))
        for part, exponent in zip(out, exponents, strict=True):
            lines = RoughLines(float(exponent), 1.0, LENGTH).indentation
            part[:] = creep_displacements(static_contact(lines.scaled(h), f, FRICTION), tau)
        return out.reshape(-1, tau.size)

    exponents = np.linspace(0.2, 0.8, hursts)
    curves(exponents[:1], h[:1], f[:1])  # one set: all that it loads is there
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    u, cpu, wall = timed(lambda: curves(exponents, h, f), 1)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(
        f"\n{len(u)} parameter sets ({hursts} Hurst exponents, {side} rms heights, {side} normal forces) at {loads} "
        f"loads, a call for each exponent: {1e3 * cpu / len(u):.2f} ms of processor time a set ({cpu:.1f} s in all, "
        f"{wall:.1f} s wall, compiling included); memory grew by {grown / 1024:.0f} MiB, the result takes "
        f"{u.nbytes / 2**20:.0f}"
    )
    return {
        "sets": len(u), "processor s": round(cpu, 1), "ms a set": round(1e3 * cpu / len(u), 2),
        "grown MiB": round(grown / 1024), "result MiB": round(u.nbytes / 2**20),
    }  # fmt: skip


def report(small: bool = False) -> dict:
    if small:
        return {"curve": curve(10, 512, 50), "many": many(64, 20)}
    found = {"curve": curve()}
    table = last_table()
    found["many"] = many()
    keep("static", "static", **table, lines=100, springs=4096, loads=400, repeats=REPEATS, many=found["many"])
    return found


def _springs(z: np.ndarray) -> tuple[float, float]:
    """Normal and tangential stiffness (N/m) of one spring."""
    dx = LENGTH / z.shape[1]
    return float(MODULI.normal) * dx, float(MODULI.tangential) * dx
