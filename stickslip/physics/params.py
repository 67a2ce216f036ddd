"""Parameters that know what they are: value, unit, bounds, prior and null value, kept beside the field.

A physical class is a :class:`Parametrised` whose fields are made by :func:`parameter`; :func:`specs` reads them back.
Names are local to the class; nothing here is a global table.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, ParamSpec

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import InputError
from ..system.units import shown, to_si

P = ParamSpec("P")


@dataclass(frozen=True)
class Spec:
    """What a person must know of one parameter.

    Attributes:
        default: the value where none is given; without one it is the null value.
        unit: SI unit (``"1"`` for a pure number).
        lower, upper: the plausible range; values outside are refused.
        null: the value at which the effect is absent (``None`` for a shape parameter, which has no null).
        log: whether it is sought and drawn on a logarithmic scale.
        grid: values from which a search starts, for shape parameters that are not identified at the null.
        doc: meaning in words.
        symbol: LaTeX symbol.
        ends: ends of the range where the law becomes a special case (a sharp corner, no direct effect): a fit may
            arrive there, which says nothing against it.
        prior: centre of what is known of the value beforehand (``None``: the default, of an amplitude its null).
        width: standard deviation of that knowledge: of the natural logarithm for a parameter that is sought on a
            logarithmic scale, else in SI (an amplitude is never sought on one); infinite where nothing is known.
            ``None`` leaves it to the rule of :func:`stickslip.inference.fit.parameters.effect_parameters`.
        usual: from where to where values lie as a rule, if that is less than lower to upper; one beyond is doubted in
            words, and not refused.

    Raises:
        TypeError: neither a default nor a null value.
    """

    default: float | None = None
    _: KW_ONLY
    unit: str
    lower: float
    upper: float
    doc: str
    null: float | None = None
    log: bool = False
    grid: tuple[float, ...] = ()
    symbol: str = ""
    ends: tuple[float, ...] = ()
    prior: float | None = None
    width: float | None = None
    usual: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        default = self.null if self.default is None else self.default
        if default is None:
            raise TypeError("a parameter needs a default, or a null value that is its default")
        for name, value in (("default", default), ("lower", self.lower), ("upper", self.upper)):
            object.__setattr__(self, name, float(value))

    @property
    def range(self) -> str:
        """``"0 ... 0.05 m/s"``."""
        return span(self.lower, self.upper, self.unit)


def span(lower: float, upper: float, unit: str) -> str:
    """A range with its unit, which a pure number does not have."""
    return f"{lower:g} ... {upper:g}{'' if unit == '1' else f' {unit}'}"


class Parametrised(eqx.Module):
    """What has fields made by :func:`parameter`, or is made of such parts: it shows their values with units."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        bases = filter(dataclasses.is_dataclass, reversed(cls.__mro__[1:]))
        inherited = {f.name: f for base in bases for f in dataclasses.fields(base)}
        again = {name: f for name, f in inherited.items() if "spec" in f.metadata and name not in vars(cls)}
        for name, field in again.items():  # of its own, for a field knows the name of one class
            setattr(cls, name, _field(field.metadata["spec"]))
        cls.__annotations__ = inspect.get_annotations(cls) | {name: field.type for name, field in again.items()}
        for name, made in vars(cls).items():  # fields, of which equinox has not made a data class yet
            if isinstance(made, dataclasses.Field) and "spec" in made.metadata:
                made.metadata["converter"].key = f"{vars(cls).get('tag') or cls.__name__}.{name}"

    def __repr__(self) -> str:
        known = specs(self)
        said = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        text = (f"{name}={_said(value, known[name].unit if name in known else '1')}" for name, value in said.items())
        return f"{type(self).__name__}({', '.join(text)})"


class Ranged(Parametrised):
    """What cannot be is refused where it is made: a sign that no value of the range has, and NaN.

    Fits have values beyond the ranges, which :func:`check` compares where a motion is solved for.
    """

    def __check_init__(self) -> None:
        for name, spec in specs(self).items():
            value = getattr(self, name)
            if not isinstance(value, jax.core.Tracer):
                number = np.asarray(value, dtype=float)
                there = number > 0.0 if spec.lower > 0.0 else number >= 0.0 if spec.lower == 0.0 else number == number
                if not np.all(there):
                    raise _outside(spec, f"{type(self).__name__.lower()}.{name}", number)


def _said(value: Any, unit: str) -> str:
    if isinstance(value, eqx.Module | tuple):
        return repr(value)
    number = isinstance(value, (float, np.ndarray, jax.Array)) and not isinstance(value, jax.core.Tracer)
    return shown(float(value), unit) if number and np.ndim(value) == 0 else eqx.tree_pformat(value)


class _Converter:
    """Of a number in SI, or of text with a unit, a 64-bit array; what is traced passes as it is."""

    key: str | None = None  # class and name of the parameter, which a field is not told

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def __call__(self, value: Any) -> Any:
        if isinstance(value, str):
            value = to_si(value, self.unit, key=self.key)
        if isinstance(value, (bool, int, float, np.ndarray, np.floating, np.integer)):
            return jnp.asarray(value, dtype=jnp.float64)
        return value


def _field(spec: Spec) -> Any:
    return eqx.field(default=spec.default, converter=_Converter(spec.unit), metadata={"spec": spec})


def _described(spec: Callable[P, Spec]) -> Callable[P, Any]:
    def parameter(*args: P.args, **kwargs: P.kwargs) -> Any:
        """A field of a physical class: a 64-bit float with its :class:`Spec`, whose arguments it takes.

        Where the class is made, the value is a number in SI or text with a unit; an `InputError` names the parameter if
        that cannot be read.
        """
        return _field(spec(*args, **kwargs))

    taken = inspect.signature(spec).replace(return_annotation=Any)
    parameter.__signature__ = taken  # type: ignore[attr-defined]
    parameter.__qualname__ = "parameter"
    return parameter


parameter = _described(Spec)


def phase(doc: str) -> Any:
    """The angle at which an oscillation begins. A turn to either side: a fit may go round without meeting a border."""
    turn = 2.0 * np.pi
    return parameter(0.0, unit="rad", lower=-turn, upper=turn, grid=(0.0, turn / 4), symbol=r"\varphi", doc=doc)


def first_age(default: float) -> Any:
    """For effects whose state is an age, which no record tells of its start."""
    return parameter(
        default, unit="s", lower=1e-3, upper=1e7, log=True, grid=(1.0, 100.0), symbol=r"\theta_1",
        doc="age of the contact at the start of the record",
    )  # fmt: skip


def variant(default: str, choices: tuple[str, ...], doc: str = "") -> Any:
    """A field that chooses between several forms of a law found in the literature (static: another compilation)."""
    return eqx.field(default=default, static=True, metadata={"choices": choices, "doc": doc})


def specs(thing: Any) -> dict[str, Spec]:
    """Name -> :class:`Spec` of every parameter of a class or an instance, in the order of definition."""
    return {f.name: f.metadata["spec"] for f in dataclasses.fields(thing) if "spec" in f.metadata}


def variants(thing: Any) -> dict[str, tuple[str, ...]]:
    """Name -> allowed choices of every variant field of a class or an instance."""
    return {f.name: f.metadata["choices"] for f in dataclasses.fields(thing) if "choices" in f.metadata}


def _outside(spec: Spec, key: str, number: np.ndarray) -> InputError:
    what = spec.doc or key.rpartition(".")[2]
    return InputError(f"{what} is outside its range", key=key, value=number.tolist(), allowed=spec.range)


def check(thing: Any, *, where: str = "") -> None:
    """Refuse values outside the range of their :class:`Spec` and unknown variants.

    Raises:
        InputError: names the parameter, its value and the allowed range. Traced values are not checked.
    """
    prefix = f"{where}." if where else ""
    for name, spec in specs(thing).items():
        value = getattr(thing, name)
        if isinstance(value, jax.core.Tracer):
            continue
        number = np.asarray(value, dtype=float)
        if not np.all(np.isfinite(number)) or np.any(number < spec.lower) or np.any(number > spec.upper):
            raise _outside(spec, f"{prefix}{name}", number)
    for name, choices in variants(thing).items():
        if getattr(thing, name) not in choices:
            raise InputError(
                "unknown form of the law",
                key=f"{prefix}{name}",
                value=getattr(thing, name),
                allowed=", ".join(choices),
            )
