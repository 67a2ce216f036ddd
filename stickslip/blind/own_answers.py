"""Answers of any other method to the cases of a challenge, from a file or from Python."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, create_model, model_validator

from ..data.campaign.fields import faults
from ..data.campaign.located_errors import readable
from ..data.campaign.models import Model
from ..errors import InputError, nearest
from ..physics.effects import catalogue
from ..physics.params import specs
from ..system.units import to_si
from .answers import Answer

NOT_GIVEN = Answer("not run", text="not answered")


@faults()
def _tag(tag: str) -> str:
    if tag not in catalogue.tags():
        raise InputError(f"there is no effect {tag!r}", hint=nearest(tag, catalogue.tags()))
    return tag


def _several(tags: Any) -> Any:
    return (tags,) if isinstance(tags, str) else tags


@faults()
def _size(value: Any) -> Any:
    if isinstance(value, bool):
        raise InputError("no amplitude", value=value, allowed='a number in SI, or text with a unit such as "5 mN"')
    return value


Tag = Annotated[str, AfterValidator(_tag)]
Tags = Annotated[tuple[Tag, ...], BeforeValidator(_several)]
Size = Annotated[float | str, BeforeValidator(_size)]


class Amplitude(Model):
    """The amplitude of an effect, as the catalogue measures it.

    Attributes:
        value, std: it and its standard deviation, SI or text with a unit. form: of the law; default the catalogue's.
    """

    value: Size
    std: Size | None = None
    form: str | None = None


class OwnAnswer(Model):
    """What may be said of a case.

    Attributes:
        kind: ``complete``, ``missing``, ``ambiguous`` or ``unknown``.
        effects: tags of those that are missing. set: of those that come into question.
        amplitude: tag -> :class:`Amplitude`, of those that are missing.
        confidence: in the answer, 0 to 1. text: why.
    """

    kind: Literal["complete", "missing", "ambiguous", "unknown"]
    effects: Tags = ()
    set: Tags = ()
    amplitude: dict[Tag, Amplitude] = {}
    confidence: Annotated[float | None, Field(ge=0.0, le=1.0)] = None
    text: str = ""

    @model_validator(mode="after")
    @faults()
    def _agrees(self) -> OwnAnswer:
        if self.kind == "complete" and (self.effects or self.set):
            raise InputError("nothing is missing where the answer is 'complete'", hint="leave 'effects' and 'set' out")
        if self.kind == "missing" and not self.effects:
            raise InputError("'missing' needs the effects that are", hint='effects = ["contact-ageing"]')
        if self.kind == "ambiguous" and not self.set:
            raise InputError("'ambiguous' needs the effects in question", hint='set = ["tilt", "wear"]')
        for tag in self.amplitude:
            if tag not in self.effects:
                raise InputError(f"the amplitude of '{tag}', which is not named", hint="add it to 'effects'")
        self.answer()
        return self

    def answer(self) -> Answer:
        """As the score has it."""
        parameters, forms = {}, {}
        for tag, found in self.amplitude.items():
            law = catalogue.get(tag)
            unit, key, at = specs(law)[law.amplitude].unit, f"{tag}.{law.amplitude}", f"amplitude.{tag}"
            std = None if found.std is None else _in(unit, found.std, f"{at}.std")
            if std is not None and std < 0.0:
                raise InputError(f"{at}.std: out of range", value=found.std, allowed=f"0 {unit} or more")
            parameters[key] = {"value": _in(unit, found.value, f"{at}.value"), "std": std, "unit": unit}
            known = [form["form"] for form in catalogue.forms(law) if "form" in form]
            if found.form is not None and found.form not in known:
                allowed = ", ".join(known) or "this law has no forms: leave 'form' out"
                raise InputError(f"{at}.form: no such form", value=found.form, allowed=allowed)
            if known:
                forms[tag] = {"form": found.form or known[0]}
        named = tuple(dict.fromkeys(self.effects))
        return Answer(
            self.kind, named, self.set, parameters=parameters, confidence=self.confidence, text=self.text, forms=forms
        )


def _in(unit: str, value: float | str, at: str) -> float:
    try:
        return to_si(value, unit)
    except InputError as error:
        raise InputError(f"{at}: {error.what}", value=error.value, allowed=error.allowed, hint=error.hint) from None


def read_answers(answers: str | Path | Mapping[str, Any], cases: Sequence[str]) -> dict[str, Answer]:
    """The answer to every case; one that is not there is not answered.

    Args:
        answers: TOML file, or one that ends in ``.json``, with a table for each case; or such a mapping of mappings.
        cases: names of all cases.

    Raises:
        InputError: no such file, or not of its format; a case, an effect, a kind, a key that there is not; a unit that
            is wrong or missing.
    """
    path, text, content = None, "", answers
    if not isinstance(answers, Mapping):
        if not isinstance(answers, str | Path):
            raise InputError("no answers", key="answers", value=answers, allowed="a file, or a mapping of mappings")
        path = Path(answers)
        text, content = _read(path)
    tables = isinstance(content, Mapping) and all(isinstance(own, Mapping | OwnAnswer) for own in content.values())
    if not tables:
        hint = '"case-001": {"kind": "complete"}'
        raise InputError("the answer to each case is a table", file=path, hint=hint)
    fields: dict[str, Any] = dict.fromkeys(cases, (OwnAnswer | None, None))
    model = create_model("Answers", __base__=Model, **fields)
    try:
        found = model.model_validate(content)
    except ValidationError as error:
        raise readable(error, model, text, path) from None
    given = {name: getattr(found, name) for name in cases}
    return {name: NOT_GIVEN if own is None else own.answer() for name, own in given.items()}


def _read(path: Path) -> tuple[str, Any]:
    """The text of a file and what is in it."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"the answers cannot be read ({error.strerror})", file=path) from None
    except UnicodeDecodeError:
        raise InputError("not a text file in UTF-8", file=path, hint="save it as UTF-8") from None
    try:
        return text, json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except ValueError as error:
        kind = "JSON" if path.suffix == ".json" else "TOML"
        raise InputError(f"not valid {kind}: {error}", file=path, hint="correct the line") from None
