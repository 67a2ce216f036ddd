"""Making a challenge: the mix, circumstances and amplitudes as promised, the same for the same seed, sealed."""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from visibility import SEEN, Reference

from stickslip.blind.case_plan import Case, counts, plan
from stickslip.blind.detection import DETECTION, detection, largest_multiple
from stickslip.blind.generator import CATALOGUED, EFFECTS, OUTSIDE
from stickslip.blind.make import make_challenge
from stickslip.blind.seal import CASES, TRUTH, check_seal, digest
from stickslip.cli import run
from stickslip.errors import ArgumentError, InputError, RunFolderError, StickslipError


def test_mix_of_kinds() -> None:
    assert counts(100) == {"nothing": 30, "one": 45, "two": 15, "outside": 10}
    assert counts(60) == {"nothing": 18, "one": 27, "two": 9, "outside": 6}
    for cases in range(1, 40):
        assert sum(counts(cases).values()) == cases
    assert Counter(case.kind for case in plan(100, 3)) == counts(100)


def test_plan_is_fixed_by_its_seed() -> None:
    assert plan(40, 7) == plan(40, 7)
    assert plan(40, 7) != plan(40, 8)
    assert len({case.seed for case in plan(100, 7)}) == 100


def test_every_circumstance_holds_in_half_of_the_cases_and_of_each_kind() -> None:
    cases = plan(100, 2)
    for name in ("spring_known", "virgin", "new_lines"):
        assert sum(getattr(case, name) for case in cases) == 50
        for kind, number in counts(100).items():
            found = sum(getattr(case, name) for case in cases if case.kind == kind)
            assert abs(found - number / 2) <= 1.5
    # and the three do not go together
    assert len({(case.spring_known, case.virgin, case.new_lines) for case in cases}) == 8


def test_recorders_are_a_minority_and_say_nothing_of_what_is_hidden() -> None:
    cases = plan(100, 2)
    assert Counter(case.recorder for case in cases) == {"plain": 70, "wrap": 10, "cleared": 10, "drop-outs": 10}
    for kind, number in counts(100).items():
        found = sum(case.recorder != "plain" for case in cases if case.kind == kind)
        assert abs(found - 0.3 * number) <= 3
    assert [case.recorder for case in cases] != [case.recorder for case in plan(100, 3)]


def test_kinds_do_not_follow_the_numbers() -> None:
    cases = plan(100, 1)
    numbers = [int(case.name.split("-")[1]) for case in cases]
    assert numbers == list(range(1, 101))
    nothing = [n for n, case in zip(numbers, cases, strict=True) if case.kind == "nothing"]
    assert 25 < np.mean(nothing) < 75
    assert max(nothing) > 80


def test_effects_are_dealt_evenly_and_fit_their_kind() -> None:
    cases = plan(100, 4)
    one = Counter(case.hidden[0].tag for case in cases if case.kind == "one")
    known = [tag for tag in CATALOGUED if not EFFECTS[tag].decoy]
    assert set(one) == set(known)
    assert max(one.values()) - min(one.values()) <= 1
    for case in cases:
        tags = [hidden.tag for hidden in case.hidden]
        assert len(set(tags)) == len(tags) == {"nothing": 0, "two": 2}.get(case.kind, 1)
        assert all((tag in OUTSIDE) == (case.kind == "outside") for tag in tags)


def test_a_third_of_the_forms_at_least_is_no_textbook_form() -> None:
    hidden = [h for case in plan(100, 5) if case.kind in ("one", "two") for h in case.hidden]
    own = [next(f.own for f in EFFECTS[h.tag].forms if f.name == h.form) for h in hidden]
    assert np.mean(own) > 1 / 3
    assert not all(own)


def test_amplitudes_are_log_uniform_over_the_multiples_of_detection() -> None:
    hidden = [h for seed in range(12) for case in plan(100, seed) for h in case.hidden]
    shares = []
    for h in hidden:
        effect = EFFECTS[h.tag]
        top = largest_multiple(effect, h.form)
        assert 1.0 <= h.multiple <= top <= 30.0
        assert abs(h.amplitude) == pytest.approx(h.multiple * detection(effect, h.form))
        assert abs(h.amplitude) <= effect.high * (1 + 1e-12)
        if not effect.signed:
            assert np.sign(h.amplitude) == effect.sign
        shares.append(np.log(h.multiple) / np.log(top))
    # uniform: the quantiles within four standard errors
    for q in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert np.quantile(shares, q) == pytest.approx(q, abs=4 * np.sqrt(q * (1 - q) / len(shares)))
    signed = [h.amplitude > 0 for h in hidden if EFFECTS[h.tag].signed]
    assert 0.3 < np.mean(signed) < 0.7


def test_every_effect_has_a_detection_and_what_is_dealt_can_be_seen() -> None:
    assert {tag: set(forms) for tag, forms in DETECTION.items()} == {
        tag: {form.name for form in effect.forms} for tag, effect in EFFECTS.items()
    }
    assert all(0 < limit < np.inf for forms in DETECTION.values() for limit in forms.values())
    dealt = {(hidden.tag, hidden.form) for seed in range(6) for case in plan(100, seed) for hidden in case.hidden}
    assert all(detection(EFFECTS[tag], form) <= EFFECTS[tag].high for tag, form in dealt)


@pytest.mark.long
def test_detection_is_what_five_standard_deviations_need() -> None:
    rig = Reference(1)
    limit = rig.limit("contact-ageing", EFFECTS["contact-ageing"].forms[0].name)
    assert limit is not None
    # twice the amplitude moves the features twice as far
    form = EFFECTS["contact-ageing"].forms[0].name
    assert rig.moved("contact-ageing", form, 2 * limit) == pytest.approx(2 * SEEN, rel=0.3)
    # what another rig does by itself is no effect: it is hidden entirely
    assert rig.hidden({"mu_s": 0.002, "damping": 0.01}) < 0.2 * SEEN


def test_runs_of_a_case() -> None:
    for case in plan(40, 1):
        runs = case.runs()
        assert len(case.velocities) >= 3
        assert max(case.velocities) / min(case.velocities) >= 4
        *steady, holds = runs
        assert [run.velocity for run in steady] == list(case.velocities)
        until = [0.0, *(end for end, _ in holds.pieces)]
        still = [b - a for a, b, (_, v) in zip(until[:-1], until[1:], holds.pieces, strict=True) if v == 0.0]
        assert still == pytest.approx(case.holds)
        assert len(still) >= 2
        assert holds.pieces[-1][1] > 0


@pytest.mark.slow
def test_making_is_deterministic_sealed_and_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seal = make_challenge(tmp_path / "first", 3, 11, grouped=True, jobs=1)
    first = tmp_path / "first"
    assert digest(first) == seal
    names = sorted(path.name for path in (first / CASES).iterdir())
    assert names == ["case-001", "case-002", "case-003"]
    files = {p.relative_to(first).as_posix() for p in first.rglob("*") if p.is_file()} - {"seal.json"}
    assert files == set(check_seal(first)["files"])

    # interrupted after the first case: the second start makes only the others, and the result is the same
    import stickslip.blind.make as module

    made: list[str] = []
    real = module.make_case

    def stopping(root: str, case: Case, seed: int, number: int, grouped: bool) -> dict:
        if made and made[0] == "stop":
            raise KeyboardInterrupt
        made.append(case.name)
        found = real(root, case, seed, number, grouped)
        if len(made) == 1:
            made.insert(0, "stop")
        return found

    monkeypatch.setattr(module, "make_case", stopping)
    with pytest.raises(KeyboardInterrupt):
        make_challenge(tmp_path / "second", 3, 11, grouped=True, jobs=1)
    assert not (tmp_path / "second").exists()
    made.clear()
    made.append("go on")
    # what another plan has left behind does not get under the seal
    stray = tmp_path / "second.partial" / CASES / "case-009"
    stray.mkdir()
    (stray / "campaign.toml").write_text("half")
    assert make_challenge(tmp_path / "second", 3, 11, grouped=True, jobs=1) == seal
    assert made == ["go on", "case-002", "case-003"]
    for name in files:
        assert (tmp_path / "second" / name).read_bytes() == (first / name).read_bytes()

    truth = json.loads((first / TRUTH).read_text())
    assert truth["seed"] == 11
    planned = {case.name: case for case in plan(3, 11)}
    for case in truth["cases"]:
        assert case["kind"] == planned[case["name"]].kind
        assert case["recorder"] == planned[case["name"]].recorder
        assert [e["multiple"] for e in case["effects"]] == [h.multiple for h in planned[case["name"]].hidden]
        rig = tomllib.loads((first / CASES / case["name"] / "campaign.toml").read_text())
        assert isinstance(rig["rig"]["spring_stiffness"], str) == planned[case["name"]].spring_known
        assert all(trace.get("virgin", False) == planned[case["name"]].virgin for trace in rig["trace"])
        assert len(rig["trace"]) == len(case["velocities"]) + 1
    with pytest.raises(RunFolderError, match="never replaced"):
        make_challenge(first, 3, 11)


def test_a_rig_that_does_not_slip_is_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import stickslip.blind.generator as generator
    from stickslip.blind.make import make_case

    tried: list[tuple[int, float]] = []

    def failing(folder: Path, seed: int, effects: list, **rest: object) -> dict:
        tried.append((seed, effects[0][1]))
        if len(tried) < 5:
            raise InputError("run 'v050' shows 0 slips")
        return {"effects": [{"tag": effects[0][0], "amplitude": effects[0][1]}]}

    monkeypatch.setattr(generator, "make_campaign", failing)
    case = next(c for c in plan(40, 1) if c.kind == "one" and c.hidden[0].multiple > 5)
    truth = make_case(str(tmp_path), case, 1, 2, True)
    size, multiple = case.hidden[0].amplitude, case.hidden[0].multiple
    assert [a / size for _, a in tried] == pytest.approx([1, 1, 1, 0.5, 0.25])
    assert len({seed for seed, _ in tried}) == 5
    assert truth["attempts"] == 5
    assert truth["effects"][0]["multiple"] == pytest.approx(multiple / 4)
    monkeypatch.setattr(generator, "make_campaign", lambda *a, **k: (_ for _ in ()).throw(InputError("no slips")))
    with pytest.raises(StickslipError, match="no slips"):
        make_case(str(tmp_path), case, 1, 2, True)


def test_faults_are_told(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    for extra in (["--cases", "0"], ["--seed", "-1"], ["--jobs", "0"]):
        assert run(["challenge", "make", str(tmp_path / "x"), *extra]) == 2
        assert extra[0] in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    for wrong in ({"cases": 0}, {"seed": -1}, {"jobs": 0}):  # in Python by the argument's name
        with pytest.raises(ArgumentError, match=f"^{next(iter(wrong))}: "):
            make_challenge(tmp_path / "x", **wrong)
