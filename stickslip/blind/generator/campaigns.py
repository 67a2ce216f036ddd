"""Campaigns of five runs as a user would bring them: CSV counts and a campaign file; the truth is kept apart."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import InputError

from .bank import make_bank
from .dynamics import Drive, Result, simulate
from .forms import Setup, hide
from .recorder import record
from .rigs import draw_setup
from .runs import DEFAULT_RUNS, Run
from .sensor import counts, spot
from .write import write_campaign

OVERSAMPLING = 4
LONGEST = 16.0  # s
MOST_SLIPS = 25  # of a run with holds, at first
OTHER_CASE = "a smaller amplitude, or another seed"


def make_campaign(
    folder: str | Path,
    seed: int,
    effects: Iterable[tuple[Any, ...]] = (),
    *,
    new_lines: bool = False,
    runs: Iterable[Run] = DEFAULT_RUNS,
    virgin: bool = True,
    spring_known: bool | None = None,
    dt: float = 2e-5,
    rate: float = 1e4,
    quiet: bool = True,
    setup: Setup | None = None,
    recorder: str = "plain",
    grouped: bool = True,
    title: str = "Steel block on V-grooves",
) -> dict[str, Any]:
    """Simulate a campaign with hidden effects and write ``campaign.toml`` and one CSV of counts per run.

    Args:
        folder: created if need be; must not hold a campaign yet.
        seed: fixes everything.
        effects: (tag, amplitude or None[, form]) each; see ``forms.hide``.
        new_lines: new rough lines after every slip, as a real track has.
        runs: names, velocities and holds of the runs.
        virgin: whether runs start from a contact never loaded; else the record starts after two slips.
        spring_known: whether the file gives the spring's stiffness; None: in every other case.
        dt: small step of the simulation, s.
        rate: samples per second of the counts.
        quiet: whether creep is simulated with long steps; see ``dynamics.simulate``.
        setup: the apparatus; None draws one.
        recorder: what happens to the counts of every run; see ``recorder.record``.
        grouped: join springs of about the same threshold into one element, as many as the setup says; else every
            spring that touches is one, which takes ten times as long.
        title: in the campaign file.

    Returns:
        The truth, ready for JSON: rig, surface, sensor, effects with their inner parameters, events of every run.

    Raises:
        InputError: unknown effect or negative seed; a campaign is there already; a run shows fewer than three slips.
    """
    folder = Path(folder)
    if (folder / "campaign.toml").exists():
        raise InputError("a campaign is there already", file=folder / "campaign.toml", hint="choose another folder")
    if seed < 0:
        raise InputError("a seed is not negative", key="seed", value=seed, allowed="0 or more")
    rng = np.random.default_rng(seed)
    setup = draw_setup(rng) if setup is None else setup
    if spring_known is None:
        spring_known = bool(rng.random() < 0.5)
    guess = 10 ** rng.uniform(-0.15, 0.15)
    shown: dict[str, Any] = {"mass": setup.rig.mass, "spring": setup.rig.spring_stiffness}
    if not spring_known:
        guess = setup.rig.spring_stiffness * guess
        shown["spring"] = (guess, guess / 3, guess * 3)
    seeds = rng.integers(2**31, size=3)  # lines and noise do not change with what is hidden
    hidden = [hide(setup, tag, amplitude, rng, *form) for tag, amplitude, *form in effects]
    if not grouped:
        setup = replace(setup, groups=None)
    noise = np.random.default_rng(seeds[1])
    faults = np.random.default_rng([seed, 1])  # so that counts do not change with what the recorder makes of them
    simulated = partial(simulate, setup.rig, effects=setup.effects, dt=dt, quiet=quiet, relaxation=setup.relaxation)
    traces, listed = [], []
    for number, run in enumerate(runs):
        lines = [int(seeds[0]), number] if new_lines else int(seeds[0])
        with_seed = partial(simulated, seed=int(seeds[2]) + number)
        result, start, drive = _run(with_seed, setup, lines, run, virgin, rate)
        read, events = _read(setup, result, start, rate, noise)
        if events["onset"].size < 3:
            raise InputError(f"run '{run.name}' shows {events['onset'].size} slips", key="effects", hint=OTHER_CASE)
        sticks = list(zip(events["arrest"][:-1], events["onset"][1:], strict=True))
        recorded = record(recorder, read, sticks, rate, faults)
        traces.append((run, recorded, drive))
        columns = {key: [float(x) for x in col] for key, col in events.items()}
        listed.append({"name": run.name, "start": start, **columns, **recorded.truth})
    folder.mkdir(parents=True, exist_ok=True)
    write_campaign(folder, title, setup, shown, traces, rate, virgin)
    truth = {
        "seed": seed,
        "effects": hidden,
        "new_lines": new_lines,
        "virgin": virgin,
        "spring_known": spring_known,
        "rig": asdict(setup.rig),
        "surface": asdict(setup.surface),
        "sensor": asdict(setup.sensor),
        "recorder": recorder,
        "elements_a_contact": setup.groups or "every spring",
        "runs": listed,
    }
    plain: dict[str, Any] = json.loads(json.dumps(truth))  # as it will be read again
    return plain


def _run(
    simulated: Callable[..., Result], setup: Setup, lines: int | list[int], run: Run, virgin: bool, rate: float
) -> tuple[Result, float, list[tuple[float, float]]]:
    """The run, the time at which its record starts, and its drive as the file gives it.

    Lines with two seeds are replaced after every slip.
    """
    new_lines = not isinstance(lines, int)
    pool = (MOST_SLIPS if run.pieces else run.events) + 3 if new_lines else 1
    while True:
        bank = make_bank(
            setup.surface, np.asarray(setup.rig.loads), lines,
            pool=pool, groups=setup.groups, roughness_spread=setup.roughness_spread,
        )  # fmt: skip
        made = _with(partial(simulated, bank=bank, new_lines=new_lines), run, virgin, rate)
        if not new_lines or made[0].event_columns["onset"].size < pool:
            return made
        pool *= 2  # no line comes twice


def _with(
    simulated: Callable[..., Result], run: Run, virgin: bool, rate: float
) -> tuple[Result, float, list[tuple[float, float]]]:
    def go(pieces: list[tuple[float, float]], duration: float, sampling: float, stop: tuple[int, float]) -> Result:
        return simulated(drive=Drive.pieces(pieces), duration=duration, rate=sampling, stop=stop)

    fine = OVERSAMPLING * rate
    steady = [(1.0, run.velocity)]
    before = 0.0
    if not virgin:
        arrests = go(steady, LONGEST, 1000.0, (2, 0.0)).event_columns["arrest"]
        if arrests.size < 2:
            raise InputError(f"run '{run.name}' does not stick and slip", key="effects", hint=OTHER_CASE)
        before = round(float(arrests[1] + 0.3 * (arrests[1] - arrests[0])), 3)
    if not run.pieces:
        return go(steady, before + LONGEST, fine, (run.events + (0 if virgin else 2), 0.4)), before, []
    pieces = [(before + until, velocity) for until, velocity in run.pieces]
    return go(pieces, pieces[-1][0], fine, (0, 0.0)), before, list(run.pieces)


def _read(
    setup: Setup, result: Result, start: float, rate: float, rng: np.random.Generator
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    fine = OVERSAMPLING * rate
    seen = spot(setup.sensor, result.displacement, result.contact_force, result.yaw)
    first = round(start * fine)
    seen = seen[first:] - seen[first]
    read = counts(setup.sensor, seen, fine, rate, rng)
    keep = result.event_columns["onset"] >= start
    return read, {
        key: col[keep] - (start if key in ("onset", "arrest") else 0.0) for key, col in result.event_columns.items()
    }
