"""Every effect on top of a model, in processes side by side."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from cloudpickle import dumps, loads
from joblib import Parallel, delayed

from ..contact import Bank
from ..effects import catalogue
from ..effects.base import Memory
from ..force.candidates import Candidate, every_form, try_effect
from ..force.fit import Fit
from ..force.score import Explained
from .pieces import Store, load_candidate, name_of, save_candidate

Tell = Callable[[str, float], None]


def trials(
    base: Fit,
    tags: Sequence[str],
    jobs: int,
    tell: Tell,
    until: Callable[[], bool],
    store: Store | None = None,
    name: str = "round",
) -> list[Candidate]:
    """Every form of every effect, refitted with the base.

    Args:
        base: the model they are added to.
        tags: effects to try.
        jobs: processes.
        tell: told what was tried and the share done.
        until: whether there is time for more; what is not tried then is missing from the answer.
        store, name: keeps what is finished, under this name.
    """
    work = every_form(tags)
    out: list[Candidate] = []
    left = []
    for tag, form in work:
        known = None if store is None else load_candidate(store, f"{name}-{name_of(tag, form)}", base)
        if known is None:
            left.append((tag, form))
        else:
            out.append(known)
    # the largest first, so that no process waits for one that was begun last
    left.sort(key=lambda job: -_size(base, *job))
    for candidate in _made(base, left, jobs):
        out.append(candidate)
        if store is not None:
            save_candidate(store, f"{name}-{name_of(candidate.tag, candidate.form)}", candidate)
        tell(candidate.tag, len(out) / len(work))
        if not until():
            break
    order = {(tag, tuple(form.items())): i for i, (tag, form) in enumerate(work)}
    return sorted(out, key=lambda c: order[c.tag, tuple(c.form.items())])


def _made(base: Fit, work: Sequence[tuple[str, dict[str, str]]], jobs: int) -> Iterator[Candidate]:
    if jobs == 1 or len(work) < 4:
        explained = Explained(base)
        for tag, form in work:
            yield try_effect(base, explained, tag, form)
        return
    files = tuple(str(m.__file__) for m in catalogue.user_modules())
    job = dumps(base)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="A worker stopped")
        pool = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
        yield from (
            loads(a) for a in pool(delayed(_in_worker)(job, tag, form, files, os.getpid()) for tag, form in work)
        )


def _size(base: Fit, tag: str, form: Mapping[str, str]) -> int:
    """Numbers that an effect remembers."""
    effect = catalogue.get(tag)(**form)
    if not isinstance(effect, Memory):
        return 0
    reach = base.problem.composition.reach
    state = effect.start(Bank(jnp.ones(reach.size), jnp.asarray(reach)))
    return sum(int(np.size(leaf)) for leaf in jax.tree.leaves(state))


_kept: dict[int, tuple[Fit, Explained]] = {}


def _in_worker(job: bytes, tag: str, form: dict[str, str], files: tuple[str, ...], parent: int) -> Any:
    """One form in a worker, which loads the user's files first and keeps the base of its last job."""
    from .. import cache
    from ..lifeline import end_with

    end_with(parent)
    cache.enable()
    for file in files:
        if not any(str(m.__file__) == file for m in catalogue.user_modules()):
            catalogue.load_file(file)
    key = hash(job)
    if key not in _kept:
        _kept.clear()
        base = loads(job)
        _kept[key] = (base, Explained(base))
    return dumps(try_effect(*_kept[key], tag, form))
