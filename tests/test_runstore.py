"""Run folders: there as a whole or not at all, never overwritten unasked, never written twice at once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.errors import RunFolderError
from stickslip.system.runstore import (
    RESULT,
    alone,
    file_record,
    json_text,
    open_run,
    read_result,
    versions,
    write_aside,
)


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def write(folder: Path, value: int = 1, **options) -> None:
    with open_run(folder, **options) as run:
        run.json({"value": value})


def test_nothing_has_its_name_until_all_is_written(tmp_path):
    target = tmp_path / "a" / "run"
    with open_run(target) as run:
        run.json({"value": 1})
        assert not target.exists()
    assert names(target) == [RESULT]
    assert names(target.parent) == ["run"]
    assert read_result(target) == {"value": 1}


def test_an_error_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), open_run(tmp_path / "run") as run:
        run.json({})
        raise ZeroDivisionError
    assert names(tmp_path) == []


def test_an_existing_folder_is_refused_and_with_force_replaced(tmp_path):
    write(tmp_path / "run", 1)
    with pytest.raises(RunFolderError, match="--force"):
        write(tmp_path / "run", 2)
    assert read_result(tmp_path / "run")["value"] == 1
    write(tmp_path / "run", 3, force=True)
    assert read_result(tmp_path / "run")["value"] == 3
    assert names(tmp_path) == ["run"]


def test_an_error_while_replacing_keeps_the_old_one(tmp_path):
    write(tmp_path / "run", 1)
    with pytest.raises(ZeroDivisionError), open_run(tmp_path / "run", force=True):
        raise ZeroDivisionError
    assert read_result(tmp_path / "run")["value"] == 1


def test_what_is_no_run_folder_is_left_alone_even_with_force(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("all of it")
    (tmp_path / "file").write_text("x")
    for name in ("mine", "file"):
        with pytest.raises(RunFolderError):
            write(tmp_path / name, force=True)
    assert (tmp_path / "mine" / "thesis.tex").read_text() == "all of it"


def test_an_empty_folder_is_taken(tmp_path):
    (tmp_path / "run").mkdir()
    write(tmp_path / "run")
    assert read_result(tmp_path / "run")["value"] == 1


def test_two_runs_into_one_folder(tmp_path):
    with open_run(tmp_path / "run"):
        with pytest.raises(RunFolderError, match="another run"):
            write(tmp_path / "run")
        write(tmp_path / "other")
    assert names(tmp_path) == ["other", "run"]


KILLED = """
import sys, time
from stickslip.system.runstore import open_run
with open_run(sys.argv[1], resume=True) as run:
    run.json({"step": 1}, "step1.json")
    print("written", flush=True)
    time.sleep(60)
"""


def test_a_killed_run_frees_its_lock_and_can_be_resumed(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path / "run")], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"written\n"
    with pytest.raises(RunFolderError, match="another run"):
        write(tmp_path / "run")
    process.send_signal(signal.SIGKILL)
    process.wait()
    with open_run(tmp_path / "run", resume=True) as run:
        assert run.resumed
        assert json.loads(run.path("step1.json").read_text()) == {"step": 1}
        run.json({"value": 7})
    assert names(tmp_path) == ["run"]
    assert read_result(tmp_path / "run")["value"] == 7


def test_a_link_and_what_it_leads_to_are_one_folder(tmp_path):
    (tmp_path / "x").mkdir()
    (tmp_path / "y").mkdir()
    (tmp_path / "y" / "a").symlink_to(tmp_path / "x" / "real")
    with open_run(tmp_path / "y" / "a") as run:
        assert run.folder == tmp_path / "x" / "real.partial"
        with pytest.raises(RunFolderError, match="another run"):
            write(tmp_path / "x" / "real")
        run.json({"value": 2})
        write(tmp_path / "x" / "a")
    assert read_result(tmp_path / "x" / "real")["value"] == 2


def test_work_alone_on_a_folder_keeps_its_own_errors(tmp_path):
    with pytest.raises(ConnectionError, match="no answer"), alone(tmp_path / "runs"):
        with pytest.raises(RunFolderError, match="another run"), alone(tmp_path / "runs"):
            pass
        raise ConnectionError("no answer")
    with alone(tmp_path / "runs"):
        pass


def test_the_current_folder_can_be_named(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    write(Path(), 3)
    assert read_result(tmp_path / "here")["value"] == 3


def test_names_that_are_no_text_are_written(tmp_path):
    with open_run(tmp_path / "run") as run:
        run.json({"file": "a\udcff.csv"})
    assert read_result(tmp_path / "run")["file"] == "a\udcff.csv"


def test_halves_of_files_are_not_resumed(tmp_path):
    (tmp_path / "run.partial" / "pieces").mkdir(parents=True)
    (tmp_path / "run.partial" / "pieces" / "whole.txt").write_text("whole")
    for name in (".result.json.4711.part", "pieces/base.part"):
        (tmp_path / "run.partial" / name).write_text("hal")
    write(tmp_path / "run", resume=True)
    assert names(tmp_path / "run") == ["pieces", RESULT]
    assert names(tmp_path / "run" / "pieces") == ["whole.txt"]


def test_a_file_is_written_as_a_whole_or_not_at_all(tmp_path):
    path = write_aside(tmp_path / "a.txt", "µ")
    assert path.read_bytes() == "µ".encode()
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError):
        write_aside(tmp_path / "taken", b"x")
    assert names(tmp_path) == ["a.txt", "taken"]


def test_without_resume_what_was_left_behind_is_removed(tmp_path):
    (tmp_path / "run.partial").mkdir()
    (tmp_path / "run.partial" / "old.json").write_text("{}")
    write(tmp_path / "run")
    assert names(tmp_path / "run") == [RESULT]


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs POSIX permissions")
def test_a_place_that_cannot_be_written_is_a_clear_error(tmp_path):
    # a file where a folder should be cannot be written by anybody, not even by root
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="cannot be written") as caught:
        write(tmp_path / "file" / "run")
    assert caught.value.exit_code == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_a_clear_error(tmp_path):
    with (
        pytest.raises(RunFolderError, match="No space left"),
        open_run(tmp_path / "run") as run,
        open("/dev/full", "w") as stream,  # noqa: PTH123
    ):
        run.json({})
        stream.write("x" * 100)
        stream.flush()
    assert names(tmp_path) == []


def test_json_is_valid_whatever_is_in_it():
    text = json_text(
        {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": np.int64(3), "d": Path("x"), "e": (1, None)}
    )
    assert json.loads(text) == {"a": None, "b": [1.0, None], "c": 3, "d": "x", "e": [1, None]}


def test_inputs_are_hashed_and_versions_known(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"abc")
    record = file_record(tmp_path / "a.csv")
    assert record["sha256"] == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert {"python", "stickslip", "jax", "diffrax"} <= set(versions())


def test_results_that_cannot_be_read(tmp_path):
    with pytest.raises(RunFolderError, match="no such folder"):
        read_result(tmp_path / "none")
    with pytest.raises(RunFolderError, match=r"no result\.json"):
        read_result(tmp_path)
    (tmp_path / RESULT).write_text("{")
    with pytest.raises(RunFolderError, match="cannot be read"):
        read_result(tmp_path)
