"""Answers of any other method to the cases of a challenge, from a file or from Python."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, create_model, model_validator

from ..data.campaign.fields import faults
from ..data.campaign.located_errors import readable
from ..data.campaign.models import Model
from ..errors import InputError
from ..physics.effects import catalogue
from ..physics.params import specs
from ..system.units import to_si
from .answers import Answer

NOT_GIVEN = Answer("not run", text="not answered")


@faults()
def _tag(tag: str) -> str:
    catalogue.get(tag)
    return tag


Tag = Annotated[str, AfterValidator(_tag)]


class Amplitude(Model):
    """The amplitude of an effect, as the catalogue measures it.

    Attributes:
        value, std: it and its standard deviation, SI or text with a unit. form: of the law; default the catalogue's.
    """

    value: float | str
    std: float | str | None = None
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
    effects: tuple[Tag, ...] = ()
    set: tuple[Tag, ...] = ()
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
            unit, key = specs(law)[law.amplitude].unit, f"{tag}.{law.amplitude}"
            std = None if found.std is None else to_si(found.std, unit)
            if std is not None and std < 0.0:
                raise InputError("a standard deviation is not negative", value=found.std)
            parameters[key] = {"value": to_si(found.value, unit), "std": std, "unit": unit}
            form = next(catalogue.forms(law)).get("form") if found.form is None else found.form
            if form is not None:
                catalogue.make(tag, form=form)
                forms[tag] = {"form": form}
        named = tuple(dict.fromkeys(self.effects))
        return Answer(
            self.kind, named, self.set, parameters=parameters, confidence=self.confidence, text=self.text, forms=forms
        )


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
        path = Path(answers)
        text, content = _read(path)
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
