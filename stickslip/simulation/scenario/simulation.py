"""Run a scenario: integrate, sample, read with the vibrometer, and put everything into one data set."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...errors import ArgumentError, InputError
from ...physics.effects.base import Drive, Spring
from ...physics.model import Model
from ...physics.sensor import Vibrometer, measure
from ...system.progress import Tell, reporting
from ..solve import Stats, Steps, Trajectory, integrate
from ..solve.trajectory import energy_error
from .build import Setup, build
from .contact_tables import RoughLineTable
from .events import UNITS, Events, find_events, find_slips
from .load import Scenario
from .recording import Recording, Variable
from .stability import Sliding, steady_sliding
from .static import first_stick

if TYPE_CHECKING:
    import xarray

_MOST_SAMPLES = 200_000_000
PACKAGES = ("stickslip", "numpy", "jax", "diffrax", "equinox")


class _Simulated(NamedTuple):
    """A scenario, what was built of it, and its motion."""

    scenario: Scenario
    setup: Setup
    trajectory: Trajectory
    events: Events
    sliding: Sliding


def simulate(
    scenario: Scenario, progress: Tell | None = None, until: Callable[[Steps], Any] | None = None
) -> xarray.Dataset:
    """Simulate a scenario.

    Args:
        scenario: from `load_scenario`.
        progress: told how far it is and the share of it; default a bar in a terminal or a notebook.
        until: ends the run early, where it first turns true, such as ``lambda steps: steps.x > 1e-4``; see
            :func:`stickslip.integrate`.

    Returns:
        A data set with the dimensions ``time`` (the output's samples), ``event`` and ``static``; every variable has its
        unit in ``attrs["units"]``:

        - on ``time`` (s): displacement (m), velocity (m/s), spring_force (N), contact_force (N), psi (1),
          sliding_share (1), drive_position (m), and reading (m), what the vibrometer shows, on its own clock;
        - on ``event``: onset, arrest (s), slip (m), peak_velocity (m/s), recurrence (s), creep_before_slip (m);
        - on ``static``: static_displacement (m) and static_time (s) of the first stick without inertia and weakening.

        Attributes: N, L, seeds, versions, steps, rejected, energy_error, ``ended`` (``"complete"`` or ``"until"``),
        facts of the contact, and whether and why the rig slides.

    Raises:
        SolveError: the integration failed; says when and what to change.
        InputError: the output would not fit into memory, or ``until`` cannot be used.
    """
    return record(scenario, progress, until).dataset()


def record(scenario: Scenario, progress: Tell | None = None, until: Callable[[Steps], Any] | None = None) -> Recording:
    """`simulate` without making a data set of it; arguments and errors as there."""
    if not isinstance(scenario, Scenario):
        hint = "ss.load_scenario(path) reads a file; a fit has its own: fit.simulate()"
        raise ArgumentError("no scenario", key="scenario", value=type(scenario).__name__, hint=hint)
    setup = build(scenario)
    file = scenario.file
    sliding = steady_sliding(file.block, file.weakening, setup.contact.strength, setup.motion.fastest)
    with reporting("simulating", progress) as tell:
        trajectory, events, end = _run(scenario, setup, sliding, tell, until)
    samples = math.floor(end * file.output.sampling_rate) + 1
    if samples > _MOST_SAMPLES:
        key, value, allowed = "output.sampling_rate", f"{samples} samples", f"at most {_MOST_SAMPLES}"
        raise InputError("the output would be too long", file=scenario.path, key=key, value=value, allowed=allowed)
    t = np.arange(samples) / file.output.sampling_rate
    return _recording(_Simulated(scenario, setup, trajectory, events, sliding), t)


def _run(
    scenario: Scenario, setup: Setup, sliding: Sliding, tell: Tell, until: Callable[[Steps], Any] | None
) -> tuple[Trajectory, Events, float]:
    """Integrate to the end of the drive, or until the wanted number of slips is complete or the condition holds."""
    wanted, solver = scenario.file.drive.events, scenario.file.solver
    parts: list[Trajectory] = []
    state, now = setup.start, 0.0
    ends = [setup.motion.duration] if setup.motion.duration is not None else _looks(scenario, setup, sliding)
    last = ends[-1]
    count = 0

    def report(reached: float, steps: Steps) -> None:
        slips = f"{count} slip{'' if count == 1 else 's'}"
        tell(f"{reached:.4g} of {last:.4g} s simulated, {slips}", reached / last if last > 0.0 else 1.0)

    for end in ends:
        part, state = integrate(
            setup.model,
            end,
            t0=now,
            state=state,
            tolerance=setup.tolerance,
            stops=setup.motion.stops,
            largest_step=solver.largest_step,
            progress=report,
            until=until,
        )
        parts.append(part)
        now = float(part.steps.t[-1])
        count = len(find_slips(_joined(parts), setup.motion, setup.contact.strength))
        over = part.stats.ended == "until" or (wanted is not None and count >= wanted)
        last = now if over else last
        report(now, part.steps)
        if over:
            break
    whole = _joined(parts)
    return whole, find_events(whole, setup.motion, setup.contact.strength), now


def _looks(scenario: Scenario, setup: Setup, sliding: Sliding) -> list[float]:
    """Times at which a run that stops after so many slips is looked at; the last is where it is given up."""
    file = scenario.file
    speed = setup.motion.fastest
    stiffness = file.block.spring_stiffness
    loading = (setup.contact.strength / stiffness + setup.contact.u_max) / speed
    drop = (1.0 - file.weakening.ratio) * setup.contact.strength
    period = 2.0 * drop / (stiffness * speed) + math.pi * math.sqrt(file.block.mass / stiffness)
    wanted = 2 if sliding.stable else file.drive.events or 1
    step = max(period / 5.0, loading / 50.0)
    if not math.isfinite(wanted * period + loading):
        raise InputError("the drive is too slow ever to reach a slip", key="drive.velocity", value=speed)
    return [loading + step * i for i in range(math.ceil((2.0 * wanted * period + loading) / step) + 2)]


def _joined(parts: list[Trajectory]) -> Trajectory:
    if len(parts) == 1:
        return parts[0]
    steps = [part.steps for part in parts]
    rest = [Steps(*(a[1:] for a in s)) for s in steps[1:]]
    whole = Steps(*(np.concatenate(a) for a in zip(steps[0], *rest, strict=True)))
    stats = [part.stats for part in parts]
    steps_made, rejected, seconds = (sum(getattr(s, key) for s in stats) for key in ("steps", "rejected", "seconds"))
    return Trajectory(whole, Stats(steps_made, rejected, energy_error(whole), seconds, stats[-1].ended))


def _recording(made: _Simulated, t: np.ndarray) -> Recording:
    scenario, setup, trajectory, events, _ = made
    at = trajectory.at(t)
    sampled = {
        "time": (t, "s", "time"),
        "displacement": (at.x, "m", "displacement of the block"),
        "velocity": (at.v, "m/s", "velocity of the block"),
        "spring_force": (_spring_force(setup, t, at.x), "N", "pull of the driving spring"),
        "contact_force": (at.contact_force, "N", "tangential force of all contacts"),
        "psi": (at.psi, "1", "weakening state, 1 rested, 0 fully weakened"),
        "sliding_share": (at.sliding, "1", "share of the contact's strength that slides"),
        "drive_position": (setup.motion.position(t) + setup.offset, "m", "position of the load point"),
        "reading": (_reading(scenario, trajectory, events, t), "m", "displacement the vibrometer shows"),
    }
    data = {
        name: Variable("time", np.asarray(values), {"units": unit, "long_name": text})
        for name, (values, unit, text) in sampled.items()
    }
    for name, column in events._asdict().items():
        data[name] = Variable("event", column, {"units": UNITS[name]})
    u, moment = first_stick(setup)
    data["static_displacement"] = Variable("static", u, {"units": "m", "long_name": "static curve of the first stick"})
    data["static_time"] = Variable("static", moment, {"units": "s", "long_name": "its virtual time"})
    return Recording(data, _attributes(made))


def _spring_force(setup: Setup, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Pull of the spring (N) from the displacement; a straight line between long steps would not belong to it."""
    model = setup.model
    if not any(isinstance(effect, (Drive, Spring)) for effect in model.effects):
        return float(model.block.spring_stiffness) * (setup.motion.position(t) + setup.offset - x)
    return np.asarray(_pulls(model, jnp.asarray(t), jnp.asarray(x)))


@eqx.filter_jit
def _pulls(model: Model, t: Array, x: Array) -> Array:
    return jax.vmap(lambda t, x: model.pull(model.lead(t) - x))(t, x)


def _reading(scenario: Scenario, trajectory: Trajectory, events: Events, t: np.ndarray) -> np.ndarray:
    table = scenario.file.sensor
    if table is None:
        return trajectory.at(t).reading
    settings = table.model_dump(exclude={"clear_at_arrest"})
    clears = tuple(events.arrest.tolist()) if table.clear_at_arrest else ()
    return measure(Vibrometer(**settings, clears=clears), lambda times: trajectory.at(times).reading, t)


def _attributes(made: _Simulated) -> dict[str, object]:
    scenario, setup, trajectory, _, sliding = made
    file, built = scenario.file, setup.contact
    table = file.contact
    rough = table if isinstance(table, RoughLineTable) else None
    k = file.block.spring_stiffness
    return {
        "title": scenario.title,
        "N": rough.springs if rough else getattr(table, "springs", None) or 0,
        "L": rough.line_length if rough else math.nan,
        "bins": table.bins,
        "seed_lines": rough.seed if rough else -1,
        "seed_sensor": file.sensor.seed if file.sensor else -1,
        "versions": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
        "steps": trajectory.stats.steps,
        "rejected": trajectory.stats.rejected,
        "energy_error": trajectory.stats.energy_error,
        "ended": trajectory.stats.ended,
        "friction_force": built.strength,
        "contact_stiffness": built.stiffness,
        "u_max": built.u_max,
        "contact_share": built.contact_share,
        "binning_error": built.binning_error,
        "contact_resonance": math.sqrt((built.stiffness + k) / file.block.mass) / (2 * math.pi),
        "critical_velocity": sliding.critical_velocity,
        "critical_stiffness": sliding.critical_stiffness,
        "verdict": _verdict(made),
        "warnings": "\n".join(built.warnings),
    }


def _verdict(made: _Simulated) -> str:
    """What the rig does and, where it slides, why."""
    scenario, setup, trajectory, events, sliding = made
    n, end = events.number, float(trajectory.steps.t[-1])
    beyond = " (effects left out of this estimate)" if scenario.file.effect else ""
    if n:
        counted = f"{n} slip event{'s' if n > 1 else ''}"
        usual = float(np.median(np.diff(events.onset))) if n > 1 else 0.0
        if sliding.stable and setup.motion.first_velocity != 0.0 and end - events.arrest[-1] > 2.0 * usual:
            return f"{counted} at the start, then the block slides{beyond}: {sliding.reason}"
        text = f"stick-slip: {counted} in {end:.4g} s"
        if sliding.stable and n > 1:
            return f"{text}, from rest; once it slides it would go on sliding{beyond}: {sliding.reason}"
        return text
    if trajectory.stats.ended == "until":
        return f"no slip event within {end:.4g} s, where the run was ended"
    if sliding.stable:
        return f"no slip event, the block slides{beyond}: {sliding.reason}"
    speed = setup.motion.fastest
    if speed > 0:
        loading = (setup.contact.strength / scenario.file.block.spring_stiffness + setup.contact.u_max) / speed
        if end < 1.2 * loading:
            return (
                f"no slip event within {end:.4g} s: the spring reaches full friction only after about {loading:.4g} s; "
                "simulate longer (drive.duration)"
            )
    return f"no slip event within {end:.4g} s, though {sliding.reason}{beyond}"
