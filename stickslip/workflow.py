"""From a campaign file to the finished run folder of its diagnosis: one path for the command line and the challenge."""

from __future__ import annotations

import hashlib
import sys
import time
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError, nearest
from .runstore import Run, file_record, json_text, open_run, refuse_existing, versions

if TYPE_CHECKING:
    from .campaign import Campaign


def input_records(loaded: Campaign) -> list[dict[str, str]]:
    """Name and SHA-256 of the campaign file and of every file with measured numbers."""
    return [file_record(path) for path in (loaded.path, *loaded.files)]


def _check_candidates(tags: Sequence[str]) -> None:
    """All that is wrong with a choice of effects, at once."""
    from .effects import catalogue

    if not any(tags):
        raise InputError("no effect is named", key="--candidates", hint="leave it out, and all effects are tried")
    known = catalogue.tags()
    wrong = [tag for tag in tags if tag not in known]
    if wrong:
        named = {tag: nearest(tag, known) for tag in wrong}
        every = nearest("", known)  # said once, not for each that is near none
        hints = [f"{tag}: {hint}" if len(wrong) > 1 else hint for tag, hint in named.items() if hint != every]
        hints += [every] if every in named.values() else []
        raise InputError(
            f"there is no effect {' and no effect '.join(repr(tag) for tag in wrong)}",
            key="--candidates",
            hint="\n  ".join([*hints, catalogue.OWN]),
        )


def check_counts(max_effects: int, jobs: int | None = None) -> None:
    """Refuse numbers that a diagnosis could only fail on after its first fit.

    Raises:
        InputError: fewer than one effect or process.
    """
    for key, value, hint in (
        ("--max-effects", max_effects, "leave it out for up to 4; stickslip fit fits the base model alone"),
        ("--jobs", jobs, "leave it out for one process a core"),
    ):
        if value is not None and value < 1:
            raise InputError("out of range", key=key, value=value, allowed="1 or more", hint=hint)


def check_time(limit: float | None) -> None:
    """Refuse a time limit that is none.

    Raises:
        InputError: it is not positive.
    """
    if limit is not None and not limit > 0.0:
        raise InputError(
            "out of range", key="--time-limit", value=limit, allowed="more than 0 s", hint="leave it out for no limit"
        )


def code_digest(effect_files: Sequence[str | Path] = ()) -> str:
    """Digest of the package's own modules and of effects from elsewhere: pieces made by other code are not taken up.

    Of an installed package it has the version, and the modules that define the effects (which may be under work).
    """
    from .effects import catalogue

    own = sorted(Path(__file__).parent.rglob("*.py"))
    plugged = sorted({getattr(sys.modules.get(c.__module__), "__file__", None) or "" for c in catalogue.all().values()})
    others = [path for path in map(Path, plugged) if path.is_file() and path not in own]
    digest = hashlib.sha256(json_text(catalogue.EFFECTS.packages()).encode())
    for path in (*own, *others, *map(Path, effect_files)):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


class Pieces:
    """Finished pieces in the run folder, one file each, written aside and renamed."""

    def __init__(self, run: Run, inputs: str) -> None:
        self._run, self._inputs = run, inputs

    def _path(self, key: str) -> Path:
        return self._run.path(f"pieces/{key}.npz")

    def ready(self) -> int:
        """How many finished pieces of the same inputs there are."""
        return sum(self.load(path.stem) is not None for path in self._path("any").parent.glob("*.npz"))

    def load(self, key: str) -> Mapping[str, np.ndarray] | None:
        """A finished piece of the same inputs, or None."""
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = dict(file)
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
            return None
        return arrays if str(arrays.pop("inputs", "")) == self._inputs else None

    def save(self, key: str, piece: Mapping[str, np.ndarray]) -> None:
        """Keep a finished piece."""
        path = self._path(key)
        aside = path.with_suffix(".part")
        with aside.open("wb") as stream:
            np.savez(stream, allow_pickle=False, inputs=np.array(self._inputs), **piece)
        aside.replace(path)


def diagnose_campaign(
    campaign: str | Path,
    out: str | Path,
    *,
    candidates: Sequence[str] | None = None,
    max_effects: int = 4,
    holdout: Sequence[str] = (),
    effect_files: Sequence[str | Path] = (),
    jobs: int | None = None,
    time_limit: float | None = None,
    force: bool = False,
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Diagnose a campaign and write its run folder (``result.json``, ``arrays.nc``, ``report.html``, finished pieces).

    An interrupted diagnosis goes on from its pieces.

    Args:
        campaign: the TOML file. out: the run folder.
        candidates, max_effects, holdout, jobs, time_limit, progress: see ``stickslip.diagnose.engine.diagnose``.
        effect_files: Python files with effects of one's own, which are run.
        force: replace an existing run folder.

    Returns:
        What ``result.json`` holds.

    Raises:
        InputError: the campaign, a trace, a tag or a number cannot be used.
        RunFolderError: the folder cannot be written.
    """
    check_counts(max_effects, jobs)
    check_time(time_limit)
    out = Path(out)
    refuse_existing(out, force)
    began = time.perf_counter()
    import xarray

    from .campaign import load_campaign, load_traces
    from .checks import refuse_impossible, rig_against_motion, stopping
    from .conformance import try_laws
    from .diagnose.engine import diagnose
    from .diagnose.summary import summary
    from .effects import catalogue
    from .motion import true_gains, with_displacements
    from .report import abilities, write_report
    from .report.describe import left_out
    from .report.diagnosis_result import trace_sections
    from .segment import segment

    for path in effect_files:
        catalogue.load_file(Path(path))
    loaded = load_campaign(campaign)
    traces = load_traces(loaded)
    if candidates is not None:
        _check_candidates(candidates)
    try_laws(catalogue.get(tag) for tag in (catalogue.tags() if candidates is None else candidates))
    inputs = input_records(loaded)
    events = [segment(t) for t in traces]
    try:
        rig = rig_against_motion(loaded, traces, events)
        refuse_impossible(rig)
        able = abilities(traces, events)
    except InputError as error:
        raise error.at(file=loaded.path) from None
    notes = [finding.sentence for finding in rig]
    with open_run(out, force=force, resume=True) as run:
        key = json_text(
            {
                "inputs": inputs,
                "holdout": list(holdout),
                "versions": versions(),
                "code": code_digest(effect_files),
            }
        )
        segmentations, mended = true_gains(traces, events)
        traces, implied = with_displacements(traces, segmentations)
        pieces = Pieces(run, key)
        ready = pieces.ready()
        # before minutes of fitting, in which a wrong unit may be mended
        first = [*notes, *able.cannot, *([f"going on from {ready} finished pieces"] if ready else [])]
        if progress is not None and first:
            progress("\n         ".join(["before anything is fitted:", *first]), 0.0)
        left = None if time_limit is None else max(time_limit - (time.perf_counter() - began), 0.0)
        try:
            found = diagnose(
                loaded,
                traces,
                segmentations,
                candidates=candidates,
                max_effects=max_effects,
                holdout=holdout,
                jobs=jobs,
                store=pieces,
                time_limit=left,
                wrong=stopping(rig),
                progress=progress,
            )
        except KeyboardInterrupt:
            text = f"{pieces.ready()} finished pieces are kept, and the same command goes on from them"
            raise KeyboardInterrupt(text) from None
        except InputError as error:
            for finding in reversed(stopping(rig)):  # with the sign wrong in every run there are no slips to fit
                error = error.with_hint(finding.sentence, first=True)
            raise error.at(file=loaded.path) from None
        sections, variables = summary(found, loaded.rig)
        result: dict[str, Any] = {
            "kind": "diagnose", "title": loaded.title, **sections, "inputs": inputs, "versions": versions()
        }  # fmt: skip
        result["rig"] = [f.plain() for f in dict.fromkeys((*rig, *found.wrong))]
        result["notes"] = [*mended, *implied]
        result |= {"can": list(able.can), "cannot": list(able.cannot)}
        result["dropped"] = [*left_out(traces, segmentations), *result["dropped"]]
        described, pictured = trace_sections(traces, segmentations)
        result |= described
        variables |= pictured
        coordinates = variables.pop("coordinates", {})
        run.arrays(xarray.Dataset(variables, coords=coordinates, attrs={"title": loaded.title}))
        result["seconds"] = round(time.perf_counter() - began, 1)
        run.json(result)
        write_report(run.folder)
    return result
