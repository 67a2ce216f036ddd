"""`stickslip diagnose`: bad input is one message and exit 2; a finished piece is not done again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import run
from stickslip.runstore import open_run
from stickslip.workflow import Pieces

CAMPAIGN = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        (["--candidates", "contact-aging"], "contact-ageing"),
        (["--candidates", "wer,tilt,contact-aging"], "'wear'?\n  contact-aging: did you mean 'contact-ageing'"),
        (["--candidates", " , "], "no effect is named"),
        (["--holdout", "v999.csv"], "v999"),
        (["--effect", "nowhere.py"], "nowhere.py"),
    ],
)
def test_bad_input_is_one_message(tmp_path, capsys, extra, words):
    code = run(["diagnose", str(CAMPAIGN), "--out", str(tmp_path / "out"), *extra])
    error = capsys.readouterr().err
    assert code == 2
    assert words in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


def test_what_a_command_needs_is_named(capsys):
    assert run(["diagnose", str(CAMPAIGN)]) == 2
    assert "diagnose needs --out" in capsys.readouterr().err
    assert run(["simulate"]) == 2
    assert "simulate needs SCENARIO" in capsys.readouterr().err


def test_a_piece_is_kept_and_only_for_the_same_inputs(tmp_path):
    with open_run(tmp_path / "run") as folder:
        piece = {"z": np.arange(3.0), "head": np.array("text")}
        Pieces(folder, "inputs 1").save("base", piece)
        again = Pieces(folder, "inputs 1").load("base")
        assert again is not None
        np.testing.assert_array_equal(again["z"], piece["z"])
        assert str(again["head"]) == "text"
        assert Pieces(folder, "inputs 2").load("base") is None
        assert Pieces(folder, "inputs 1").load("other") is None
        (folder.folder / "pieces" / "base.npz").write_bytes(b"half written")
        assert Pieces(folder, "inputs 1").load("base") is None


@pytest.mark.slow
def test_the_shipped_campaign_is_diagnosed(tmp_path):
    from stickslip.runstore import read_result

    out = tmp_path / "out"
    tried = "contact-ageing,rate-and-state,viscous-drag,sensor-drift"
    code = run(["diagnose", str(CAMPAIGN), "--out", str(out), "--max-effects", "1", "--candidates", tried])
    result = read_result(out)
    assert code == 0
    assert result["verdict"]["kind"] == "missing"
    assert result["verdict"]["effects"] == ["contact-ageing"]
    errors = [rung["heldout_error"] for rung in result["ladder"]]
    assert errors[0] > errors[1] > 1.5 > errors[2]
