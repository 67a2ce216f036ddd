"""Checks on what an effect does: nothing at its null, finite numbers everywhere, no energy out of nothing."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

import jax
import numpy as np

from ...physics.effects.base import Effect, Motion
from ...physics.effects.catalogue import forms
from ...physics.params import specs
from .compile_check import first_line
from .gradients import present
from .rig import AT_ONCE, STOPPED, TIGHT, Rig, base_model, directions, march_step, prescribed
from .statics import corners

ACTIVE = ("sensor", "drive")  # families that are not a passive contact
GAIN = 1e-5  # energy that may appear by quadrature and in the model's books, as a share of all that is lost
SHARES = (-0.3, 0.02, 0.3, 1.0)  # amplitudes tried, as shares of the way from the null to a bound


def check_null(cls: type[Effect]) -> Iterator[str]:
    """At its null the effect must leave the base model alone to the last bit, in whatever order compilers would add.

    A compiled run is no witness: the compiler contracts and reorders the arithmetic of another program differently. So
    both models are taken operation by operation through the same motion, of which every acceleration, reading, element
    force and state of weakening is compared.
    """
    motions = prescribed()
    plain = _plain()
    for form in forms(cls):
        try:
            seen = _march_eagerly((cls(**form),), motions)
        except Exception as error:  # whatever a foreign law raises
            yield f"{named(form)}raises {first_line(error)}"
            continue
        for what, a, b in zip(("acceleration", "reading", "element forces", "weakening"), seen, plain, strict=True):
            if not np.array_equal(a, b):
                step = int(np.argmax(np.any(np.atleast_2d((a != b).T).T.reshape(len(a), -1), axis=1)))
                yield f"{named(form)}{what}: not that of the base model, first in step {step} of the prescribed motion"
                break


@functools.cache
def _plain() -> list[np.ndarray]:
    return _march_eagerly((), prescribed())


def named(form: dict[str, str]) -> str:
    """The form of an effect that has several, as a prefix of a message."""
    return f"({', '.join(f'{k} = {v}' for k, v in form.items())}) " if form else ""


def _march_eagerly(effects: tuple[Effect, ...], motions: Motion) -> list[np.ndarray]:
    model = base_model(effects)
    bank, state = model.shaped(), model.rest()
    seen = []
    for k in range(len(motions.dt)):
        state, now = march_step(model, bank, state, jax.tree.map(lambda a, k=k: a[k], motions))
        seen.append([np.asarray(part) for part in now])
    return [np.array(parts) for parts in zip(*seen, strict=True)]


def check_finite(rig: Rig, report: Callable[[int, str], None]) -> None:
    """States, forces and their derivatives in every corner of the ranges, over steps without time, way or velocity."""
    motions = prescribed()
    for index, effect in enumerate(rig.effects):
        along = directions(list(rig.at(index).values())[:AT_ONCE], rig.defaults.size)
        for values in corners(effect):
            leaves, slopes = rig.march_derivatives(rig.with_values(index, values), along, motions)
            at = ", ".join(f"{k} = {v:g}" for k, v in values.items()) or "the defaults"
            if not all(np.all(np.isfinite(leaf)) for leaf in leaves):
                report(index, f"not a finite number at {at}")
                break
            if not all(np.all(np.isfinite(slope)) for slope in slopes):
                report(index, f"a derivative is not finite at {at}")
                break


def check_energy(rig: Rig, report: Callable[[int, str], None]) -> None:
    """With the drive stopped, what moves, is strained or stretched must never grow in total."""
    for index, effect in enumerate(rig.effects):
        spec = specs(effect)[effect.amplitude]
        for share in SHARES:
            value = present(spec, share)
            if not spec.lower <= value <= spec.upper:
                continue
            outcome = rig.run(rig.with_values(index, {effect.amplitude: value}), STOPPED, TIGHT)
            n = int(outcome.accepted)
            steps = jax.tree.map(lambda a, n=n: np.asarray(a[:n]), outcome.steps)
            if not np.all(np.isfinite(steps.x)):
                report(index, f"the run is not finite at {effect.amplitude} = {value:g}")
                continue
            energy = steps.stored - steps.spring_work
            rise = np.max(energy - np.minimum.accumulate(energy))
            if effect.family not in ACTIVE and rise > GAIN * np.ptp(energy):
                at = steps.t[np.argmax(energy - np.minimum.accumulate(energy))]
                where = f"{effect.amplitude} = {value:g}, t = {at:.3g} s"
                share = rise / np.ptp(energy)
                report(index, f"energy grows by {share:.2g} of what is lost, with the drive stopped, at {where}")
