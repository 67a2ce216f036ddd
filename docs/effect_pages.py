"""Pages of the catalogue, one for every effect, written from its class: ``docs/effects/TAG.md`` and pictures.

    python docs/effect_pages.py

Sphinx calls `write_all` before every build. Pictures are made anew only where the package has changed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from stickslip.effects import catalogue
from stickslip.effects.base import Effect
from stickslip.params import Spec, specs, variants

# what a role does to the base model
ACTS = {
    "Inertia": "the moving mass",
    "Drive": "the position of the load point",
    "Spring": "the law of the driving spring",
    "Geometry": "the bank of Jenkins elements, before anything moves",
    "Threshold": "the caps of the elements",
    "Stiffness": "the stiffness of the elements",
    "Flow": "the forces of the elements, besides their elastic increment",
    "BodyForce": "the block, by a force of its own",
    "Sensor": "what is read, not what happens",
}
FAMILIES = {
    "contact": "Contact",
    "friction": "Friction",
    "block": "Block and spring",
    "geometry": "Geometry of the contact",
    "drive": "Drive and surroundings",
    "sensor": "Sensor",
}
TOGETHER = 10  # effects that share a compilation, all but one of them absent


def page(cls: type[Effect]) -> str:
    """The page of an effect, in MyST Markdown."""
    acting = [ACTS[role] for role in catalogue.roles(cls) if role in ACTS]
    memory = " It has a state of its own." if "Memory" in catalogue.roles(cls) else ""
    parts = [
        f"# {cls.tag}",
        f"{prose(cls.summary[:1].upper() + cls.summary[1:])}.",
        f"```{{math}}\n{cls.equation}\n```",
        *(prose(text) for text in re.split(r"\n\s*\n", inspect.cleandoc(cls.__doc__ or ""))),
        f"**Acts on** {' and '.join(acting)}.{memory}",
        "## Parameters",
        *_parameters(cls),
        *_forms(cls),
        "## With and without",
        f"![The demonstration rig with and without {cls.tag}]({cls.tag}.png)",
        f"*The rig of `stickslip effects` with {_shown_amplitude(cls)} and everything else at its default: drawn at "
        "200 µm/s, with a hold of 2 s; made by the program when these pages are built.*",
        "```toml\n" + _entry(cls) + "\n```",
        f"The same in a fit: `stickslip fit campaign.toml --add {cls.tag}`.",
        "## In a measurement",
        f"{prose(cls.signature[:1].upper() + cls.signature[1:])}.",
        "| may be taken for | the experiment that separates the two |\n|---|---|\n"
        + "\n".join(f"| [{tag}]({tag}.md) | {cell(text)} |" for tag, text in cls.confused_with.items()),
        "## Source",
        f"{prose(cls.source.rstrip('.'))}.",
    ]
    return "\n\n".join(parts) + "\n"


def index(classes: Sequence[type[Effect]]) -> str:
    """The list of all effects, by family."""
    parts = [
        "# The catalogue of effects",
        "Every effect is one class in `stickslip/effects`; these pages are written from the classes. The base model is "
        "in the [theory](../theory.md). An effect at its null value leaves the base model bit for bit as it is, which "
        "the conformance suite checks together with bounds, energy and derivatives.",
    ]
    for family, title in FAMILIES.items():
        members = [cls for cls in classes if cls.family == family]
        if members:
            rows = "\n".join(f"| [{cls.tag}]({cls.tag}.md) | {cell(cls.summary)} |" for cls in members)
            parts += [f"## {title}", f"| effect | |\n|---|---|\n{rows}"]
    names = "\n".join(cls.tag for cls in classes)
    parts.append(f"```{{toctree}}\n:hidden:\n\n{names}\n```")
    return "\n\n".join(parts) + "\n"


def _parameters(cls: type[Effect]) -> Iterator[str]:
    rows = ["| | name | meaning | unit | default | range | absent at |", "|---|---|---|---|---|---|---|"]
    default = cls()
    for name, spec in specs(cls).items():
        symbol = f"${spec.symbol}$" if spec.symbol else ""
        null = "" if spec.null is None else number(spec.null)
        unit = "" if spec.unit == "1" else spec.unit
        span = f"{number(spec.lower)} ... {number(spec.upper)}{', logarithmic' if spec.log else ''}"
        value = number(float(getattr(default, name)))
        rows.append(f"| {symbol} | `{name}` | {cell(spec.doc)} | {cell(unit)} | {value} | {span} | {null} |")
    yield "\n".join(rows)
    grids = {name: spec for name, spec in specs(cls).items() if spec.grid}
    if grids:
        starts = "; ".join(f"`{name}` {', '.join(number(v) for v in spec.grid)}" for name, spec in grids.items())
        yield f"A search starts from: {starts}."


def _forms(cls: type[Effect]) -> Iterator[str]:
    fields = {f.name: f.metadata.get("doc", "") for f in dataclasses.fields(cls) if "choices" in f.metadata}
    if not fields:
        return
    yield "## Forms of the law"
    for name, choices in variants(cls).items():
        doc = f": {prose(fields[name])}" if fields[name] else ""
        first = getattr(cls(), name)
        yield f"`{name}`{doc}. One of {', '.join(f'`{c}`' for c in choices)} (default `{first}`)."


def _amplitude(cls: type[Effect]) -> tuple[Spec, float]:
    from stickslip.scenario.demonstration import typical_amplitude

    return specs(cls)[cls.amplitude], float(f"{typical_amplitude(cls):.3g}")


def _shown_amplitude(cls: type[Effect]) -> str:
    spec, value = _amplitude(cls)
    return f"`{cls.amplitude}` = {number(value)}{'' if spec.unit == '1' else f' {spec.unit}'}"


def _entry(cls: type[Effect]) -> str:
    spec, value = _amplitude(cls)
    amount = f"{value:g}" if spec.unit == "1" else f'"{value:g} {spec.unit}"'
    return f'[[effect]]\ntype = "{cls.tag}"\n{cls.amplitude} = {amount}'


def number(value: float) -> str:
    """A number as a reader wants it."""
    mantissa, _, exponent = f"{value:g}".partition("e")
    if not exponent:
        return mantissa
    power = f"10^{{{int(exponent)}}}"
    return f"${power}$" if mantissa == "1" else rf"${mantissa}\times {power}$"


def prose(text: str) -> str:
    """Words of a docstring as Markdown: what stands between backticks stays, marks elsewhere mean themselves."""
    pieces = re.split(r"(``[^`]+``|`[^`]+`)", text.strip())
    return "".join(f"`{p.strip('`')}`" if p.startswith("`") else re.sub(r"([\\*_<>\[\]$])", r"\\\1", p) for p in pieces)


def cell(text: str) -> str:
    """The same within a table."""
    return prose(" ".join(text.split())).replace("|", r"\|")


def draw(classes: Sequence[type[Effect]], folder: Path) -> None:
    """Simulate the demonstration rig without and with every effect, and draw both."""
    from stickslip.plots import effect_figure, save
    from stickslip.scenario import make_scenario, simulate
    from stickslip.scenario.demonstration import RIG

    without = simulate(make_scenario(RIG))
    for first in range(0, len(classes), TOGETHER):
        group = classes[first : first + TOGETHER]
        for cls in group:
            # the others are there at their nulls, where they change nothing: one compilation serves the group
            spec, value = _amplitude(cls)
            entries = [{"type": c.tag, **({c.amplitude: value} if c is cls else {})} for c in group]
            with_it = simulate(make_scenario({**RIG, "effect": entries}))
            unit = "" if spec.unit == "1" else f" {spec.unit}"
            save(
                effect_figure(without, with_it, cls.tag, f"{cls.amplitude} = {value:g}{unit}"),
                folder / f"{cls.tag}.png",
            )


def write_all(folder: Path) -> None:
    """Pages, index and pictures of every effect; files that would not change are left alone."""
    folder.mkdir(exist_ok=True)
    classes = [catalogue.get(tag) for tag in sorted(catalogue.EFFECTS.names())]
    wanted = {"index.md": index(classes), **{f"{cls.tag}.md": page(cls) for cls in classes}}
    for old in folder.glob("*.md"):
        if old.name not in wanted:
            old.unlink()
    for name, text in wanted.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    stamp, state = folder / "pictures.sha256", _state()
    drawn = all((folder / f"{cls.tag}.png").exists() for cls in classes)
    if not drawn or not stamp.exists() or stamp.read_text() != state:
        draw(classes, folder)
        stamp.write_text(state)


def _state() -> str:
    """A digest of everything the pictures depend on."""
    import stickslip

    root = Path(stickslip.__file__).parent
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for part in ("contact", "effects", "plots", "scenario", "solve", "model.py", "params.py"):
        place = root / part
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    write_all(Path(__file__).resolve().parent / "effects")
