"""The score against figures worked out by hand on invented answers."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path

import pytest
from invented import answer, effect, make, result

from stickslip.blind.answers import read_answer
from stickslip.blind.case_scores import mark, rate
from stickslip.blind.figures import VERDICTS, verdict_label
from stickslip.blind.one_case import record_failure
from stickslip.blind.pictures import amplitude_figure, confusion_by_amplitude_figure, confusion_figure
from stickslip.blind.score import score_challenge
from stickslip.blind.score_text import score_text
from stickslip.blind.seal import RUNS, SealError, read_truth
from stickslip.cli import run
from stickslip.errors import InputError

CASES = {
    "n1": ("nothing", []),
    "n2": ("nothing", []),
    "n3": ("nothing", []),
    "n4": ("nothing", []),
    "a1": ("one", [effect("contact-ageing", 6.0, 1.2e-3)]),
    "a2": ("one", [effect("sensor-drift", 12.0, own=True)]),
    "a3": ("one", [effect("drive-ripple", 1.5)]),
    "a4": ("one", [effect("sensor-low-pass", 7.0)]),
    "a5": ("one", [effect("viscous-drag", 3.0, 2.0, own=True)]),
    "a6": ("one", [effect("tilt", 25.0)]),
    "b1": ("two", [effect("wear", 20.0), effect("inertia", 5.0, 0.05)]),
    "b2": ("two", [effect("adhesion", 8.0), effect("wear", 9.0)]),
    "o1": ("outside", [effect("yaw-mode", 2.0)]),
    "o2": ("outside", [effect("eddy-brake", 4.0)]),
}
RESULTS = {
    "n1": result("complete", base=0.8),
    "n2": result("complete", base=0.9),
    "n3": result("missing", ("wear",), base=2.0, final=1.0),
    "a1": result("missing", ("contact-ageing",), base=4.0, final=1.2, contact_ageing__rate=(1.5e-3, 2e-4)),
    "a2": result("ambiguous", (), ("thermal-creep", "sensor-drift"), base=8.0, final=1.0),
    "a3": result("complete", base=1.1),
    "a4": result("missing", ("residual-load",), base=6.0, final=1.4),
    "a5": result("missing", ("viscous-drag",), base=3.2, final=1.6, viscous_drag__drag=(5e-3, 1e-3)),
    "a6": result("ambiguous", (), ("tilt", "wear", "adhesion", "inertia"), base=9.0, final=1.0),
    "b1": result("missing", ("inertia", "wear"), base=5.0, final=1.1, inertia__share=(0.045, 0.01)),
    "b2": result("missing", ("wear",), base=5.0, final=3.0),
    "o1": result("unknown", base=7.0),
    "o2": result("unknown", ("viscous-drag",), base=7.0, final=4.0),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = make(tmp_path / "challenge", CASES)
    answer(made, RESULTS)
    record_failure(made / RUNS, "n4", ValueError("out of range"), 3.0)
    return made


def of(found: dict) -> tuple[int, int]:
    return found["count"], found["of"]


def test_interval_is_wilsons() -> None:
    z2 = 1.959963984540054**2
    assert rate([True, True])["low"] == pytest.approx(2 / (2 + z2))
    assert rate([True, True])["high"] == pytest.approx(1.0)
    half = math.sqrt(z2 * (0.25 * 0.75 * 8 + z2 / 4)) / (8 + z2)
    middle = (2 + z2 / 2) / (8 + z2)
    found = rate([True] * 2 + [False] * 6)
    assert (found["low"], found["high"]) == pytest.approx((middle - half, middle + half))
    assert rate([]) == {"count": 0, "of": 0, "share": None, "low": None, "high": None}


def test_names_classes_and_alarms(folder: Path) -> None:
    s = score_challenge(folder)
    kinds = s["by_kind"]
    assert [of(kinds["nothing"][k]) for k in ("exact", "right", "class")] == [(2, 4)] * 3
    assert [of(kinds["one"][k]) for k in ("exact", "right", "class")] == [(2, 6), (3, 6), (4, 6)]
    assert [of(kinds["two"][k]) for k in ("exact", "right", "class")] == [(1, 2)] * 3
    assert of(s["effects"]["right"]) == (4, 8)
    # a case that failed raised no alarm, but has not shown that it would not
    assert of(s["false_alarms"]) == (1, 3)
    assert of(s["false_names"]) == (1, 3)
    assert of(s["unknown_recall"]) == (2, 2)
    assert of(s["unknown_without_a_name"]) == (1, 2)
    assert (s["cases"], s["finished"], s["failed"], s["not_run"]) == (14, 13, 1, 0)
    assert s["seed"] == 5


def test_amplitudes_and_calibration(folder: Path) -> None:
    s = score_challenge(folder)
    assert of(s["amplitude"]["all"]) == (2, 3)  # 1.5 of 1.2e-3, 5 of 2e-3, 0.045 of 0.05
    assert of(s["amplitude"]["textbook_form"]) == (2, 2)
    assert of(s["amplitude"]["own_form"]) == (0, 1)
    calibration = s["calibration"]
    assert of(calibration["within_1_std"]) == (1, 3)
    assert of(calibration["within_2_std"]) == (2, 3)
    assert of(calibration["by_verdict"]["complete"]) == (2, 3)
    assert of(calibration["by_verdict"]["missing"]) == (3, 6)
    assert of(calibration["by_verdict"]["ambiguous"]) == (1, 2)
    assert calibration["brier"] is None


def test_by_amplitude_bin(folder: Path) -> None:
    bins = {b["from"]: b for b in score_challenge(folder)["by_amplitude"]}
    assert {low: of(b["right"]) for low, b in bins.items()} == {1: (0, 1), 2: (1, 1), 5: (2, 4), 10: (1, 2)}
    assert {low: of(b["exact"]) for low, b in bins.items()} == {1: (0, 1), 2: (1, 1), 5: (2, 4), 10: (0, 2)}
    assert {low: of(b["unknown_recall"]) for low, b in bins.items()} == {1: (0, 0), 2: (2, 2), 5: (0, 0), 10: (0, 0)}
    assert of(bins[5]["amplitude"]) == (2, 2)
    assert of(bins[2]["amplitude"]) == (0, 1)
    assert of(bins[10]["named_right"]) == (1, 2)


def test_fall_of_the_held_out_error(folder: Path) -> None:
    s = score_challenge(folder)
    one = s["heldout"]["one"]
    assert one["cases"] == 6
    # 1.2/4, 1/8, 1, 1.4/6, 0.5, 1/9
    assert one["ratio"][1] == pytest.approx((1.4 / 6 + 0.3) / 2)
    assert one["base"][1] == pytest.approx(5.0)
    assert of(s["heldout"]["right"]["within"]) == (5, 6)
    ages = next(line for line in s["list"] if line["case"] == "a1")
    assert (ages["heldout_base"], ages["heldout_final"]) == (4.0, 1.2)


def test_confusion_and_aims(folder: Path) -> None:
    s = score_challenge(folder)
    assert s["confusion"]["names"]["nothing"] == {"nothing": 2, "wear": 1, "failed": 1}
    assert s["confusion"]["names"]["sensor-low-pass"] == {"residual-load": 1}
    assert s["confusion"]["names"]["sensor-drift"] == {"set with it": 1}
    assert s["confusion"]["kinds"]["two"] == {"named": 1, "named in part": 1}
    assert s["confusion"]["kinds"]["one"] == {
        "named": 2, "set with it": 1, "set without it": 1, "named wrongly": 1, "complete": 1,
    }  # fmt: skip
    right, alarms, within = s["aims"]
    assert (of(right), right["met"], right["shown"]) == ((3, 6), False, False)
    assert (of(alarms), alarms["met"], alarms["shown"]) == ((1, 3), False, False)
    assert (of(within), within["met"], within["shown"]) == ((5, 6), False, False)


def test_stated_confidence_is_judged(tmp_path: Path) -> None:
    folder = make(tmp_path / "c", {"n1": CASES["n1"], "a1": CASES["a1"], "a3": CASES["a3"]})
    found = {name: {**RESULTS[name], "verdict": dict(RESULTS[name]["verdict"])} for name in ("n1", "a1", "a3")}
    for name, confidence in (("n1", 0.9), ("a1", 0.6), ("a3", 0.95)):
        found[name]["verdict"]["confidence"] = confidence
    answer(folder, found)
    calibration = score_challenge(folder)["calibration"]
    assert calibration["brier"] == pytest.approx((0.1**2 + 0.4**2 + 0.95**2) / 3)
    high = calibration["reliability"][-1]
    assert high["stated"] == pytest.approx(0.925)
    assert of(high["holds"]) == (1, 2)


def test_confusion_and_confidence_by_amplitude(folder: Path) -> None:
    for name, confidence in (("n1", 0.9), ("a1", 0.6), ("a3", 0.95), ("a4", 0.8), ("o1", 0.7)):
        path = folder / RUNS / name / "result.json"
        content = json.loads(path.read_text())
        content["verdict"]["confidence"] = confidence
        path.write_text(json.dumps(content))
    s = score_challenge(folder)
    bins = {b["from"]: b for b in s["by_amplitude"]}
    kinds = {low: {kind: row for kind, row in b["confusion"]["kinds"].items() if row} for low, b in bins.items()}
    assert kinds == {
        1: {"one": {"complete": 1}},
        2: {"one": {"named": 1}, "outside": {"unknown": 2}},
        5: {"one": {"named": 1, "named wrongly": 1}, "two": {"named": 1, "named in part": 1}},
        10: {"one": {"set with it": 1, "set without it": 1}},
    }
    # the bins and what hides nothing are the whole
    for kind, row in s["confusion"]["kinds"].items():
        parts = sum((Counter(b["confusion"]["kinds"][kind]) for b in bins.values()), Counter())
        assert kind == "nothing" or parts == row
    assert bins[5]["confusion"]["names"] == {
        "contact-ageing": {"contact-ageing": 1}, "sensor-low-pass": {"residual-load": 1},
    }  # fmt: skip
    confidence = {low: b["confidence"] for low, b in bins.items()}
    assert {low: c["stated"] for low, c in confidence.items()} == pytest.approx({1: 0.95, 2: 0.7, 5: 0.7, 10: None})
    assert {low: of(c["holds"]) for low, c in confidence.items()} == {1: (0, 1), 2: (1, 1), 5: (1, 2), 10: (0, 0)}
    assert confidence[5]["brier"] == pytest.approx((0.4**2 + 0.8**2) / 2)
    assert of(s["calibration"]["nothing"]["holds"]) == (1, 1)
    assert s["calibration"]["brier"] == pytest.approx((0.1**2 + 0.4**2 + 0.95**2 + 0.8**2 + 0.3**2) / 5)
    text = score_text({**s, "list": []})
    table = text[text.index("Hidden, and answered") :].splitlines()
    columns = table[0].replace("Hidden, and answered", "").split("  ")
    assert [c.strip() for c in columns if c.strip()] == list(VERDICTS)
    assert table[1].split() == ["nothing", "missing", "2", ".", ".", ".", "1", ".", ".", "1", "."]
    assert " ".join(table[4].split()) == "outside the catalogue, 2 to 5 times . . . . . . 2 . ."
    rows = [" ".join(row.split()) for row in table[table.index("") + 1 :]]
    assert rows[0] == "Confidence stated, mean claim correct Brier score"
    assert rows[4].startswith("5 to 10 times detection 70 % 1/2 50 % (")
    assert rows[4].endswith(" 0.400")


def test_pictures_by_amplitude_say_what_the_bins_hold(folder: Path) -> None:
    s = score_challenge(folder)
    made = confusion_by_amplitude_figure(s)
    titles = [axes.get_title(loc) for axes in made.axes for loc in ("left", "center")]
    assert sum("10 to 30 times detection" in title for title in titles) == 2
    for axes, b in zip(made.axes[1::2], s["by_amplitude"], strict=True):
        shown = sum(int(text.get_text()) for text in axes.texts)
        assert shown == sum(sum(row.values()) for row in b["confusion"]["kinds"].values())
    # a bin without cases
    empty = [{**b, "confusion": {"names": {}, "kinds": {}}} for b in s["by_amplitude"]]
    assert all("no case" in "".join(a.get_title(loc) for loc in ("left", "center"))
               for a in confusion_by_amplitude_figure({**s, "by_amplitude": empty}).axes)  # fmt: skip
    assert [a.get_title("left") or a.get_title() for a in amplitude_figure(s).axes][-1] == "Stated confidence: none"


def test_pictures_say_what_their_numbers_are(folder: Path) -> None:
    path = folder / RUNS / "a1" / "result.json"
    content = json.loads(path.read_text())
    content["verdict"]["confidence"] = 0.6
    path.write_text(json.dumps(content))
    s = score_challenge(folder)
    _, fall, confidence = amplitude_figure(s).axes
    assert [text.get_text() for text in confidence.texts] == ["n = 1"]
    assert "1: nothing added, or nothing gained" in fall.get_ylabel()
    rows = [label.get_text() for label in confusion_figure(s).axes[1].get_yticklabels()]
    assert rows == ["nothing missing", "one effect", "two effects", "outside the catalogue"]


def test_classes_are_what_velocities_and_holds_leave_together(tmp_path: Path) -> None:
    said = {
        "c1": ("sensor-drift", "sensor-high-pass"),
        "c2": ("residual-load", "sensor-low-pass"),
        "c3": ("thermal-creep", "sensor-drift"),
        "c4": ("tilt", "viscous-drag"),
    }
    folder = make(tmp_path / "c", {name: ("one", [effect(hidden, 6.0)]) for name, (hidden, _) in said.items()})
    answer(folder, {name: result("missing", (named,)) for name, (_, named) in said.items()})
    assert [line["class_right"] for line in score_challenge(folder)["list"]] == [True, True, False, False]


def test_amplitudes_count_in_the_bin_of_their_own_effect(tmp_path: Path) -> None:
    two = [effect("inertia", 3.0, 0.05), effect("adhesion", 12.0, 0.01)]
    folder = make(tmp_path / "c", {"b1": ("two", two)})
    answer(
        folder,
        {
            "b1": result(
                "missing", ("inertia", "adhesion"), inertia__share=(0.05, 0.01), adhesion__attraction=(0.05, 0.01)
            )
        },
    )
    s = score_challenge(folder)
    bins = {b["from"]: b for b in s["by_amplitude"]}
    assert {low: of(b["amplitude"]) for low, b in bins.items()} == {1: (0, 0), 2: (1, 1), 5: (0, 0), 10: (0, 1)}
    assert {low: of(b["within_2_std"]) for low, b in bins.items()} == {1: (0, 0), 2: (1, 1), 5: (0, 0), 10: (0, 1)}
    assert {low: of(b["right"]) for low, b in bins.items()} == {1: (0, 0), 2: (1, 1), 5: (0, 0), 10: (0, 0)}
    assert [a["multiple"] for a in s["list"][0]["amplitudes"]] == [3.0, 12.0]


def test_an_amplitude_of_another_form_is_not_compared(tmp_path: Path) -> None:
    spring = ("one", [effect("nonlinear-spring", 6.0, 0.02, form="quadratic")])
    folder = make(tmp_path / "c", {"same": spring, "other": spring})
    found = {
        name: result("missing", ("nonlinear-spring",), forms={"inertia": "", "nonlinear-spring": form},
                     nonlinear_spring__curvature=(80.0, 5.0))
        for name, form in (("same", "quadratic"), ("other", "cubic"))
    }  # fmt: skip
    answer(folder, found)
    s = score_challenge(folder)
    assert {line["case"]: len(line["amplitudes"]) for line in s["list"]} == {"same": 1, "other": 0}
    assert of(s["amplitude"]["all"]) == (1, 1)


def test_a_name_that_is_right_in_part_is_not_wrong(tmp_path: Path) -> None:
    one, two = [effect("wear", 6.0)], [effect("wear", 6.0), effect("tilt", 9.0)]
    said = {
        "exact": ("two", two, ("tilt", "wear"), "named"),
        "lacking": ("two", two, ("tilt",), "named in part"),
        "more": ("one", one, ("wear", "tilt"), "named in part"),
        "mixed": ("two", two, ("wear", "inertia"), "named in part"),
        "other": ("two", two, ("inertia",), "named wrongly"),
        "outside": ("outside", [effect("yaw-mode", 6.0)], ("tilt",), "named wrongly"),
    }
    folder = make(tmp_path / "c", {name: (kind, hidden) for name, (kind, hidden, _, _) in said.items()})
    answer(folder, {name: result("missing", named) for name, (_, _, named, _) in said.items()})
    marked = [mark(case, read_answer(folder / RUNS, case["name"])) for case in read_truth(folder)["cases"]]
    assert {m.name: verdict_label(m) for m in marked} == {name: label for name, (*_, label) in said.items()}
    # a name where the catalogue has none counts among the names, as it does among the confidences
    bins = {b["from"]: b for b in score_challenge(folder)["by_amplitude"]}
    assert of(bins[5]["named_right"]) == (1, 6)


def test_a_set_claims_to_hold_the_truth_and_no_more(tmp_path: Path) -> None:
    four = ("wear", "tilt", "inertia", "adhesion")
    cases = {
        "large": ("one", [effect("wear", 6.0)]),
        "beside": ("one", [effect("sensor-gain", 6.0)]),
        "nothing": ("nothing", []),
    }
    folder = make(tmp_path / "c", cases)
    answer(folder, {name: result("ambiguous", (), four, confidence=0.8) for name in cases})
    s = score_challenge(folder)
    assert [line["right"] for line in s["list"]] == [False, False, False]
    assert of(s["calibration"]["reliability"][2]["holds"]) == (1, 3)
    assert s["calibration"]["brier"] == pytest.approx((0.2**2 + 2 * 0.8**2) / 3)
    assert of(s["calibration"]["by_verdict"]["ambiguous"]) == (0, 3)


def test_what_a_name_brings_on_unseen_cycles(folder: Path) -> None:
    bins = {b["from"]: b for b in score_challenge(folder)["by_amplitude"]}
    # a1, a4, b1 and b2 from 5 to 10; of them a1 and b1 are right, both within 1.5
    assert bins[5]["heldout_named"]["cases"] == 4
    assert bins[5]["heldout_named"]["ratio"][1] == pytest.approx((1.4 / 6 + 0.3) / 2)
    assert of(bins[5]["heldout_right"]) == (2, 2)
    # a5 is right, and its last model is at 1.6
    assert of(bins[2]["heldout_right"]) == (0, 1)
    # a3 names nothing
    assert (bins[1]["heldout"]["cases"], bins[1]["heldout_named"]["cases"]) == (1, 0)


def test_by_circumstance_and_by_form(tmp_path: Path) -> None:
    known = {"spring_known": True, "virgin": False, "new_lines": True}
    other = {"spring_known": False, "virgin": False, "new_lines": True}
    names = ("n1", "n2", "n3", "a1", "a2", "a3", "a5")
    folder = make(
        tmp_path / "c",
        {name: CASES[name] for name in names},
        {"n1": known, "n3": known, "n2": other, "a1": known, "a2": known, "a3": other},
    )
    answer(folder, {name: RESULTS[name] for name in names})
    s = score_challenge(folder)
    spring = s["by_circumstance"]["spring_known"]
    assert [of(spring["yes"][k]) for k in ("exact", "right", "false_alarms")] == [(1, 2), (2, 2), (1, 2)]
    assert [of(spring["no"][k]) for k in ("exact", "right", "false_alarms")] == [(0, 1), (0, 1), (0, 1)]
    assert of(s["by_circumstance"]["virgin"]["yes"]["right"]) == (0, 0)
    assert of(s["by_circumstance"]["new_lines"]["yes"]["right"]) == (2, 3)
    # a1 and a3 have the textbook's form, a2 and a5 an own one
    assert [of(s["by_form"][k]["exact"]) for k in ("textbook_form", "own_form")] == [(1, 2), (1, 2)]
    assert [of(s["by_form"][k]["right"]) for k in ("textbook_form", "own_form")] == [(1, 2), (2, 2)]
    rows = {" ".join(line.split("  ")[0].split()): line for line in score_text(s).splitlines()}
    assert rows["spring not known"].split()[3:5] == ["0/1", "0"]
    assert rows["contact never loaded before"].split()[4:] == ["-", "-", "-"]
    assert rows["the same lines at every event"].split()[6:] == ["-", "-", "-"]


def test_an_aim_is_shown_where_the_whole_interval_meets_it(tmp_path: Path) -> None:
    for number, words in ((5, "met, not shown"), (80, "met")):
        cases = {f"n{i:02d}": CASES["n1"] for i in range(number)}
        folder = make(tmp_path / f"c{number}", cases)
        answer(folder, dict.fromkeys(cases, RESULTS["n1"]))
        s = score_challenge(folder)
        right, alarms, within = s["aims"]
        assert (right["met"], right["shown"]) == (None, None)
        assert (alarms["met"], alarms["shown"]) == (True, number == 80)
        # no number of cases shows that all of them do
        assert (within["met"], within["shown"]) == (True, False)
        text = score_text(s)
        assert f"aim {words}: false alarms" in text
        assert "aim met, not shown: held-out" in text
        assert "aim no case: right" in text


def test_a_set_of_four_says_too_much_for_two_effects_as_well(tmp_path: Path) -> None:
    two = [effect("wear", 20.0), effect("tilt", 9.0)]
    folder = make(tmp_path / "c", {"b1": ("two", two), "b2": ("two", two), "b3": ("two", two)})
    answer(
        folder,
        {
            "b1": result("ambiguous", ("wear",), ("wear", "tilt", "inertia")),
            "b2": result("ambiguous", ("wear",), ("wear", "tilt", "inertia", "adhesion")),
            "b3": result("ambiguous", ("wear",), ("wear", "inertia")),
        },
    )
    assert [line["right"] for line in score_challenge(folder)["list"]] == [True, False, False]


@pytest.mark.slow
def test_what_was_not_run_or_is_damaged_counts_as_wrong(folder: Path) -> None:
    before = score_challenge(folder)
    (folder / RUNS / "a1" / "result.json").unlink()
    (folder / RUNS / "a5" / "result.json").write_text("{")
    after = score_challenge(folder)
    assert after["cases"] == before["cases"]
    assert (after["not_run"], after["failed"]) == (1, 2)
    assert of(after["by_kind"]["one"]["right"]) == (1, 6)
    assert run(["challenge", "score", str(folder)]) == 3


@pytest.mark.slow
def test_command_writes_text_json_and_pictures(folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert run(["challenge", "score", str(folder)]) == 0
    text = capsys.readouterr().out
    found = json.loads((folder / "score" / "score.json").read_text())
    assert found == json.loads(json.dumps(score_challenge(folder)))
    assert text == (folder / "score" / "score.txt").read_text() == score_text(found)
    assert "aim MISSED" in text
    assert "n4" in text
    assert "ValueError: out of range" in text
    assert max(map(len, text.splitlines())) <= 150
    for name in ("confusion.png", "confusion-by-amplitude.png", "amplitude.png"):
        assert (folder / "score" / name).read_bytes().startswith(b"\x89PNG")
    assert run(["challenge", "score", str(folder)]) == 2
    assert "a score already" in capsys.readouterr().err
    assert run(["challenge", "score", str(folder), "--json", "--force"]) == 0
    assert json.loads(capsys.readouterr().out) == found
    assert sorted(p.name for p in folder.glob("*score*")) == ["score"]
    # what is not the program's is not replaced, not even with --force
    (folder / "score" / "notes.txt").write_text("mine")
    assert run(["challenge", "score", str(folder), "--force"]) == 2
    assert "something else" in capsys.readouterr().err
    assert (folder / "score" / "notes.txt").read_text() == "mine"


@pytest.mark.slow
def test_a_score_that_does_not_fit_leaves_nothing(
    folder: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = Path.replace

    def full(self: Path, target: Path) -> Path:
        if Path(target).suffix == ".png":
            raise OSError(28, "No space left on device", str(self))
        return real(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        assert run(["challenge", "score", str(folder)]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert not list(folder.glob("*score*"))
    assert run(["challenge", "score", str(folder)]) == 0


def test_results_of_other_files_are_refused(folder: Path) -> None:
    path = folder / RUNS / "a1" / "result.json"
    content = json.loads(path.read_text())
    content["inputs"][0]["sha256"] = "0" * 64
    path.write_text(json.dumps(content))
    with pytest.raises(SealError, match="other files"):
        score_challenge(folder)
    for inputs in ([], json.loads((folder / RUNS / "a2" / "result.json").read_text())["inputs"]):
        path.write_text(json.dumps({**content, "inputs": inputs}))
        with pytest.raises(SealError, match="other files"):
            score_challenge(folder)


def test_a_result_of_a_part_of_the_files_is_refused(folder: Path) -> None:
    path = folder / RUNS / "a1" / "result.json"
    content = json.loads(path.read_text())
    assert len(content["inputs"]) == 2
    content["inputs"].pop()
    path.write_text(json.dumps(content))
    with pytest.raises(SealError, match="other files"):
        score_challenge(folder)


def test_nothing_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing was run"):
        score_challenge(make(tmp_path / "c", CASES))
