"""A campaign: the measured runs of one apparatus with their events, and what can be done with them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from ..data import campaign as files
from ..data.checks import Finding, refuse_impossible, rig_against_motion
from ..data.displacements import true_gains, with_displacements
from ..data.readers.repair import from_load_point
from ..data.segment import Segmentation, segment
from ..data.segment.left_out import left_out as not_used
from ..data.trace import Trace
from ..errors import InputError, nearest
from ..system.lazy_method import LazyMethod
from ..system.object_repr import Shown, facts, table
from ..system.progress import reporting
from .result_base import several

if TYPE_CHECKING:
    import pandas
    import xarray

    from ..inference.diagnose.prepare import Prepared
    from .diagnosis import diagnose as _diagnose
    from .fit import Fit
    from .forecast import forecast as _forecast
    from .inspection import inspect as _inspect
    from .result_base import Tell
    from .static_fit import StaticFit
    from .static_fit import fit_static as _fit_static


class Campaign(Shown, Mapping[str, Trace]):
    """Measured runs of one apparatus, by name: ``campaign["v050"]``, ``for name, trace in campaign.items()``.

    Args:
        description: what the campaign file says, or what
            :func:`stickslip.data.campaign.described` makes without a file.
        traces: the runs, in its order.
        effect_files: Python files with effects of one's own that were loaded with it.

    Attributes:
        description, traces, effect_files: as given.
    """

    def __init__(
        self, description: files.Campaign, traces: Sequence[Trace], effect_files: str | Path | Sequence[str | Path] = ()
    ) -> None:
        self.description, self.traces = description, tuple(traces)
        self.effect_files = tuple(map(Path, several(effect_files)))

    @classmethod
    def from_traces(
        cls, traces: Trace | Sequence[Trace], rig: Mapping[str, Any] | None = None, title: str = "",
        effect_files: str | Path | Sequence[str | Path] = (),
    ) -> Campaign:  # fmt: skip
        """A campaign without a file.

        Args:
            traces: the runs, such as of :meth:`stickslip.Trace.from_arrays`.
            rig: keys and values as under ``[rig]`` of a campaign file: ``{"mass": "89 g", "contacts": 4}``.
            title: free text.
            effect_files: Python files with effects of one's own; their code is run.

        Raises:
            InputError: no trace, two of one name, a key or value of the rig that cannot be used.
        """
        traces = [traces] if isinstance(traces, Trace) else traces
        if not traces:
            raise InputError("a campaign needs at least one run", key="traces", hint="ss.Trace.from_arrays makes one")
        _load_effects(effect_files)
        described = files.described([t.name for t in traces], rig or {}, title)
        own = [_with_spring(t, described) for t in traces]
        return cls(described, [from_load_point(t) for t in own], effect_files)

    @property
    def title(self) -> str:
        """Title of the campaign; the name of its file where it has none."""
        return self.description.title or self.description.path.stem

    @property
    def rig(self) -> files.Rig:
        """What is known of the apparatus (SI)."""
        return self.description.rig

    @property
    def names(self) -> list[str]:
        """Names of the runs."""
        return [t.name for t in self.traces]

    def __len__(self) -> int:
        return len(self.traces)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Trace:
        found = self.get(name)
        if found is not None:
            return found
        hint = nearest(name, self.names) if isinstance(name, str) else "by number: campaign.traces[0]"
        allowed = None if isinstance(name, str) else ", ".join(self.names)
        raise InputError(f"there is no run {name!r}", file=self._file, allowed=allowed, hint=hint)

    def get(self, name: str, default: Any = None) -> Any:
        """The run of that name, or the default where there is none."""
        return next((trace for trace in self.traces if trace.name == name), default)

    def only(self, *names: str | Sequence[str]) -> Campaign:
        """A campaign of these runs alone, in the order that they have here, with the same rig.

        Args:
            names: of the runs to keep.

        Raises:
            InputError: no name, or no run of that name.

        Examples:
            >>> import stickslip as ss
            >>> campaign = ss.load_example()
            >>> campaign.only("v050", "v400").names
            ['v050', 'v400']
            >>> campaign.without("holds").names
            ['v050', 'v100', 'v200', 'v400']
        """
        kept = self._named(names)
        if not kept:
            raise InputError("a campaign needs at least one run", key="names", allowed=", ".join(self.names))
        return self._of(trace for trace in self.traces if trace.name in kept)

    def without(self, *names: str | Sequence[str]) -> Campaign:
        """A campaign of all other runs; see :meth:`only`.

        Args:
            names: of the runs to leave out.

        Raises:
            InputError: no run of that name, or none is left.
        """
        left = self._named(names)
        if len(left) == len(self):
            raise InputError("no run is left", key="names", value=", ".join(self.names), hint="leave out fewer")
        return self._of(trace for trace in self.traces if trace.name not in left)

    def _named(self, names: Sequence[str | Sequence[str]]) -> set[str]:
        return {self[name].name for given in names for name in several(given)}

    def map(self, change: Callable[[Trace], Trace]) -> Campaign:
        """A campaign of changed runs, with the same rig: ``campaign.map(lambda trace: trace.coarsened("2 kHz"))``.

        Args:
            change: makes of a run the one to take its place, of the same name.

        Raises:
            InputError: what it makes is no trace, or has another name.
        """
        made = [change(trace) for trace in self.traces]
        for trace, new in zip(self.traces, made, strict=True):
            if not isinstance(new, Trace) or new.name != trace.name:
                value = new.name if isinstance(new, Trace) else type(new).__name__
                raise InputError("not a run of the same name", key=trace.name, value=value, allowed="a Trace")
        return self._of(made)

    def _of(self, traces: Iterable[Trace]) -> Campaign:
        """The same rig with other runs of names that it knows; no file says what it is."""
        kept = tuple(traces)
        entries = tuple(self.description.entry(trace.name) for trace in kept)
        return Campaign(replace(self.description, entries=entries, filed=False), kept, self.effect_files)

    __eq__ = object.__eq__  # of itself alone: comparing every sample is not what a dictionary or a set asks for
    __hash__ = object.__hash__

    @cached_property
    def events(self) -> tuple[Segmentation, ...]:
        """Slips of every run."""
        return tuple(segment(t) for t in self.traces)

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """What the motion contradicts of the rig as it is stated.

        Raises:
            InputError: block and drive are so far apart that a unit must be wrong.
        """
        try:
            found = rig_against_motion(self.description, self.traces, self.events)
            refuse_impossible(found)
        except InputError as error:
            raise error.at(file=self._file) from None
        return tuple(found)

    @cached_property
    def scaled(self) -> tuple[tuple[Segmentation, ...], tuple[str, ...]]:
        """Slips of all runs, the scale of the spring force corrected where sticks show it wrong, and a note on each."""
        segmentations, notes = true_gains(self.traces, self.events)
        return tuple(segmentations), tuple(notes)

    @cached_property
    def displaced(self) -> tuple[tuple[Trace, ...], tuple[str, ...]]:
        """Runs with a displacement, derived where it was not measured, and a note on each of these."""
        traces, notes = with_displacements(self.traces, self.scaled[0])
        return tuple(traces), tuple(notes)

    @cached_property
    def left_out(self) -> tuple[str, ...]:
        """Data that are not used, and why."""
        return tuple(not_used(self.traces, self.scaled[0]))

    def prepare(self, holdout: str | Sequence[str] = ()) -> Prepared:
        """The problem of the force along the measured motion, and where the fit of the base begins.

        Args:
            holdout: runs to keep aside.

        Raises:
            InputError: no run of that name, no run that can take part, or the mass is not given.
        """
        from ..inference.diagnose.prepare import prepare

        try:
            return prepare(self.description, self.displaced[0], self.scaled[0], several(holdout))
        except InputError as error:
            raise error.at(file=self._file) from None

    if TYPE_CHECKING:
        inspect, diagnose, forecast, fit_static = _inspect, _diagnose, _forecast, _fit_static
    else:
        inspect = LazyMethod("stickslip.objects.inspection")
        diagnose = LazyMethod("stickslip.objects.diagnosis")
        forecast = LazyMethod("stickslip.objects.forecast")
        fit_static = LazyMethod("stickslip.objects.static_fit")

    @overload
    def fit(
        self, effects: str | Sequence[str] = ..., model: Literal["inertial"] = ..., *,
        holdout: str | Sequence[str] = ..., progress: Tell | None = ...,
    ) -> Fit: ...  # fmt: skip
    @overload
    def fit(self, *, model: Literal["static"], progress: Tell | None = ...) -> StaticFit: ...
    def fit(
        self, effects: str | Sequence[str] = (), model: Literal["inertial", "static"] = "inertial", *,
        holdout: str | Sequence[str] = (), progress: Tell | None = None,
    ) -> Fit | StaticFit:  # fmt: skip
        """Fit a model to all runs.

        Args:
            effects: of the dynamic model, such as ``"contact-ageing"`` or ``"machine-compliance:where=series"``.
            model: ``"inertial"``, the force along the measured motion, or ``"static"``, every creep process by itself
                (:meth:`fit_static`, which has choices of its own).
            holdout: runs that no fit of the dynamic model sees.
            progress: told the stage and the share of it done; default a bar in a terminal or a notebook.

        Raises:
            InputError: no such model, effects or runs held out of the static one, no run can take part, an effect that
                is not known or only shapes the backbone.
            FitError: no finite model.
        """
        from .fit import fit

        if effects in ("inertial", "static"):
            raise InputError(
                "a model is no effect", key="effects", value=effects, hint=f'campaign.fit(model="{effects}")'
            )
        if model == "inertial":
            return fit(self, effects, holdout=holdout, progress=progress)
        if model != "static":
            raise InputError(
                "no such model", key="model", value=model, allowed='"inertial" or "static"',
                hint="inertial is the dynamic one, which takes effects; static fits every creep process by itself",
            )  # fmt: skip
        for key, value in {"effects": effects, "holdout": holdout}.items():
            if value:
                raise InputError(
                    "an argument of the inertial model", key=key, value=value, hint='leave it out, or model="inertial"'
                )
        return self.fit_static(progress=progress)

    def levels(self, run: str | None = None) -> xarray.Dataset:
        """Force of the spring at onset and arrest of every slip of a run, and when and where; no fit is needed.

        Args:
            run: its name; default the first.

        Returns:
            See :func:`stickslip.inference.forecast.levels`.

        Raises:
            InputError: no run of that name, no slip, or neither load point nor force is known.
        """
        from ..inference.forecast import levels

        trace = self.traces[0] if run is None else self[run]
        try:
            return levels(trace, self.scaled[0][self.names.index(trace.name)])
        except InputError as error:
            raise error.at(file=self._file) from None

    def to_xarray(self, run: str) -> xarray.Dataset:
        """Signals of a run; see :meth:`stickslip.Trace.to_xarray`."""
        return self[run].to_xarray()

    @property
    def summary(self) -> pandas.DataFrame:
        """A row for each run (SI)."""
        rows = {
            t.name: {
                "slips": len(s.events),
                "drive (m/s)": t.drive_velocity,
                "length (s)": t.duration,
                "sampling (Hz)": t.sampling_rate,
                "signal": t.leading,
                "virgin": t.virgin,
            }
            for t, s in zip(self.traces, self.events, strict=True)
        }
        return table(rows, "run")

    def inputs(self) -> list[dict[str, str]]:
        """Name and SHA-256 of all that a fit depends on: the files, or each run and its rig where none has both."""
        from ..system.runstore import file_record

        def of(trace: Trace) -> str:
            return hashlib.sha256(f"{self.description.rig_of(trace.name)!r} {trace.digest}".encode()).hexdigest()

        if not self.description.filed:
            return [{"file": trace.name, "sha256": of(trace)} for trace in self.traces]
        return [file_record(path) for path in (self.description.path, *self.description.files)]

    @property
    def _file(self) -> Path | None:
        return self.description.path if self.description.filed else None

    def _parts(self) -> list[Any]:
        return [facts({"campaign": self.title, "runs": len(self)}), self.summary]


def _with_spring(trace: Trace, described: files.Campaign) -> Trace:
    """The run with the rig's spring, where its own is not known."""
    known = described.rig.spring_stiffness
    if trace.spring_stiffness is None and isinstance(known, float):
        return trace.replace(spring_stiffness=known)
    return trace


def _load_effects(paths: str | Path | Sequence[str | Path]) -> None:
    """Put effects of one's own into the catalogue, which is loaded for them only."""
    if paths:
        from ..simulation.conformance import load_effects

        load_effects(several(paths))


def load_campaign(
    path: str | Path, effect_files: str | Path | Sequence[str | Path] = (), progress: Tell | None = None
) -> Campaign:
    """Read a campaign file and the runs it names.

    Args:
        path: of the TOML file (``stickslip new campaign`` writes one with every key explained).
        effect_files: Python files with effects of one's own; their code is run.
        progress: told what is read and the share of it done; default a bar where a terminal or a notebook shows one.

    Raises:
        InputError: the file, a trace, a unit or an effect's file cannot be used.
    """
    _load_effects(effect_files)
    description = files.load_campaign(path)
    traces = []
    with reporting("reading", progress) as tell:
        for i, entry in enumerate(description.entries):
            tell(f"reading {entry.label}", i / len(description.entries))
            traces.append(files.load_trace(description, entry))
    return Campaign(description, traces, effect_files)
