"""The seal: any change of truth, campaigns or seal is refused, and a run does not need the truth."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from invented import answer, effect, make, result

from stickslip.blind.run import run_challenge
from stickslip.blind.score import score_challenge
from stickslip.blind.seal import CASES, RUNS, SEAL, TRUTH, SealError, check_seal, digest
from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.system.runstore import file_record

CASE = {"case-1": ("one", [effect("wear", 6.0)]), "case-2": ("nothing", [])}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = make(tmp_path / "challenge", CASE)
    answer(made, {"case-1": result("missing", ("wear",), final=1.0), "case-2": result("complete")})
    return made


def test_untouched_folder_is_accepted(folder: Path) -> None:
    assert score_challenge(folder)["by_kind"]["one"]["right"]["count"] == 1
    assert score_challenge(folder, expected=digest(folder))["seal"] == digest(folder)


@pytest.mark.parametrize("name", [TRUTH, f"{CASES}/case-1/campaign.toml", f"{CASES}/case-2/campaign.toml"])
def test_one_changed_byte_is_refused(folder: Path, name: str, capsys: pytest.CaptureFixture) -> None:
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(SealError, match=f"{name} was changed"):
        score_challenge(folder)
    assert run(["challenge", "score", str(folder)]) == 2
    assert not (folder / "score").exists()
    assert "seal is broken" in capsys.readouterr().err
    (folder / name).write_bytes(content)
    score_challenge(folder)


@pytest.mark.parametrize("name", [TRUTH, f"{CASES}/case-1/campaign.toml"])
def test_a_removed_file_is_refused(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(SealError, match=f"{name} is gone"):
        score_challenge(folder)


def test_a_new_seal_over_another_truth_is_refused(folder: Path) -> None:
    """Whoever changes the truth and seals it again has another digest than the one published and run under."""
    published = digest(folder)
    truth = json.loads((folder / TRUTH).read_text())
    truth["cases"][0]["effects"][0]["tag"] = "tilt"
    (folder / TRUTH).write_text(json.dumps(truth))
    seal = json.loads((folder / SEAL).read_text())
    seal["files"][TRUTH] = file_record(folder / TRUTH)["sha256"]
    (folder / SEAL).write_text(json.dumps(seal))
    check_seal(folder)
    with pytest.raises(SealError, match="published"):
        score_challenge(folder, expected=published)
    with pytest.raises(SealError, match="another seal"):
        score_challenge(folder)


def test_the_seal_is_printed_again_without_the_truth(folder: Path, capsys: pytest.CaptureFixture) -> None:
    (folder / TRUTH).unlink()
    assert run(["challenge", "seal", str(folder)]) == 0
    assert capsys.readouterr().out == f"2 campaigns in {folder}\nseal {digest(folder)}\n"
    (folder / CASES / "case-1" / "campaign.toml").write_text("other")
    assert run(["challenge", "seal", str(folder)]) == 2
    assert "seal is broken" in capsys.readouterr().err
    assert run(["challenge", "seal", str(folder / CASES)]) == 2


def test_a_damaged_seal_is_refused(folder: Path) -> None:
    (folder / SEAL).write_text("{}")
    with pytest.raises(SealError, match="damaged"):
        score_challenge(folder)
    with pytest.raises(InputError, match="no challenge"):
        check_seal(folder.parent)


def test_a_run_needs_no_truth_but_whole_campaigns(folder: Path) -> None:
    (folder / TRUTH).unlink()
    found = run_challenge(folder, diagnosis=None)  # both are done, so that nothing is started
    assert found == {"done": 2, "failed": 0, "open": 0}
    (folder / CASES / "case-1" / "campaign.toml").write_text("other")
    with pytest.raises(SealError):
        run_challenge(folder)


def test_other_settings_or_thresholds_than_at_first_are_refused(folder: Path) -> None:
    with pytest.raises(InputError, match="max_effects"):
        run_challenge(folder, max_effects=1)
    path = folder / RUNS / "protocol.json"
    content = json.loads(path.read_text())
    content["thresholds"]["chance"] *= 0.5
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="thresholds"):
        run_challenge(folder)
