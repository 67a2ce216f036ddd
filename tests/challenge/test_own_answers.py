"""Answers of other methods: scored as those of a run with the same content, and refused in words."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from invented import answer, effect, make
from test_challenge_score import CASES, RESULTS, of

from stickslip.blind.figures import _heldout
from stickslip.blind.own_answers import NOT_GIVEN, read_answers
from stickslip.blind.score import score_challenge
from stickslip.blind.score_text import score_text
from stickslip.blind.seal import SealError
from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.physics.effects import catalogue

STATED = (
    "heldout",
    "heldout_base",
    "heldout_final",
    "heldout_named",
    "heldout_right",
    "seconds",
    "protocol",
    "answers",
)


def said(result: dict[str, Any]) -> dict[str, Any]:
    """What a result of a run says, as an answer of one's own."""
    verdict = result["verdict"]
    kept = {"kind": verdict["kind"], "effects": verdict["effects"], "text": verdict["text"]}
    if verdict["kind"] != "complete":
        kept["set"] = verdict["set"]
    sizes = {name.split(".")[0]: found for name, found in result["parameters"].items()}
    return {**kept, "amplitude": {tag: {"value": x["value"], "std": x["std"]} for tag, x in sizes.items()}}


def without_errors(found: Any) -> Any:
    """A score without what only fitted models have."""
    if isinstance(found, dict):
        return {k: without_errors(v) for k, v in found.items() if k not in STATED and k != "aims"}
    return [without_errors(v) for v in found] if isinstance(found, list) else found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Sealed, and never run."""
    return make(tmp_path / "challenge", CASES)


def test_the_same_answers_have_the_score_of_a_run(folder: Path, tmp_path: Path) -> None:
    ran = make(tmp_path / "ran", CASES)
    answer(ran, RESULTS)
    own = score_challenge(folder, answers={name: said(found) for name, found in RESULTS.items()})
    expected = score_challenge(ran)
    for line in (*own["list"], *expected["list"]):
        if line["answer"] == "not run":  # the words for it are others
            line["text"] = ""
    assert without_errors(own) == without_errors({**expected, "seal": own["seal"]})
    assert own["not_run"] == 1 and of(own["amplitude"]["all"]) == (2, 3)
    # no errors are stated, so none are missed
    assert [aim["share"] for aim in own["aims"]] == [*(aim["share"] for aim in expected["aims"][:2]), None]
    assert own["heldout"]["right"]["within"]["of"] == 0


def test_a_file_is_read_in_either_format(folder: Path, tmp_path: Path) -> None:
    given = {
        "a5": {"kind": "missing", "effects": ["viscous-drag"], "amplitude": {"viscous-drag": {"value": "5 mN"}}},
        "a2": {"kind": "ambiguous", "set": ["thermal-creep", "sensor-drift"], "confidence": 0.6},
        "n1": {"kind": "complete"},
    }
    (tmp_path / "mine.json").write_text(json.dumps(given))
    (tmp_path / "mine.toml").write_text(
        '[n1]\nkind = "complete"\n[a2]\nkind = "ambiguous"\nset = ["thermal-creep", "sensor-drift"]\nconfidence = 0.6\n'
        '[a5]\nkind = "missing"\neffects = ["viscous-drag"]\namplitude.viscous-drag = { value = "5 mN" }\n'
    )
    cases = sorted(CASES)
    found = read_answers(given, cases)
    assert read_answers(tmp_path / "mine.json", cases) == found == read_answers(str(tmp_path / "mine.toml"), cases)
    assert found["a5"].parameters["viscous-drag.drag"] == {"value": 0.005, "std": None, "unit": "N"}
    assert all(found[name] is NOT_GIVEN for name in cases if name not in given)
    s = score_challenge(folder, answers=given)
    assert (s["finished"], s["not_run"], of(s["by_kind"]["one"]["right"])) == (3, 11, (2, 6))


def test_the_form_of_a_law_is_that_of_the_catalogue_unless_it_is_said(tmp_path: Path) -> None:
    spring = effect("nonlinear-spring", 6.0, 0.02, form="cubic")
    folder = make(tmp_path / "c", {name: ("one", [spring]) for name in ("usual", "said")})
    own = {
        name: {"kind": "missing", "effects": ["nonlinear-spring"],
               "amplitude": {"nonlinear-spring": {"value": 32.0, **form}}}
        for name, form in (("usual", {}), ("said", {"form": "cubic"}))
    }  # fmt: skip
    lines = {line["case"]: line for line in score_challenge(folder, answers=own)["list"]}
    assert next(catalogue.forms(catalogue.get("nonlinear-spring"))) == {"form": "quadratic"}
    assert lines["usual"]["amplitudes"] == [] and len(lines["said"]["amplitudes"]) == 1


DRAG = '[a1]\nkind = "missing"\neffects = ["viscous-drag"]\namplitude.'
REFUSED = {
    "a case": ('[a9]\nkind = "complete"', "line 1: a9: unknown key 'a9'", "did you mean 'a"),
    "a kind": ('[a1]\nkind = "none"', "line 2: a1.kind", "'complete', 'missing', 'ambiguous' or 'unknown'"),
    "an effect": ('[a1]\nkind = "missing"\neffects = ["wera"]', "line 3: a1.effects[1]", "did you mean 'wear'"),
    "of a set": ('[a1]\nkind = "ambiguous"\nset = ["tilt", "wera"]', "line 3: a1.set[2]", "did you mean 'wear'"),
    "a key": ('[a1]\nkind = "complete"\nsure = 1', "unknown key 'sure'", "did you mean 'set'"),
    "no kind": ("[a1]\neffects = []", "the key 'kind' is missing", "add it"),
    "no effect": ('[a1]\nkind = "missing"', "'missing' needs the effects", "effects = ["),
    "no set": ('[a1]\nkind = "ambiguous"', "'ambiguous' needs the effects", "set = ["),
    "too much": ('[a1]\nkind = "complete"\nset = ["tilt"]', "nothing is missing", "leave"),
    "a confidence": ('[a1]\nkind = "complete"\nconfidence = 80', "a1.confidence", "less than or equal to 1"),
    "a unit": (
        DRAG + 'viscous-drag = { value = "5 m" }',
        "amplitude.viscous-drag.value: the unit 'm' is not one of N",
        "in N",
    ),
    "a deviation": (
        DRAG + "viscous-drag = { value = 5, std = -1 }",
        "amplitude.viscous-drag.std: out of range",
        "0 N or more",
    ),
    "a form": (
        DRAG + 'viscous-drag = { value = 5, form = "cubic" }',
        "amplitude.viscous-drag.form: no such form",
        "has no forms",
    ),
    "what is not named": (DRAG + "tilt = { value = 0.1 }", "the amplitude of 'tilt', which is not named", "add it"),
    "no size": (DRAG + "viscous-drag = { value = true }", "no amplitude (got True)", "5 mN"),
    "a word": ('a1 = "complete"', "the answer to each case is a table", "kind"),
    "no TOML": ("a1 complete", "not valid TOML", "line 1"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_an_answer_is_told(folder: Path, tmp_path: Path, case: str) -> None:
    text, *words = REFUSED[case]
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        score_challenge(folder, answers=path)
    assert str(caught.value).startswith(str(path))
    assert all(word in str(caught.value) for word in words)


def test_a_single_effect_needs_no_list_and_what_is_no_mapping_is_refused(folder: Path) -> None:
    one, several = (
        score_challenge(folder, answers={"b1": {"kind": "missing", "effects": e}}) for e in ("wear", ["wear"])
    )
    assert one["by_effect"] == several["by_effect"]
    with pytest.raises(InputError, match="a file, or a mapping of mappings"):
        score_challenge(folder, answers=[("b1", {"kind": "complete"})])  # type: ignore[arg-type]


def test_the_seal_is_checked_as_for_a_run(folder: Path) -> None:
    with pytest.raises(SealError, match="not the seal that was published"):
        score_challenge(folder, answers={}, expected="0" * 64)
    (folder / "cases" / "a1" / "v100.csv").write_text("other")
    with pytest.raises(SealError, match="was changed"):
        score_challenge(folder, answers={})


def test_precision_and_recall_as_counted_by_hand(folder: Path) -> None:
    answer(folder, RESULTS)
    s = score_challenge(folder)
    rows = {name: (of(row["precision"]), of(row["recall"])) for name, row in s["by_effect"].items()}
    # wear: named in n3 (nothing hidden), b1 and b2; hidden in b1 and b2
    assert rows["wear"] == ((2, 3), (2, 2))
    assert rows["residual-load"] == ((0, 1), (0, 0))  # named in a4
    assert rows["sensor-drift"] == ((0, 0), (0, 1))  # only within a set
    assert rows["viscous-drag"] == ((1, 1), (1, 1))  # what is named on the way to an 'unknown' (o2) is not claimed
    assert rows["all effects"] == ((5, 7), (5, 10))
    assert rows["nothing missing"] == ((2, 3), (2, 4)) and rows["outside the catalogue"] == ((2, 2), (2, 2))
    hidden = {e["tag"] for kind, effects in CASES.values() if kind != "outside" for e in effects}
    assert rows.keys() == hidden | {"residual-load", "all effects", "nothing missing", "outside the catalogue"}
    parts = [row for name, row in rows.items() if " " not in name]
    assert tuple(map(sum, zip(*(row[1] for row in parts), strict=True))) == rows["all effects"][1]
    (line,) = [line.split() for line in score_text(s).splitlines() if line.startswith("wear ")]
    assert line == ["wear", "2/3", "67", "%", "(21-94)", "2/2", "100", "%", "(34-100)", "2"]


def test_a_name_where_the_catalogue_has_none_costs_precision(folder: Path) -> None:
    s = score_challenge(folder, answers={"o1": {"kind": "missing", "effects": ["measured-load"]}})
    assert of(s["by_effect"]["measured-load"]["precision"]) == (0, 1)
    assert of(s["by_effect"]["all effects"]["precision"]) == (0, 1)


@pytest.mark.slow
def test_the_command_keeps_the_score_of_a_file_apart(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('[n1]\nkind = "complete"\n')
    assert run(["challenge", "score", str(folder), "--answers", str(path)]) == 3
    text = capsys.readouterr().out
    assert "1 answered, 13 not (these count as wrong)" in text and str(path) in text
    assert sorted(p.name for p in folder.glob("score*")) == ["score-mine"]
    found = json.loads((folder / "score-mine" / "score.json").read_text())
    assert found["answers"]["file"] == str(path) and "protocol" not in found
    assert run(["challenge", "score", str(folder), "--answers", str(tmp_path / "other.toml")]) == 2
    assert "the answers cannot be read" in capsys.readouterr().err


def test_cases_of_a_run_that_were_not_answered_are_not_as_good_as_the_noise_and_another_method_is_not_judged() -> None:
    silent = SimpleNamespace(fall=None, answered=False, answer=SimpleNamespace(base=None, final=None))
    other = SimpleNamespace(fall=None, answered=True, answer=SimpleNamespace(base=None, final=None))
    good = SimpleNamespace(fall=3.0, answered=True, answer=SimpleNamespace(base=3.0, final=1.0))
    counted = [of(_heldout(cases)["within"]) for cases in ([silent], [silent, good], [other], [other, silent])]
    assert counted == [(0, 1), (1, 2), (0, 0), (0, 0)]
