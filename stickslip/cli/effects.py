"""``stickslip effects``: the catalogue, one effect, or the equations of a model."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, RunFolderError, StickslipError
from . import show
from .parameters import Flag, OwnEffects

if TYPE_CHECKING:
    import numpy as np
    import xarray

    from ..physics.effects.base import Effect


def effects(
    tag: str | None = None,
    *,
    model: str | None = None,
    latex: Flag = False,
    effect: OwnEffects = (),
    picture: Path | None = None,
    force: Flag = False,
) -> int:
    """List the catalogue of effects, explain one, or print a model's equations.

    Parameters
    ----------
    tag:
        The effect to explain.
    model:
        Print the equations of this model: --model static,inertia,contact-ageing. Forms of a law and values other than
        the defaults go behind the tag: rate-and-state:law=slip:evolution=0.01, drive-ripple:pitch=2mm.
    latex:
        Print the equations as LaTeX.
    picture:
        Write a picture of the trace with and without the effect to this PNG file.
    force:
        Replace an existing picture.
    """
    if picture is not None and tag is None:
        raise InputError("a picture needs a tag", hint="stickslip effects contact-ageing --picture ageing.png")
    if latex and model is None:
        hint = "the explanation of an effect holds its LaTeX"
        hint = hint if tag else "--model static,inertia,contact-ageing --latex"
        raise InputError("--latex belongs to --model", key="--latex", hint=hint)
    if picture is not None:
        _check_picture(picture, force)
    from ..physics.effects import catalogue
    from ..simulation.conformance import load_effects

    load_effects(effect)
    if model is not None:
        print(_equations(model.split(","), latex), end="")
        return 0
    if tag is None:
        print(_catalogue(catalogue.all()))
        return 0
    cls = catalogue.get(tag)
    print(_explained(cls), flush=True)
    if picture is not None:
        _draw(cls, picture)
        print(f"\nwritten to {picture}")
        return 0
    if sys.stdout.isatty():  # it takes some seconds, which a pipe need not wait for
        print("\n".join(["", *_sketched(cls)]))
    if cls.__module__.startswith("stickslip."):
        print(f"picture with a stick and a slip close up: stickslip effects {cls.tag} --picture {cls.tag}.png")
    return 0


def _equations(words: list[str], latex: bool) -> str:
    from ..physics.effects.equations import of_tags
    from ..physics.model import Block, Weakening

    found = of_tags(words, block=Block(), weakening=Weakening())
    return found.latex() if latex else found.text()


def _catalogue(known: dict[str, type[Effect]]) -> str:
    from ..physics.effects.catalogue import FAMILIES

    width = max(map(len, known))
    lines = []
    for family in FAMILIES:
        members = [cls for cls in known.values() if cls.family == family]
        if members:
            lines += [f"{family}:", *(f"  {cls.tag.ljust(width)}  {cls.summary}" for cls in members), ""]
    return "\n".join([*lines, "stickslip effects TAG explains one; --model static,inertia,TAG prints the equations."])


def _explained(cls: type[Effect]) -> str:
    from ..physics.effects.catalogue import confused, roles

    lines = [f"{cls.tag} ({cls.family}): {cls.summary}", "", *_formula(cls.equation), ""]
    lines += ["parameters:", *(f"  {line}" for line in _parameters(cls)), *_forms(cls)]
    lines += ["", f"acts as: {', '.join(roles(cls))}", *_wrapped("signature", cls.signature)]
    others = confused(cls.tag)
    if others:
        lines.append("confused with:")
        for other, experiment in others.items():
            lines += _wrapped(f"  {other}", experiment)
    return "\n".join([*lines, *_wrapped("source", cls.source)])


def _formula(latex: str) -> list[str]:
    from ..physics.effects.equation_text import pieces
    from ..physics.effects.latex_to_text import plain

    return [*(f"  {plain(part)}" for part in pieces(latex)), f"  LaTeX: {latex}"]


def _forms(cls: type[Effect]) -> Iterator[str]:
    """The choices, and the equations of every form of a law that has several."""
    from ..physics.effects.catalogue import forms
    from ..physics.params import variants

    if not variants(cls):
        return
    yield from (f"  {name}: one of {', '.join(choices)}" for name, choices in variants(cls).items())
    for number, form in enumerate(forms(cls)):
        chosen = ", ".join(f"{name} = {choice}" for name, choice in form.items())
        yield from ("", f"{chosen}{' (default)' if number == 0 else ''}:", *_formula(cls(**form).formula()))


def _parameters(cls: type[Effect]) -> Iterator[str]:
    from ..inference.fit.parameters import priors
    from ..physics.effects.latex_to_text import plain
    from ..physics.params import span, specs

    effect = cls()
    known = priors(effect)
    for name, spec in specs(cls).items():
        unit = "" if spec.unit == "1" else f" {spec.unit}"
        symbol = f" ({plain(spec.symbol)})" if spec.symbol else ""
        null = "" if spec.null is None else f", absent at {spec.null:g}"
        default = float(getattr(effect, name))
        bounds = f"[{spec.range}{'' if spec.usual is None else f', usually {span(*spec.usual, spec.unit)}'}]"
        yield f"{name}{symbol} = {default:.6g}{unit} {bounds}: {spec.doc}{null}; prior: {known[name]}"


def _wrapped(head: str, text: str) -> list[str]:
    return textwrap.wrap(f"{head}: {text}", 110, subsequent_indent="    ") if text else []


def _check_picture(path: Path, force: bool) -> None:
    if path.suffix.lower() != ".png":
        raise InputError("a picture is a PNG file", key="--picture", value=str(path), allowed="a name with .png")
    if path.exists() and not (force and path.is_file()):
        raise RunFolderError("the picture exists already", file=path, hint="choose another name, or use --force")


def _sketched(cls: type[Effect]) -> list[str]:
    """Lines that show the spring's force without and with an effect, from just before the first slip, on one scale.

    It is the one that the sensor's reading tells, so that an error of the sensor shows as well.
    """
    from ..simulation.scenario.demonstration import RIG, with_and_without
    from ._sketch import sketch

    def told(data: xarray.Dataset) -> np.ndarray:
        off = data["displacement"] - data["reading"]
        return (data["spring_force"] + RIG["block"]["spring_stiffness"] * off).values

    try:
        *both, values = with_and_without(cls)
    except StickslipError as error:
        return [f"no picture of it: {error}"]
    begin = 0.95 * min((float(d["onset"][0]) for d in both if d["onset"].size), default=0.0)
    parts = [d.sel(time=slice(begin, None)) for d in both]
    curves = [(d["time"].values, told(d)) for d in parts]
    low, top = min(float(y.min()) for _, y in curves), max(float(y.max()) for _, y in curves)
    span = f"from {show.quantity(begin, 's')} to {show.quantity(float(curves[0][0][-1]), 's')}, "
    span += f"between {show.quantity(low, 'N')} and {show.quantity(top, 'N')}"
    lines = [f"spring force derived from the reading, {span}"]
    for name, (t, y) in zip(("without", f"with {_given(cls, values)}"), curves, strict=True):
        lines += [f"{name}:", *(f"  {line}" for line in sketch(t, y, columns=72, rows=5, limits=(low, top)))]
    return lines


def _given(cls: type[Effect], values: Mapping[str, float]) -> str:
    """Values of an effect's parameters in words."""
    from ..physics.params import specs

    known = specs(cls)
    return ", ".join(f"{name} = {show.quantity(value, known[name].unit)}" for name, value in values.items())


def _draw(cls: type[Effect], path: Path) -> None:
    from ..show.plots import effect_figure, save
    from ..simulation.scenario.demonstration import with_and_without

    without, with_it, values = with_and_without(cls)
    try:
        save(effect_figure(without, with_it, cls.tag, _given(cls, values)), path)
    except OSError as error:
        raise RunFolderError(f"the picture cannot be written ({error.strerror})", file=path) from None
