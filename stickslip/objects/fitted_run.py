"""The model that a run folder holds: what a fit or a diagnosis found, to be simulated and asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError, RunFolderError
from ..inference.fit.serialised import KEY, Fitted, from_record, shared
from ..physics.effects.effects_from_text import with_form
from ..simulation.conformance import load_effects
from ..system.object_repr import Shown, facts, table
from ..system.runstore import RESULT, read_result
from .fitted_model import FittedModel, scenario_content
from .result_base import several

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class FittedRun(FittedModel, Shown):
    """A run folder of ``stickslip fit --model inertial`` or ``stickslip diagnose``.

    Attributes:
        folder: where it lies.
        result: what ``result.json`` holds.
        fitted: the family of models, the member that was found, and its covariance.
    """

    folder: Path
    result: Mapping[str, Any]
    fitted: Fitted

    @property
    def title(self) -> str:
        """Title of the campaign that was fitted."""
        return str(self.result.get("title") or self.folder.name)

    @property
    def parts(self) -> tuple[str, ...]:
        """Tags of what is in the model, such as ``("static", "inertia", "contact-ageing")``."""
        return self.fitted.parts

    @property
    def effect_forms(self) -> tuple[str, ...]:
        """Its effects as :meth:`stickslip.Fit.add` takes them, with the form of a law where it is not the usual one."""
        return tuple(with_form(e) for e in self.fitted.composition.effects)

    @property
    def parameters(self) -> pandas.DataFrame:
        """Value and standard deviation (SI), unit, prior and meaning of every fitted parameter of the model."""
        values, std = self.fitted.values, self.fitted.std
        free = [f for f in self.fitted.composition.free if shared(f.name)]
        rows = {
            f.name: {
                "value": values[f.name], "std": std[f.name], "unit": f.unit, "prior": f.known, "meaning": f.doc,
            }
            for f in free
        }  # fmt: skip
        return table(rows, "parameter")

    @property
    def _file(self) -> Path:
        return self.folder / RESULT

    def _parts(self) -> list[Any]:
        verdict = self.result.get("verdict", {}).get("text")
        what = {"folder": self.folder, "campaign": self.title, "model": " + ".join(self.parts), "verdict": verdict}
        return [facts(what), self.parameters[["value", "std", "unit"]]]


def load_run(folder: str | Path, effect_files: str | Path | Sequence[str | Path] = ()) -> FittedRun:
    """Read the model that a fit or a diagnosis left in its run folder.

    Args:
        folder: of ``stickslip fit --model inertial --out`` or ``stickslip diagnose --out``.
        effect_files: Python files with effects of one's own that are in the model; their code is run.

    Raises:
        RunFolderError: no run folder, a damaged one, or one that holds no fitted model.
        InputError: the model has an effect that is not known here.
    """
    folder = Path(folder)
    result = read_result(folder)
    load_effects(several(effect_files))
    section = result.get(KEY)
    if section is None:
        raise RunFolderError(
            "this run holds no fitted model",
            file=folder / RESULT,
            hint="stickslip diagnose and stickslip fit --model inertial leave one; older runs must be made again",
        )
    try:
        found = FittedRun(folder, result, from_record(section))
        scenario_content(found.fitted, "", {}, found._spring())  # whether every parameter is there
        return found
    except InputError as error:
        hint = f"{error.hint or ''} An effect of your own: name its file (--effect).".strip()
        raise InputError(
            error.what, file=folder / RESULT, key=error.key, value=error.value, allowed=error.allowed, hint=hint
        ) from None
    except (KeyError, IndexError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        what = f"the fitted model is damaged ({type(error).__name__}: {error})"
        raise RunFolderError(what, file=folder / RESULT, hint="make the run again") from None
