"""Pages of the catalogue, one for every effect, written from its class: ``docs/effects/TAG.md`` and pictures.

    python docs/effect_pages.py

Sphinx calls `write_all` before every build. Pictures are made anew only where the package has changed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray

from stickslip.inference.fit.parameters import priors
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Effect
from stickslip.physics.effects.equation_text import pieces
from stickslip.physics.effects.symbols import BASE, found, of_parameters
from stickslip.physics.params import Spec, specs, variants
from stickslip.show.plots.style import scaled

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
NUMBERS = "numbers.json"
TOGETHER = 10  # effects that share a compilation, all but one of them absent


def page(cls: type[Effect], numbers: Mapping[str, Sequence[float | None]] | None = None) -> str:
    """The page of an effect, in MyST Markdown; ``numbers`` of `measured` without and with it."""
    acting = [ACTS[role] for role in catalogue.roles(cls) if role in ACTS]
    memory = " It has a state of its own." if "Memory" in catalogue.roles(cls) else ""
    parts = [
        f"# {cls.tag}",
        f"{prose(cls.summary[:1].upper() + cls.summary[1:])}.",
        display(cls.equation),
        *_symbols(cls),
        *(prose(text) for text in re.split(r"\n\s*\n", inspect.cleandoc(cls.__doc__ or ""))),
        f"**Acts on** {' and '.join(acting)}.{memory}",
        "## With and without",
        f"![The demonstration rig with and without {cls.tag}]({cls.tag}.png)",
        "*A small rig (89.4 g, 1 N/mm, four contacts; `stickslip/simulation/scenario/demonstration.py`) with "
        f"{_shown_amplitude(cls)} and everything else at its default: drawn at 200 µm/s, with a hold of 2 s; made by "
        "the program when these pages are built.*",
        *_numbers(numbers),
        "In a scenario file:",
        "```toml\n" + _entry(cls) + "\n```",
        f"No fit takes it up (`stickslip fit --add {cls.tag}` says so): it is a random process, and another "
        "draw is another course. How large it is in a measurement and what it follows is part of "
        "[every base fit](../diagnosis.md#the-force-along-the-measured-motion) and of a [forecast](../forecast.md)."
        if cls.drawn
        else f"The same in a fit: `stickslip fit campaign.toml --add {cls.tag}`.",
        "## Parameters",
        *_parameters(cls),
        *_forms(cls),
        "## In a measurement",
        f"{prose(cls.signature[:1].upper() + cls.signature[1:])}.",
        "| similar to | the experiment that separates the two |\n|---|---|\n"
        + "\n".join(f"| [{tag}]({tag}.md) | {cell(text)} |" for tag, text in catalogue.confused(cls.tag).items()),
        "## Source",
        f"{prose(cls.source.rstrip('.'))}.",
    ]
    return "\n\n".join(parts) + "\n"


def index(classes: Sequence[type[Effect]]) -> str:
    """The list of all effects, by family."""
    parts = [
        "# The catalogue of effects",
        "Every effect is one class in `stickslip/physics/effects`; these pages are written from the classes. "
        "The base model is in the [theory](../theory.md). An effect at its null value leaves the base model bit for "
        "bit as it is, which the conformance suite checks together with bounds, energy and derivatives.",
    ]
    for family, title in FAMILIES.items():
        members = [cls for cls in classes if cls.family == family]
        if members:
            rows = "\n".join(f"| [{cls.tag}]({cls.tag}.md) | {cell(cls.summary)} |" for cls in members)
            parts += [f"## {title}", f"| effect | |\n|---|---|\n{rows}"]
    names = "\n".join(cls.tag for cls in classes)
    parts.append(f"```{{toctree}}\n:hidden:\n\n{names}\n```")
    return "\n\n".join(parts) + "\n"


def display(latex: str) -> str:
    """A formula as a block of its own, its equations below one another."""
    parts = pieces(latex)
    lines = " \\\\\n".join(f"& {part}" for part in parts) if len(parts) > 1 else parts[0]
    return f"```{{math}}\n{lines}\n```"


def symbols(cls: type[Effect]) -> list[str]:
    """Symbols of an effect's equations, in all its forms, that are not parameters of it, in the order they come."""
    formulas = [cls.equation, *(cls(**form).formula() for form in catalogue.forms(cls))]
    return [t for t in dict.fromkeys(t for f in formulas for t in found(f)) if t not in of_parameters(cls)]


def meaning(cls: type[Effect], symbol: str) -> str:
    """Of a symbol on an effect's page; empty where it has none."""
    return {**BASE, **cls.symbols}.get(symbol, "")


def _symbols(cls: type[Effect]) -> Iterator[str]:
    told = [f"${s}$ {prose(meaning(cls, s))}" for s in symbols(cls) if meaning(cls, s)]
    if told:
        dot = "; a dot is the rate of change in time" if r"\dot" in cls.equation else ""
        yield f"{'; '.join(told)}{dot}."


def _parameters(cls: type[Effect]) -> Iterator[str]:
    rows = ["| | name | meaning | unit | default | range | absent at | prior |", "|---|---|---|---|---|---|---|---|"]
    default = cls()
    known = priors(default)
    for name, spec in specs(cls).items():
        symbol = f"${spec.symbol}$" if spec.symbol else ""
        null = "" if spec.null is None else number(spec.null)
        unit = "" if spec.unit == "1" else spec.unit
        span = f"{number(spec.lower)} ... {number(spec.upper)}{', logarithmic' if spec.log else ''}"
        if spec.usual is not None:
            span += f"; usually {number(spec.usual[0])} ... {number(spec.usual[1])}"
        value = number(float(getattr(default, name)))
        rows.append(
            f"| {symbol} | `{name}` | {cell(spec.doc)} | {cell(unit)} | {value} | {span} | {null} | {known[name]} |"
        )
    yield "\n".join(rows)
    grids = {name: spec for name, spec in specs(cls).items() if spec.grid}
    if cls.periodic is not None:
        grids.pop("phase", None)
    if grids and not cls.drawn:
        starts = "; ".join(f"`{name}` {', '.join(number(v) for v in spec.grid)}" for name, spec in grids.items())
        instead = "" if cls.periodic is None else ", or from the periods that the onsets hint at"
        yield f"A search starts from up to six combinations of {starts}{instead}."


def _forms(cls: type[Effect]) -> Iterator[str]:
    fields = {f.name: f.metadata.get("doc", "") for f in dataclasses.fields(cls) if "choices" in f.metadata}
    if not fields:
        return
    yield "## Forms of the law"
    for name, choices in variants(cls).items():
        doc = f": {prose(fields[name])}" if fields[name] else ""
        first = getattr(cls(), name)
        yield f"`{name}`{doc}. One of {', '.join(f'`{c}`' for c in choices)} (default `{first}`)."
    for form in catalogue.forms(cls):
        yield ", ".join(f"`{name} = {choice}`" for name, choice in form.items()) + ":"
        yield display(cls(**form).formula())


SLIPPED = 1e-6  # m: more than that is no creep
# what `measured` gives: name, unit, factor from SI, format
MEASURED = (
    ("time from the second slip to the third", "ms", 1e3, ".2f"),
    ("second slip", "µm", 1e6, ".3f"),
    ("its largest velocity", "mm/s", 1e3, ".3f"),
    ("creep in the half of the stick before it", "nm", 1e9, ".1f"),
    ("displacement in the hold of 2 s", "nm", 1e9, ".1f"),
)


def measured(data: xarray.Dataset) -> list[float | None]:
    """What a sensor sees of a run of the rig, SI: the quantities of `MEASURED`, None where there is none."""
    t, y = data["time"].values, data["reading"].values
    onset, arrest = data["onset"].values, data["arrest"].values
    if onset.size < 3 or arrest.size < 2:
        return [None] * len(MEASURED)

    def at(moment: float) -> float:
        return float(np.interp(moment, t, y))

    part = (t >= onset[1]) & (t <= arrest[1])
    stick = onset[1] - arrest[0]
    # the ring-down of the last slip before the hold is over half-way through it
    return [
        float(onset[2] - onset[1]),
        at(arrest[1]) - at(onset[1]),
        float(np.max(np.gradient(y[part], t[part]))),
        at(onset[1] - 0.02 * stick) - at(onset[1] - 0.5 * stick),
        at(4.49) - at(2.51),
    ]


def _numbers(numbers: Mapping[str, Sequence[float | None]] | None) -> Iterator[str]:
    """The runs in numbers: what is too small for the picture."""
    if not numbers:
        return
    rows = ["| in the sensor's reading | without | with | change |", "|---|---|---|---|"]
    for (name, unit, factor, form), a, b in zip(MEASURED, numbers["without"], numbers["with"], strict=True):
        if a is None or b is None:
            continue
        if name.startswith("displacement in the hold") and abs(b) > SLIPPED:
            rows.append(f"| {name} / {unit} | {a * factor:{form}} | slips in the hold | |")
            continue
        share = f"{100 * (b - a) / abs(a):+.2g} %" if abs(a * factor) >= 0.5 and abs(b - a) < abs(a) else ""
        rows.append(f"| {name} / {unit} | {a * factor:{form}} | {b * factor:{form}} | {share} |")
    yield "\n".join(rows)


def _amplitude(cls: type[Effect]) -> tuple[Spec, float]:
    from stickslip.simulation.scenario.demonstration import typical_amplitude

    return specs(cls)[cls.amplitude], float(f"{typical_amplitude(cls):.3g}")


def _shown_amplitude(cls: type[Effect]) -> str:
    spec, value = _amplitude(cls)
    return f"`{cls.amplitude}` = {_quantity(value, spec.unit)}"


def _quantity(value: float, unit: str) -> str:
    """With a unit between 1 and 1000 where it takes a prefix."""
    if unit in ("m", "s", "N", "m/s", "m/s^2", "m/N"):
        factor, unit = scaled(np.array([value]), unit)
        return f"{value * factor:g} {unit}"
    return f"{value:g}" + ("" if unit == "1" else f" {unit}")


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
    """Simulate the demonstration rig without and with every effect, draw both, and write ``numbers.json``."""
    from stickslip.show.plots import effect_figure, save
    from stickslip.simulation.scenario import make_scenario, simulate
    from stickslip.simulation.scenario.demonstration import RIG

    without = simulate(make_scenario(RIG))
    numbers = {}
    for first in range(0, len(classes), TOGETHER):
        group = classes[first : first + TOGETHER]
        for cls in group:
            # the others are there at their nulls, where they change nothing: one compilation serves the group
            spec, value = _amplitude(cls)
            entries = [{"type": c.tag, **({c.amplitude: value} if c is cls else {})} for c in group]
            with_it = simulate(make_scenario({**RIG, "effect": entries}))
            shown = f"{cls.amplitude} = {_quantity(value, spec.unit)}"
            save(effect_figure(without, with_it, cls.tag, shown), folder / f"{cls.tag}.png")
            numbers[cls.tag] = {"without": measured(without), "with": measured(with_it)}
    (folder / NUMBERS).write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


def write_all(folder: Path) -> None:
    """Pages, index and pictures of every effect; files that would not change are left alone."""
    folder.mkdir(exist_ok=True)
    classes = [catalogue.get(tag) for tag in sorted(catalogue.EFFECTS.names())]
    stamp, state = folder / "pictures.sha256", _state()
    drawn = all((folder / f"{cls.tag}.png").exists() for cls in classes) and (folder / NUMBERS).exists()
    if not drawn or not stamp.exists() or stamp.read_text() != state:
        draw(classes, folder)
        stamp.write_text(state)
    numbers = json.loads((folder / NUMBERS).read_text(encoding="utf-8"))
    wanted = {"index.md": index(classes), **{f"{cls.tag}.md": page(cls, numbers.get(cls.tag)) for cls in classes}}
    for old in folder.glob("*.md"):
        if old.name not in wanted:
            old.unlink()
    for name, text in wanted.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


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
