"""Effects from elsewhere are tried before they are used: can the model be compiled with the law at all?"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Iterable
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp

from ...errors import InputError, StickslipError
from ...physics.effects import catalogue
from ...physics.effects.base import Effect, Motion
from ...physics.model import Model, State
from .rig import base_model

_OURS = "stickslip."


def load_file(path: str | Path) -> list[type[Effect]]:
    """Execute a user's Python file, try its laws, and put its effects into the catalogue. Again, it replaces them.

    Every class in it that inherits a role and has a ``tag`` is taken; ``@register`` is not needed.

    Args:
        path: of the file.

    Raises:
        InputError: no such file, an error in it (with its line), no effect in it, an effect that lacks something, or a
            law with which the model cannot be compiled (with its line). The catalogue then stays as it was.
    """
    return catalogue.load_file(path, try_laws)


def load_effects(paths: Iterable[str | Path]) -> list[type[Effect]]:
    """:func:`load_file` for several files."""
    return [cls for path in paths for cls in load_file(path)]


def try_laws(classes: Iterable[type[Effect]]) -> None:
    """Trace one increment of the model with every form of each effect that is not the program's own.

    Raises:
        InputError: one cannot be compiled; names the file, the line in it, and what was raised.
    """
    for cls in classes:
        if cls.__module__.startswith(_OURS):
            continue
        for form in catalogue.forms(cls):
            try:
                before, after = eqx.filter_eval_shape(_increment, base_model((cls(**form),)))
            except StickslipError:
                raise
            except Exception as error:  # whatever a foreign law raises when it is traced
                raise _refusal(cls, first_line(error), _line(error, cls)) from None
            if _shapes(before) != _shapes(after):
                raise _refusal(cls, "its state or what it changes has another shape or type after an increment")


def blamed(error: Exception) -> InputError | None:
    """What a law that is not the program's own raised when it was used, with its file and line; None: it did not."""
    for tag in catalogue.tags():
        cls = catalogue.get(tag)
        where = None if cls.__module__.startswith(_OURS) else _line(error, cls)
        if where is not None:
            return InputError(f"the law of '{tag}' failed: {first_line(error)}", file=_file(cls), key=where)
    return None


def first_line(error: Exception) -> str:
    """Kind and first line of what a foreign law raised."""
    return f"{type(error).__name__}: {str(error).strip().splitlines()[0] if str(error).strip() else ''}"


def _increment(model: Model) -> tuple[State, State]:
    """A state and what an increment makes of it, everything that an effect may act on included."""
    t, dt, step = jnp.asarray(1.0), jnp.asarray(1e-3), jnp.asarray(1e-7)
    bank, before = model.shaped(), model.rest()
    motion = Motion(t, dt, step, jnp.asarray(1e-4), jnp.zeros(()), step, model.lead(t))
    after, forces = model.advance(before, bank, model.contact(before, bank, t), motion)
    seen = forces.net / model.mass() + model.read(after, motion, forces.contact) + model.rising(after)
    return before, eqx.tree_at(lambda y: y.v, after, after.v + 0.0 * seen)


def _shapes(state: State) -> list[tuple]:
    return [(jax.tree.structure(state),), *((leaf.shape, leaf.dtype) for leaf in jax.tree.leaves(state))]


def _file(cls: type[Effect]) -> str | None:
    try:
        return inspect.getfile(cls)
    except (OSError, TypeError):
        return None


def _line(error: Exception, cls: type[Effect]) -> str | None:
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == _file(cls)]
    return f"line {lines[-1]}" if lines else None


def _refusal(cls: type[Effect], what: str, key: str | None = None) -> InputError:
    hint = (
        "a law is written with jax.numpy and without 'if' on a value (jnp.tanh(v / v_r) for a sign, "
        "jnp.maximum(x, 0.0) for a part); what it returns has the shape that its role asks for (documentation, "
        "'Writing an effect')"
    )
    return InputError(f"the law of '{cls.tag}' cannot be compiled: {what}", file=_file(cls), key=key, hint=hint)
