"""A few hundred damaged files of every format; ``make fuzz`` tries a hundred thousand."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from stickslip.cli import run
from stickslip.data.readers import guarded_reading, read_columns
from stickslip.errors import InputError

from .fuzz import campaign, inputs, mutated, prepare, try_one
from .seeds import beside, seeds, tables


@pytest.fixture(autouse=True, scope="module")
def _imported(tmp_path_factory):
    prepare(tmp_path_factory.mktemp("valid"))


@pytest.mark.slow
def test_the_seeds_are_valid(tmp_path):
    """Else nothing would be fuzzed but the first check of each reader."""
    for name, content in seeds():
        (tmp_path / name).write_bytes(content)
        assert len(read_columns(tmp_path / name).data) >= 2 - name.startswith("text.uff"), name
    for name, content in (*seeds(), *tables()):
        folder = tmp_path / f"of-{name}"
        folder.mkdir()
        assert try_one(folder, name, content)[0] == "read", name


def test_every_input_can_be_made_again():
    assert inputs(5, 77) == inputs(5, 77)
    assert len({inputs(5, n)[1] for n in range(200)}) > 190


@pytest.mark.slow
def test_damaged_files_are_read_or_refused():
    """In another process, because compiled readers crash; none of these kinds of fault may come out."""
    found = campaign(seed=7, first=0, number=500, seconds=240.0, tell=print, commands=True)
    assert found["faults"] == {}
    assert found["inputs"] == 500
    assert found["counts"]["refused"] > 300
    assert found["counts"]["read"] > 30
    for command in ("inspect", "simulate", "creep", "fit", "diagnose"):
        assert found["counts"][f"through {command}"] > 30


@pytest.mark.slow
@pytest.mark.parametrize("name", ["5.mat", "4.nc"])
def test_a_file_that_would_take_the_program_down_is_refused(tmp_path, monkeypatch, name):
    """Found by fuzzing: scipy crashes on the one, HDF5 loops for ever on the other (one bit was flipped)."""
    monkeypatch.setattr(guarded_reading, "PATIENCE", 4.0)
    (tmp_path / name).write_bytes((Path(__file__).parent / "crashing" / name).read_bytes())
    with pytest.raises(InputError, match=r"damaged: the library .* (fails|does not end)"):
        read_columns(tmp_path / name)


def test_what_fails_by_chance_is_not_read_again(tmp_path, monkeypatch):
    """A library that reads beyond its memory may raise an error in one process, and take the next one down."""
    (tmp_path / "5.mat").write_bytes(dict(seeds())["5.mat"])
    failed = guarded_reading.subprocess.CompletedProcess([], 1, stderr="Traceback\nZeroDivisionError: by chance\n")
    monkeypatch.setattr(guarded_reading.subprocess, "run", lambda *a, **k: failed)
    monkeypatch.setattr(scipy.io, "loadmat", lambda *a, **k: pytest.fail("read again"))
    with pytest.raises(InputError, match=r"not a readable MATLAB file \(ZeroDivisionError: by chance\)"):
        read_columns(tmp_path / "5.mat")


def test_the_precaution_is_taken_once_for_a_file(tmp_path, monkeypatch):
    calls = []
    real = guarded_reading.subprocess.run
    monkeypatch.setattr(guarded_reading.subprocess, "run", lambda *a, **k: calls.append(a) or real(*a, **k))
    (tmp_path / "a.h5").write_bytes(dict(seeds())["a.h5"])
    for _ in range(3):
        read_columns(tmp_path / "a.h5")
    assert len(calls) == 1


@pytest.mark.parametrize("command", ["inspect", "fit", "simulate", "creep"])
def test_at_the_command_line_a_fault_is_one_message_and_no_file(tmp_path, capsys, command):
    """Damaged campaigns, measurements and scenarios: exit 2, nothing written, nothing that looks like Python."""
    rng, codes = np.random.default_rng(3), Counter()
    pool = [t for t in tables() if t[0].startswith("scenario" if command in ("simulate", "creep") else "campaign")]
    aside = tmp_path / "aside"
    aside.mkdir()
    for n in range(25):
        folder = tmp_path / str(n)
        folder.mkdir()
        for other, content in beside().items():
            (folder / other).write_bytes(content)
        name, content = mutated(rng, pool)
        (folder / name).write_bytes(content)
        before = sorted(p.name for p in folder.iterdir())
        outcome, words = try_one(aside, name, content)
        assert outcome != "fault", words
        if outcome == "read":
            continue  # what is still valid would be computed
        more = ["--out", str(folder / "out"), *(["--model", "static"] if command == "fit" else [])]
        code = run([command, str(folder / name), *more])
        error = capsys.readouterr().err
        codes[code] += 1
        assert error.startswith("stickslip: ")
        assert "Traceback" not in error
        assert "Error:" not in error.split("\n")[0].replace("RuntimeError:", "")
        assert sorted(p.name for p in folder.iterdir()) == before
    assert set(codes) == {2}
    assert codes[2] > 8
