"""``stickslip effects``: the catalogue, one effect, or the equations of a model."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError, RunFolderError
from . import show

if TYPE_CHECKING:
    from ..effects.base import Effect


def effects(
    tag: str | None = None,
    *,
    model: str | None = None,
    effect: Annotated[tuple[Path, ...], Parameter(negative="")] = (),
    picture: Path | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """List the catalogue of effects, explain one, or print a model's equations.

    Parameters
    ----------
    tag:
        The effect to explain.
    model:
        Print the equations of this model: --model static,inertia,contact-ageing.
    effect:
        A Python file with an effect of your own. Its code is run.
    picture:
        Write a picture of the trace with and without the effect to this PNG file.
    force:
        Replace an existing picture.
    """
    if picture is not None and tag is None:
        raise InputError("a picture needs a tag", hint="stickslip effects contact-ageing --picture ageing.png")
    from ..effects import catalogue

    for path in effect:
        catalogue.load_file(path)
    if model is not None:
        from ..scenario.equations import as_text, model_parts

        print(as_text(model_parts([name.strip() for name in model.split(",") if name.strip()])))
        return 0
    if tag is None:
        print(_catalogue(catalogue.all()))
        return 0
    cls = catalogue.get(tag)
    print(_explained(cls))
    if picture is not None:
        _draw(cls, picture, force)
        print(f"\nwritten to {picture}")
    return 0


def _catalogue(known: dict[str, type[Effect]]) -> str:
    from ..effects.catalogue import FAMILIES

    width = max(map(len, known))
    lines = []
    for family in FAMILIES:
        members = [cls for cls in known.values() if cls.family == family]
        if members:
            lines += [f"{family}:", *(f"  {cls.tag.ljust(width)}  {cls.summary}" for cls in members), ""]
    return "\n".join([*lines, "stickslip effects TAG explains one; --model static,inertia,TAG prints the equations."])


def _explained(cls: type[Effect]) -> str:
    from ..effects.catalogue import roles
    from ..params import specs, variants
    from ..scenario.equations import parameter_lines

    default = cls()
    values = [(name, spec, float(getattr(default, name))) for name, spec in specs(cls).items()]
    lines = [f"{cls.tag} ({cls.family}): {cls.summary}", "", f"  {cls.equation}", "", "parameters:"]
    lines += [f"  {line}" for line in parameter_lines(values)]
    lines += [f"  {name}: one of {', '.join(choices)}" for name, choices in variants(cls).items()]
    lines += ["", f"acts as: {', '.join(roles(cls))}", *_wrapped("signature", cls.signature)]
    if cls.confused_with:
        lines.append("confused with:")
        for other, experiment in cls.confused_with.items():
            lines += _wrapped(f"  {other}", experiment)
    return "\n".join([*lines, *_wrapped("source", cls.source)])


def _wrapped(head: str, text: str) -> list[str]:
    return textwrap.wrap(f"{head}: {text}", 110, subsequent_indent="    ") if text else []


def _draw(cls: type[Effect], path: Path, force: bool) -> None:
    if path.suffix.lower() != ".png":
        raise InputError("a picture is a PNG file", key="--picture", value=str(path), allowed="a name with .png")
    if path.exists() and not (force and path.is_file()):
        raise RunFolderError("the picture exists already", file=path, hint="choose another name, or use --force")
    from ..plots import effect_figure, save
    from ..scenario.demonstration import with_and_without

    with show.progress_bar("both traces") as watch:
        without, with_it, values = with_and_without(cls, watch)
    text = ", ".join(f"{name} = {value}" for name, value in values.items())
    try:
        save(effect_figure(without, with_it, cls.tag, text), path)
    except OSError as error:
        raise RunFolderError(f"the picture cannot be written ({error.strerror})", file=path) from None
