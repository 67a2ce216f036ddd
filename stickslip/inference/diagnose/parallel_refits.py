"""Every effect on top of a model, in processes side by side."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import jax
import jax.numpy as jnp
import numpy as np
from joblib import Parallel, delayed

from ...physics.contact import Bank
from ...physics.effects import catalogue
from ...physics.effects.base import Memory
from ...system import process, threads
from ...system.parent_watch import end_with
from ..force.candidates import Candidate, every_form, try_effect
from ..force.fit import Fit
from ..force.signatures import Explained
from .checkpoints import load_candidate, name_of, save_candidate
from .fit_pickling import FitPickler
from .work import Work


def trials(base: Fit, tags: Sequence[str], work: Work, name: str = "round") -> list[Candidate]:
    """Every form of every effect, refitted with the base.

    Args:
        base: the model they are added to.
        tags: effects to try.
        work: how.
        name: of what is kept.
    """
    forms, store = every_form(tags), work.store
    out: list[Candidate] = []
    left = []
    for tag, form in forms:
        known = None if store is None else load_candidate(store, f"{name}-{name_of(tag, form)}", base)
        if known is None:
            left.append((tag, form))
        else:
            out.append(known)
    # the largest first, so that no process waits for one that was begun last
    groups = [(tag, [form for other, form in left if other == tag]) for tag in dict.fromkeys(t for t, _ in left)]
    groups.sort(key=lambda job: -_size(base, *job))
    for made in _made(base, groups, work.jobs):
        out += made
        if store is not None:
            for candidate in made:
                save_candidate(store, f"{name}-{name_of(candidate.tag, candidate.form)}", candidate)
        work.tell(made[-1].tag, len(out) / len(forms))
        if not work.in_time():
            break
    order = {(tag, tuple(form.items())): i for i, (tag, form) in enumerate(forms)}
    return sorted(out, key=lambda c: order[c.tag, tuple(c.form.items())])


Job = tuple[str, list[dict[str, str]]]  # an effect in some of its forms


def _made(base: Fit, work: Sequence[Job], jobs: int) -> Iterator[list[Candidate]]:
    if jobs == 1 or len(work) < 4:
        explained = Explained(base)
        for tag, forms in work:
            yield try_effect(base, explained, tag, forms)
            process.forget_programs()
        return
    files = tuple(str(m.__file__) for m in catalogue.user_modules())
    with warnings.catch_warnings(), TemporaryDirectory(prefix="stickslip-") as folder:
        warnings.filterwarnings("ignore", message="A worker stopped")
        job = Path(folder) / "base"
        pickler = FitPickler.packed(base, job)
        pool = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
        jobs_of = (delayed(_in_worker)(job, tag, forms, files, os.getpid()) for tag, forms in work)
        yield from map(pickler.unpack, pool(jobs_of))


def _size(base: Fit, tag: str, forms: Sequence[Mapping[str, str]]) -> int:
    """Numbers that an effect remembers, over its forms."""
    reach = base.problem.composition.reach
    total = len(forms)
    for form in forms:
        effect = catalogue.get(tag)(**form)
        if isinstance(effect, Memory):
            state = effect.start(Bank(jnp.ones(reach.size), jnp.asarray(reach)))
            total += sum(int(np.size(leaf)) for leaf in jax.tree.leaves(state))
    return total


_kept: dict[Path, tuple[FitPickler, Explained]] = {}


def _in_worker(job: Path, tag: str, forms: list[dict[str, str]], files: tuple[str, ...], parent: int) -> bytes:
    """One effect in a worker, which loads the user's files first and keeps the base of its last job."""
    end_with(parent)
    threads.alone(False)
    process.begin()
    for file in files:
        if not any(str(m.__file__) == file for m in catalogue.user_modules()):
            catalogue.load_file(file)
    if job not in _kept:
        _kept.clear()
        pickler = FitPickler(job)
        _kept[job] = (pickler, Explained(pickler.base))
    pickler, explained = _kept[job]
    made = pickler.pack(try_effect(pickler.base, explained, tag, forms))
    process.forget_programs()
    return made
