"""What a verdict does not say: how far it may be believed, and what to do before acting on it."""

from __future__ import annotations

from collections.abc import Sequence

from ..effects import catalogue
from ..units import shown
from .engine import Diagnosis
from .thresholds import THRESHOLDS, Thresholds
from .verdict import contains, decide, unseen

TRIED = (
    "Effects were tried, and none explains the little that is left (see the candidates). One that acts otherwise than "
    "the catalogue has it, or that the base can imitate, is not excluded."
)


def cautions(d: Diagnosis, asked: Sequence[str] = (), limits: Thresholds = THRESHOLDS) -> list[str]:
    """Sentences to stand beside the verdict.

    Args:
        d: what was found.
        asked: tags the user wanted tried.
        limits: that the verdict rests on.
    """
    out = []
    if d.verdict.kind == "complete":
        out.append(TRIED if d.rounds else _complete(asked, limits))
    if d.verdict.kind == "missing":
        out.append(
            "A name is a suspicion, not a finding: that the cause is in the catalogue at all, and in the form tried, "
            "is taken for granted by the confidence and cannot be told from these data. In blind tests on foreign data "
            "names were often wrong (documentation, 'The blind challenge')."
        )
        out += _unusual(d)
        out += [line for tag in d.verdict.effects for line in _cheaper(tag, d, limits)]
        out += [line for tag in d.verdict.effects for line in _checks(tag)]
    return out


def _complete(asked: Sequence[str], limits: Thresholds) -> str:
    which = ", ".join(f"{phase} {most:g}" for phase, most in limits.complete.items())
    tried = f"The candidates {', '.join(asked)} were" if asked else "No effect of the catalogue was"
    return (
        f"{tried} {'not ' if asked else ''}tried, because the base model stays within its limits in every phase, on "
        f"fitted and on unseen cycles (floors: {which}). An effect that changes the features by less, or as friction, "
        "weakening, damping and roughness of the base can, is not excluded. To look for one that you suspect: "
        f"stickslip fit CAMPAIGN --add {asked[0] if asked else 'contact-ageing'}."
    )


def _unusual(d: Diagnosis) -> list[str]:
    """Values of named effects that are possible in the model and hardly in a machine."""
    last = d.ladder[-1]
    if last.fit is None:
        return []
    std = last.fit.std()
    return [
        f"{f.name} is {shown(last.fit.values[f.name], f.unit)}, {found}: something else may have been put into it, "
        "or the effect is not what is missing."
        for f in last.fit.free
        if f.name.split(".")[0] in d.verdict.effects and (found := f.unusual(last.fit.values[f.name], std[f.name]))
    ]


def _cheaper(tag: str, d: Diagnosis, limits: Thresholds) -> list[str]:
    """Effects that describe the fitted cycles better than one that is named, and the unseen ones worse."""
    for done in d.rounds:
        best, _ = decide(done.judged, limits)
        if best is not None and best.candidate.tag == tag:
            break
    else:
        return []
    cheaper = [j for j in done.judged if j.plausible and j.cost < best.cost and unseen(j) > unseen(best)]
    cheaper = [j for j in cheaper if j.candidate.tag not in d.verdict.effects and not contains(j, best)]
    if not cheaper:
        return []
    several = ", ".join(f"{j.candidate.tag} ({j.cost:.0f})" for j in sorted(cheaper, key=lambda j: j.cost))
    return [
        f"{tag} is named with a cost of {best.cost:.0f}. The fitted cycles are described better by {several}, the "
        "unseen ones worse; the confidence counts the fitted cycles alone."
    ]


def _checks(tag: str) -> list[str]:
    """What an effect may be taken for, and the experiments that separate the two."""
    found = catalogue.alike(tag)
    return [f"{tag} may be taken for {other}; to separate them: {what}." for other, what in found.items()]
