"""Two runs side by side: models, verdicts, errors by phase, parameters and their differences, and their picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import RunFolderError
from ...inference.features.layout import PHASES
from ...inference.fit.serialised import KEY, shared
from ...system.runstore import RESULT, read_result
from ..plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, plain, remark, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = 12.0  # standard deviations; beyond it a bar is cut and its number says how far it goes
MOST = 3.0  # standard deviations from which two values count as different


def comparison(first: str | Path, second: str | Path) -> dict[str, Any]:
    """Compare two run folders of ``diagnose`` or ``fit --model inertial``.

    Returns:
        ``runs`` (folder, title, kind, model, verdict, train_error, heldout_error of each), ``ladders``, ``errors`` (one
        row a phase: train and held-out error of both), ``parameters`` (one row each: values and standard deviations of
        both, the difference, and that in standard deviations) and ``notes``. What a run does not have is None.

    Raises:
        RunFolderError: a folder is no run folder, is damaged, or holds no model that was compared with data.
    """
    folders = [Path(first), Path(second)]
    results = [_with_ladder(folder) for folder in folders]
    try:
        return {
            "runs": [_head(f, r) for f, r in zip(folders, results, strict=True)],
            "ladders": [r["ladder"] for r in results],
            "errors": _errors(*(r["ladder"][-1] for r in results)),
            "parameters": _parameters(*results),
            "notes": _notes(*results),
        }
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        where = " or ".join(str(f / RESULT) for f in folders)
        raise RunFolderError(
            f"the result does not have the form of a stickslip result ({type(error).__name__}: {error})", file=where
        ) from None


def _with_ladder(folder: Path) -> dict[str, Any]:
    result = read_result(folder)
    if not result.get("ladder"):
        kind = result.get("kind", "this")
        what = "no model was compared with data in this run"
        if kind == "fit":
            what = "the static model's fits have no errors by phase"
        raise RunFolderError(
            f"{what} (it is a run of {kind!r})",
            file=folder / RESULT,
            hint="compare runs of stickslip diagnose, or of stickslip fit --model inertial",
        )
    return result


def _head(folder: Path, result: Mapping[str, Any]) -> dict[str, Any]:
    verdict, last = result.get("verdict"), result["ladder"][-1]
    known = verdict if isinstance(verdict, Mapping) else {}
    return {
        "folder": str(folder),
        "title": result.get("title", ""),
        "kind": result.get("kind") or ("diagnose" if known else "run"),
        "model": list(last["model"]),
        "verdict": known.get("kind"),
        "effects": list(known.get("effects") or ()),
        "text": known.get("text", ""),
        "train_error": last["train_error"],
        "heldout_error": last.get("heldout_error"),
    }


def _errors(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One row for every phase that any of the two last models was compared in, and one for all together."""
    tables = [[step.get(key) or {} for key in ("by_phase", "heldout_by_phase")] for step in (a, b)]
    seen = {phase for pair in tables for table in pair for phase in table}
    ordered = [p for p in PHASES if p in seen] + sorted(seen - set(PHASES))
    rows = [
        {"phase": p, "train": [t[0].get(p) for t in tables], "heldout": [t[1].get(p) for t in tables]} for p in ordered
    ]
    whole = {key: [step.get(f"{key}_error") for step in (a, b)] for key in ("train", "heldout")}
    return [*rows, {"phase": "all", **whole}]


def _parameters(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[dict[str, Any]]:
    known = [_values(r) for r in (a, b)]
    rows = []
    for name in [*known[0], *(n for n in known[1] if n not in known[0])]:
        pair = [k.get(name) for k in known]
        there = [p for p in pair if p is not None]
        both = [p["value"] for p in there if p["value"] is not None]
        values = [None if p is None else p["value"] for p in pair]
        std = [None if p is None else p["std"] for p in pair]
        rows.append(
            {
                "name": name,
                "unit": there[0]["unit"],
                "doc": there[0]["doc"],
                "value": values,
                "std": std,
                "difference": both[1] - both[0] if len(both) == 2 else None,
                "deviations": _deviations(*there) if len(there) == 2 else None,
            }
        )
    return rows


def _values(result: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Fitted parameters, then those that were given (standard deviation zero)."""
    section = result.get(KEY) or {}
    scales = {f["name"]: f["scale"] for f in section.get("free", ())}
    out = {
        name: {
            "value": p["value"],
            "std": p.get("std"),
            "unit": p.get("unit") or "1",
            "doc": p.get("doc", ""),
            "log": scales.get(name) == "log",
        }
        for name, p in (result.get("parameters") or {}).items()
        if shared(name)
    }
    given = {**section.get("fixed", {}), **({"rig.mass": section["mass"]} if "mass" in section else {})}
    units = {"rig.spring_stiffness": "N/m", "rig.mass": "kg"}
    for name, value in given.items():
        out.setdefault(name, {"value": value, "std": 0.0, "unit": units.get(name, "1"), "doc": "", "log": False})
    return out


def _deviations(a: Mapping[str, Any], b: Mapping[str, Any]) -> float | None:
    """Second less first, in standard deviations of the difference if the two were independent.

    What was sought as a logarithm is compared as one: 1 um +- 1 um is then within a factor of e, and never negative.
    """
    values, errors = (a["value"], b["value"]), (a["std"], b["std"])
    if None in values or None in errors:
        return None
    if a["log"] and b["log"] and min(values) > 0:
        errors = tuple(e / v for e, v in zip(errors, values, strict=True))
        gap = math.log(values[1] / values[0])
    else:
        gap = values[1] - values[0]
    error = math.hypot(*errors)
    if error == 0.0:
        return 0.0 if math.isclose(values[0], values[1], rel_tol=1e-9) else None
    return gap / error


def _notes(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[str]:
    notes = []
    # the campaign file may be written anew; the measurements decide
    prints = [
        {i.get("sha256") for i in r.get("inputs") or () if not str(i.get("file")).endswith(".toml")} for r in (a, b)
    ]
    if prints[0] != prints[1]:
        notes.append("the runs were made from different measurements, so their errors cannot be compared directly")
    else:
        notes.append(
            "both runs saw the same measurements: deviations in the table, which take the two as independent, are too "
            "small where the data decide a parameter"
        )
    if "held_out" in a and "held_out" in b and a["held_out"] != b["held_out"]:
        notes.append("different cycles were held out")
    return notes


@styled
def comparison_figure(found: Mapping[str, Any]) -> Figure:
    """Errors by phase of both runs (left), differences of their parameters in standard deviations (right)."""
    rows = [r for r in found["parameters"] if r["deviations"] is not None and any(r["std"])]
    made, axes = figure(1, 2, width=11.0, height=max(3.8, 1.4 + 0.28 * len(rows)))
    _draw_errors(axes[0, 0], found)
    if rows:
        _draw_deviations(axes[0, 1], rows)
    else:
        remark(axes[0, 1], "no parameter that both fits determine")
    return made


def _draw_errors(ax: Any, found: Mapping[str, Any]) -> None:
    rows = found["errors"]
    x = np.arange(len(rows))
    for k, (run, colour) in enumerate(zip(found["runs"], (DARK, MIDDLE), strict=True)):
        name = plain(f"{k + 1}: {' + '.join(run['model'][2:]) or run['model'][-1]}", 40)
        for key, share, text in (("train", 1.0, "fitted"), ("heldout", 0.45, "unseen")):
            y = np.array([np.nan if r[key][k] is None else r[key][k] for r in rows], float)
            if np.isfinite(y).any():
                place = x + (k - 0.5) * 0.4 + (0.0 if key == "train" else 0.18) - 0.09
                ax.bar(place, y, 0.17, color=colour, alpha=share, label=f"{name}, {text}")
    ax.axhline(1.0, color=LIGHT, ls=":", lw=1.2)
    logarithmic(ax, "y")
    ax.set_xticks(x, [plain(r["phase"], 30) for r in rows], rotation=20, ha="right")
    ax.set_ylabel("residual / floor")
    ax.legend(fontsize=8)


def _draw_deviations(ax: Any, rows: list[Mapping[str, Any]]) -> None:
    far = np.array([r["deviations"] for r in rows], float)
    y = np.arange(len(rows))[::-1]
    ax.barh(y, np.clip(far, -_SHOWN, _SHOWN), color=[MIDDLE if abs(d) > MOST else DARK for d in far])
    for at, d in zip(y, far, strict=True):
        if abs(d) > _SHOWN:
            ax.text(np.sign(d) * 0.95 * _SHOWN, at, f"{d:.3g}", ha="right" if d > 0 else "left", va="center", color="w")
    ax.axvspan(-1.0, 1.0, color=LIGHT, alpha=0.25, lw=0, zorder=0)
    ax.axvline(0.0, color=DARK, lw=0.8)
    ax.set_yticks(y, [plain(r["name"], 34) for r in rows])
    ax.set_xlim(-1.05 * _SHOWN, 1.05 * _SHOWN)
    ax.set_xlabel("second less first, in standard deviations")
