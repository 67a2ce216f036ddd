"""The catalogue: effects by tag, those of the program, of installed packages and of a user's own file."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import TYPE_CHECKING, Any

from ...errors import InputError, nearest
from ...system import object_repr
from ...system.registry import Registry
from ...system.units import to_si
from ..params import Spec, check, specs, variants
from .base import Effect, Memory

if TYPE_CHECKING:
    import pandas

OWN = "one of your own needs --effect FILE.py (in Python: load_file)"
FAMILIES = ("contact", "friction", "block", "geometry", "drive", "sensor")

_TAG = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
_USER_MODULE = "stickslip_user_effect_"


def accept(cls: object) -> type[Effect]:
    """Refuse a class that cannot be an effect.

    Raises:
        InputError: what is missing, in the words of someone who writes an effect.
    """
    if not (inspect.isclass(cls) and issubclass(cls, Effect)):
        raise InputError("an effect is a class that inherits the roles it plays", value=repr(cls), hint=_roles_hint())
    here = cls.__name__
    if not _TAG.fullmatch(cls.tag):
        raise InputError(
            "an effect needs a tag", key=f"{here}.tag", value=cls.tag, allowed="lower case words joined by '-'"
        )
    if not roles(cls):
        raise InputError("an effect must play at least one role", key=here, hint=_roles_hint())
    missing = sorted(getattr(cls, "__abstractmethods__", ()))
    if missing:
        raise InputError("a role's method is not written", key=here, value=", ".join(missing))
    if cls.family not in FAMILIES:
        raise InputError("unknown family", key=f"{here}.family", value=cls.family, hint=nearest(cls.family, FAMILIES))
    known = specs(cls)
    several = [name for name, spec in known.items() if spec.null is not None]
    if not cls.amplitude and len(several) > 1:
        raise InputError(
            "an effect needs an amplitude, and several parameters have a null value",
            key=f"{here}.amplitude",
            allowed=", ".join(several),
            hint=f'a line such as  amplitude = "{several[0]}"  says which it is',
        )
    if cls.amplitude not in known or known[cls.amplitude].null is None:
        raise InputError(
            "an effect needs an amplitude: the parameter whose null value removes it",
            key=f"{here}.amplitude",
            value=cls.amplitude,
            allowed=", ".join(known) or None,
            hint="eps: Array = parameter(null=0.0, unit='1', lower=-0.1, upper=0.1, doc='...')",
        )
    for name, spec in known.items():
        if not spec.lower < spec.upper:
            raise InputError(
                "the bounds of a parameter are empty", key=f"{here}.{name}", value=[spec.lower, spec.upper]
            )
        _accept_prior(spec, f"{here}.{name}", name == cls.amplitude)
    if cls.__module__.startswith(f"{__package__}."):
        return cls  # making all of ours takes a quarter of the time of an import, and their tests do it
    for name, spec in known.items():
        if spec.unit != "1":
            to_si(f"1 * ({spec.unit})", spec.unit, key=f"{here}.{name}")  # there is such a unit
    check(cls(), where=cls.tag)
    if float(getattr(cls(), cls.amplitude)) != known[cls.amplitude].null:
        raise InputError("the amplitude's default must be its null value", key=f"{here}.{cls.amplitude}")
    return cls


def _accept_prior(spec: Spec, key: str, amplitude: bool) -> None:
    if spec.prior is not None and not spec.lower <= spec.prior <= spec.upper:
        raise InputError(
            "the prior of a parameter is centred beyond its bounds", key=key, value=spec.prior, allowed=spec.range
        )
    if spec.usual is not None and not spec.lower <= spec.usual[0] < spec.usual[1] <= spec.upper:
        raise InputError(
            "the usual range of a parameter is not within its bounds", key=key, value=spec.usual, allowed=spec.range
        )
    if spec.width is not None and not spec.width > 0.0:
        raise InputError("the width of a parameter's prior must be positive", key=key, value=spec.width)
    if amplitude and spec.prior is not None and spec.width is None:
        raise InputError("the prior of an amplitude needs a width", key=key, value=spec.prior)


EFFECTS: Registry[type[Effect]] = Registry("stickslip.effects", "effect", prepare=accept, name=lambda cls: cls.tag)
_user: dict[str, type[Effect]] = {}


def register(cls: type[Effect]) -> type[Effect]:
    """Class decorator: put an effect into the catalogue under its tag.

    Raises:
        InputError: the class cannot be an effect, or its tag is taken.
    """
    accept(cls)
    if cls.__module__.startswith(_USER_MODULE):
        taken = _user.get(cls.tag)
        if cls.tag in EFFECTS.names() or (taken is not None and taken is not cls):
            raise InputError("the tag is taken by another effect", key=f"{cls.__name__}.tag", value=cls.tag)
        _user[cls.tag] = cls
        return cls
    return EFFECTS.register(cls.tag, cls)


def tags() -> list[str]:
    """Tags of all effects: the program's own, of installed packages, of files that were loaded."""
    return [*EFFECTS.names(), *_user]


def user_modules() -> list[ModuleType]:
    """The modules of files with effects that were loaded."""
    return [sys.modules[name] for name in {cls.__module__ for cls in _user.values()} if name in sys.modules]


def all() -> dict[str, type[Effect]]:
    """Tag -> class of every effect."""
    return {**dict(EFFECTS), **_user}


def table() -> pandas.DataFrame:
    """A row for each effect: family, summary, roles, parameters, the source of its law."""
    rows = {
        tag: {
            "family": cls.family,
            "summary": cls.summary,
            "acts as": ", ".join(roles(cls)),
            "parameters": ", ".join(specs(cls)),
            "source": cls.source,
        }
        for tag, cls in all().items()
    }
    return object_repr.table(rows, "tag")


def get(tag: str) -> type[Effect]:
    """The class of that tag; `InputError` naming the nearest where there is none."""
    everything = all()
    if tag not in everything:
        raise InputError(f"there is no effect '{tag}'", hint=unknown(tag))
    return everything[tag]


def confused(tag: str) -> dict[str, str]:
    """Tag of every effect with which this one can be confused -> the experiment that separates the two; by either."""
    told = {other: cls.confused_with[tag] for other, cls in all().items() if tag in cls.confused_with}
    own = get(tag).confused_with
    return own | {other: text for other, text in told.items() if other not in own}


def unknown(tag: str, others: Sequence[str] = ()) -> str:
    """What to do about a tag that is none: the nearest of the catalogue and ``others``, or a file of one's own."""
    return f"{nearest(tag, [*others, *tags()])}; {OWN}"


def make(tag: str, **params: Any) -> Effect:
    """An effect with the given parameters, the rest at their defaults.

    Args:
        tag: of the catalogue.
        params: parameters in SI or as text with a unit (``rate="5 nm/s"``), and variants by name.

    Raises:
        InputError: unknown tag, unknown parameter (names the nearest), a wrong unit, a value outside its range.
    """
    cls = get(tag)
    known, forms = specs(cls), variants(cls)
    for name in params:
        if name not in forms and name not in known:
            raise InputError(
                f"effect '{tag}' has no such parameter", key=f"{tag}.{name}", hint=nearest(name, [*known, *forms])
            )
    effect = cls(**params)
    check(effect, where=tag)
    return effect


def amplitude(thing: Effect | type[Effect]) -> Spec:
    """The :class:`Spec` of the amplitude."""
    return specs(thing)[thing.amplitude]


def forms(cls: type[Effect]) -> Iterator[dict[str, str]]:
    """Every combination of variants of an effect, as keyword arguments of its class; the default form first."""
    combinations: list[dict[str, str]] = [{}]
    default = cls()
    for name, choices in variants(cls).items():
        first = getattr(default, name)
        ordered = [first, *(c for c in choices if c != first)]
        combinations = [{**before, name: choice} for before in combinations for choice in ordered]
    yield from combinations


def roles(cls: type[Effect]) -> list[str]:
    """Names of the roles an effect plays, e.g. ``["Memory", "Threshold"]``."""
    return [r.__name__ for r in _roles() if issubclass(cls, r)]


def load_file(path: str | Path, trial: Callable[[Sequence[type[Effect]]], None] | None = None) -> list[type[Effect]]:
    """Execute a user's Python file and put its effects into the catalogue. Loading it again replaces them.

    Every class in it that inherits a role and has a ``tag`` is taken; ``@register`` is not needed.

    Args:
        path: of the file.
        trial: is called with its effects; where it raises an `InputError` the catalogue stays as it was.

    Raises:
        InputError: no such file, an error in it (with its line), no effect in it, or an effect that lacks something.
    """
    path = Path(path)
    if path.suffix != ".py" or not path.is_file():
        raise InputError(
            "not a Python file" if path.exists() else "there is no such file",
            file=path,
            hint="give a file of your own with one effect class in it, or a tag of the catalogue",
        )
    name = _USER_MODULE + hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:12]
    before = {tag: cls for tag, cls in _user.items() if cls.__module__ == name}
    for tag in before:
        del _user[tag]
    try:
        module = _execute(path, name)
        found = [
            cls
            for cls in vars(module).values()
            if inspect.isclass(cls) and issubclass(cls, Effect) and cls.__module__ == name and cls.tag
        ]
        for cls in found:
            register(cls)
        if not found:
            raise InputError("the file defines no effect (a class with a tag)", hint=_roles_hint())
        if trial is not None:
            trial(found)
    except InputError as error:
        for tag in [tag for tag, cls in _user.items() if cls.__module__ == name]:
            del _user[tag]
        _user.update(before)
        raise error.at(file=path) from None
    return found


class _Fresh(SourceFileLoader):
    """Compiles the file as it is now: no cached byte code is read (it may be older by less than a second) or left."""

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


def _execute(path: Path, name: str) -> ModuleType:
    """The module of a file; whatever it raises becomes an error that names the line."""
    spec = importlib.util.spec_from_loader(name, _Fresh(name, str(path)))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except InputError:
        raise
    except SyntaxError as error:
        raise InputError(f"the file is not valid Python: {error.msg}", key=f"line {error.lineno}") from None
    except Exception as error:  # whatever a user's code raises
        lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
        where = f"line {lines[-1]}" if lines else None
        raise InputError(f"the file raises {type(error).__name__}: {error}", key=where) from None
    return module


def _roles() -> list[type[Effect]]:
    from . import base

    own = [c for c in vars(base).values() if inspect.isclass(c) and issubclass(c, Effect) and c is not Effect]
    return [Memory, *(c for c in own if c is not Memory)]


def _roles_hint() -> str:
    return "roles of stickslip.effects: " + ", ".join(r.__name__ for r in _roles())
