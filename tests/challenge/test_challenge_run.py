"""Running a challenge on clusters with an invented diagnosis: nothing done twice, nothing lost, whatever dies."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dask
import pytest
from invented import effect, make

from stickslip.blind.one_case import failures
from stickslip.blind.run import PROTOCOL, UNRECORDED, Progress, code_digest, run_challenge, time_left
from stickslip.blind.score import score_challenge
from stickslip.blind.score_text import score_text
from stickslip.blind.seal import RUNS
from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.system.cluster import cluster
from tests.loopback import loopback_cluster, worker

NAMES = [f"case-{i:03d}" for i in range(1, 7)]


def challenge(folder: Path, names: list[str] = NAMES) -> Path:
    return make(folder, {name: ("one", [effect("wear", 6.0)]) for name in names})


def invented_diagnosis(log: Path, slow: float = 0.0, failing: str = "", dying: str = "") -> Callable[[Path, Path], Any]:
    """A diagnosis that works like the real one: in a run folder that is continued, piece by piece."""

    def diagnosis(campaign: Path, out: Path) -> None:
        import os

        from stickslip.system.runstore import file_record, open_run

        with log.open("a") as stream:
            stream.write(f"{out.name} {os.getpid()}\n")
        with open_run(out, resume=True) as folder:
            piece = folder.path("pieces/base.txt")
            pieces = int(piece.read_text()) + 1 if piece.exists() else 1
            piece.write_text(str(pieces))
            time.sleep(slow)
            if out.name == failing:
                raise ValueError("the fit fell over")
            if out.name in dying.split():
                os._exit(9)
            folder.json(
                {
                    "verdict": {"kind": "missing", "effects": ["wear"], "set": ["wear"], "text": ""},
                    "ladder": [{"model": ["inertia"], "heldout_error": 2.0}, {"model": ["wear"], "heldout_error": 1.0}],
                    "parameters": {}, "inputs": [file_record(path) for path in sorted(campaign.parent.iterdir())],
                    "seconds": slow, "pieces": pieces,
                }
            )  # fmt: skip

    return diagnosis


def started(log: Path) -> list[tuple[str, int]]:
    if not log.exists():
        return []
    lines = [line.split() for line in log.read_text().splitlines()]
    return [(name, int(pid)) for name, pid in lines]


@pytest.mark.slow
def test_local_cluster_runs_every_case_once_and_keeps_failures(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c"), tmp_path / "log"
    told: list[Progress] = []
    noted: list[str] = []
    found = run_challenge(
        folder, workers=2, diagnosis=invented_diagnosis(log, failing="case-003"), tell=told.append, note=noted.append
    )  # fmt: skip
    assert noted == ["6 of 6 cases to do, 2 workers"]
    assert found == {"done": 5, "failed": 1, "open": 0}
    assert sorted(name for name, _ in started(log)) == NAMES
    assert os.getpid() not in {pid for _, pid in started(log)}
    assert [p.done for p in told] == [1, 2, 3, 4, 5, 6]
    assert {p.total for p in told} == {6}
    assert told[-1].left == 0.0
    assert all(p.left > 0 for p in told[:-1])
    assert {p.case: p.state for p in told} == {n: "failed" if n == "case-003" else "done" for n in NAMES}
    (entry,) = failures(folder / RUNS, "case-003")
    assert (entry["error"], entry["message"]) == ("ValueError", "the fit fell over")
    assert "Traceback" in entry["traceback"]
    score = score_challenge(folder)
    assert (score["finished"], score["failed"]) == (5, 1)
    assert score["by_kind"]["one"]["right"]["count"] == 5

    # again: nothing is done twice; a failure only when asked for, and its record stays
    log.unlink()
    noted.clear()
    assert run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log), note=noted.append) == found
    assert started(log) == noted == []
    again = run_challenge(folder, workers=1, retry=True, diagnosis=invented_diagnosis(log), note=noted.append)
    assert again["done"] == 6
    assert noted == ["1 of 6 cases to do, 1 worker"]
    assert [name for name, _ in started(log)] == ["case-003"]
    assert json.loads((folder / RUNS / "case-003" / "result.json").read_text())["pieces"] == 2
    score = score_challenge(folder)
    assert (score["finished"], score["failed"]) == (6, 0)
    assert next(c["failed_before"] for c in score["list"] if c["case"] == "case-003") == 1


@pytest.mark.slow
def test_some_cases_first(tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, log = challenge(tmp_path / "c"), tmp_path / "log"
    told: list[Progress] = []
    noted: list[str] = []
    some = {"workers": 1, "diagnosis": invented_diagnosis(log), "tell": told.append, "note": noted.append}
    found = run_challenge(folder, only=["case-005", "case-002", "case-005"], **some)
    assert found == {"done": 2, "failed": 0, "open": 4}
    assert noted == ["2 of 2 cases to do, 1 worker"]
    assert [name for name, _ in started(log)] == ["case-005", "case-002"]
    assert [(p.done, p.total) for p in told] == [(1, 2), (2, 2)]
    score = score_challenge(folder)
    assert (score["finished"], score["cases"]) == (2, 6)

    run_challenge(folder, only=["case-001", "case-002"], **some)
    assert noted[1:] == ["1 of 2 cases to do, 1 worker"]
    assert [name for name, _ in started(log)[2:]] == ["case-001"]
    with pytest.raises(InputError, match="no such case") as error:
        run_challenge(folder, only=["case-001", "case-7"], **some)
    assert error.value.value == "case-7"
    assert error.value.allowed == "case-001 to case-006"
    assert run_challenge(folder, **some) == {"done": 6, "failed": 0, "open": 0}
    assert [name for name, _ in started(log)[3:]] == ["case-003", "case-004", "case-006"]

    asked: list[Any] = []

    def instead(folder: Path, **options: Any) -> dict[str, int]:
        asked.append(options["only"])
        return {"done": 2, "failed": len(asked) - 1, "open": 4}

    monkeypatch.setattr("stickslip.blind.run.run_challenge", instead)
    command = ["challenge", "run", str(folder), "--only", "case-005, case-002"]
    assert run(command) == 0  # what was asked for is done
    assert run(command) == 3
    assert asked == [["case-005", "case-002"]] * 2
    assert "2 diagnosed, 0 failed, 4 open" in capsys.readouterr().out


@pytest.mark.slow
def test_other_code_goes_on_and_is_written_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:4]), tmp_path / "log"
    path = folder / RUNS / PROTOCOL

    def stop_at_second(progress: Progress) -> None:
        if progress.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log, slow=0.5, failing=NAMES[1]),
                      tell=stop_at_second)  # fmt: skip
    first = [n for n in NAMES[:4] if (folder / RUNS / n / "result.json").exists() or failures(folder / RUNS, n)]
    assert NAMES[1] in first
    assert len(first) < 4
    # what the run had no time to write down is found when it is asked for
    assert score_challenge(folder)["protocol"]["codes"] == {code_digest(): first}
    assert "versions of the code" not in score_text(score_challenge(folder))

    monkeypatch.setattr("stickslip.blind.run.code_digest", lambda: "other")
    run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log))
    rest = sorted(set(NAMES[:4]) - set(first))
    found = json.loads(path.read_text())
    assert (found["code"], found["codes"]) == ("other", {code_digest(): first, "other": rest})
    assert "run by 2 versions of the code" in score_text(score_challenge(folder))

    # a case that is tried again is the later code's; a run that does nothing changes nothing
    run_challenge(folder, workers=1, retry=True, diagnosis=invented_diagnosis(log))
    codes = {code_digest(): [n for n in first if n != NAMES[1]], "other": sorted([*rest, NAMES[1]])}
    assert json.loads(path.read_text())["codes"] == {code: done for code, done in codes.items() if done}
    before = path.read_bytes()
    monkeypatch.setattr("stickslip.blind.run.code_digest", lambda: "third")
    run_challenge(folder, workers=1, retry=True, diagnosis=invented_diagnosis(log))
    assert path.read_bytes() == before


@pytest.mark.slow
def test_a_protocol_from_before_codes_were_written_is_taken_up(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:2]), tmp_path / "log"
    failing = invented_diagnosis(log, failing=NAMES[1])
    run_challenge(folder, workers=1, diagnosis=failing)
    path = folder / RUNS / PROTOCOL
    old = {key: value for key, value in json.loads(path.read_text()).items() if key not in ("code", "codes")}
    path.write_text(json.dumps(old))
    assert score_challenge(folder)["protocol"]["codes"] == {UNRECORDED: NAMES[:2]}
    run_challenge(folder, workers=1, retry=True, diagnosis=invented_diagnosis(log))
    assert json.loads(path.read_text())["codes"] == {UNRECORDED: NAMES[:1], code_digest(): NAMES[1:2]}


@pytest.mark.parametrize(("workers", "finished"), [(1, 1), (4, 1), (4, 4), (4, 20)])
def test_the_time_left_counts_with_the_workers(workers: int, finished: int) -> None:
    """Forty cases of ten seconds each."""
    rounds = -(-finished // workers)
    estimate = time_left(10.0 * rounds, finished, 40 - finished, workers)
    assert 0.5 < estimate / (10.0 * (40 / workers - rounds)) < 2.0
    assert all(time_left(10.0, 39, 1, n) > 0.0 for n in range(100))


def test_a_scheduler_without_workers_is_told_and_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:2]), tmp_path / "log"
    monkeypatch.setattr("stickslip.system.cluster.LOOK", 0.1)
    monkeypatch.setattr("stickslip.system.cluster.LONELY", 1.0)
    noted: list[str] = []
    with loopback_cluster(tmp_path, 0) as (address, _):
        come: list[subprocess.Popen] = []

        def note(text: str) -> None:
            noted.append(text)
            if "waiting" in text:
                come.append(worker(address, tmp_path / "late"))

        try:
            found = run_challenge(folder, scheduler=address, diagnosis=invented_diagnosis(log), note=note)
        finally:
            for process in come:
                process.kill()
                process.wait(10)
    assert found == {"done": 2, "failed": 0, "open": 0}
    assert noted == ["2 of 2 cases to do, 0 workers", f"no worker is connected to {address}; waiting"]


@pytest.mark.slow
def test_failures_add_up(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:1]), tmp_path / "log"
    failing = invented_diagnosis(log, failing=NAMES[0])
    for times in (1, 2):
        assert run_challenge(folder, workers=1, retry=True, diagnosis=failing) == {"done": 0, "failed": 1, "open": 0}
        assert len(failures(folder / RUNS, NAMES[0])) == times


@pytest.mark.slow
def test_an_interrupted_run_goes_on(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:3]), tmp_path / "log"

    def interrupt(progress: Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log, slow=0.5), tell=interrupt)
    finished = [name for name in NAMES[:3] if (folder / RUNS / name / "result.json").exists()]
    assert 1 <= len(finished) < 3
    assert not list((folder / RUNS).glob("*.failures.json"))
    log.unlink()
    found = run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log))
    assert found == {"done": 3, "failed": 0, "open": 0}
    assert sorted(name for name, _ in started(log)) == sorted(set(NAMES[:3]) - set(finished))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_case_that_kills_its_workers_is_recorded_and_the_others_go_on(tmp_path: Path, workers: int) -> None:
    folder, log = challenge(tmp_path / "c"), tmp_path / "log"
    diagnosis = invented_diagnosis(log, dying="case-002")
    found = run_challenge(folder, workers=workers, diagnosis=diagnosis)
    assert found == {"done": 5, "failed": 1, "open": 0}
    (entry,) = failures(folder / RUNS, "case-002")
    assert entry["error"] == "ProcessDiedError"
    assert [name for name, _ in started(log)].count("case-002") == 3
    assert score_challenge(folder)["failed"] == 1
    # deaths of an earlier run do not count: it gets its three lives again, and this time it lives
    assert run_challenge(folder, workers=1, retry=True, diagnosis=invented_diagnosis(log))["done"] == 6


@pytest.mark.slow
def test_three_killers_do_not_take_the_others_down_with_them(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c"), tmp_path / "log"
    found = run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log, dying="case-001 case-002 case-003"))
    assert found == {"done": 3, "failed": 3, "open": 0}
    assert [bool(failures(folder / RUNS, name)) for name in NAMES] == [True] * 3 + [False] * 3


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_worker_that_is_slow_to_come_back_is_waited_for(tmp_path: Path) -> None:
    folder, log = challenge(tmp_path / "c", NAMES[:2]), tmp_path / "log"
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1ms"}):  # sooner than any process starts
        found = run_challenge(folder, workers=1, diagnosis=invented_diagnosis(log, dying="case-001"))
    assert found == {"done": 1, "failed": 1, "open": 0}


def test_two_clusters_on_one_machine_do_not_speak_of_ports() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with cluster(None, 1) as one, cluster(None, 1) as other:
            assert [one.submit(sum, [1, 2]).result(), other.submit(sum, [1, 3]).result()] == [3, 4]
            # dask's own setting has memory given back after every evaluation
            assert one.submit(os.environ.get, "MALLOC_TRIM_THRESHOLD_").result() is None


@pytest.mark.slow
def test_a_diagnosis_without_a_result_is_a_failure(tmp_path: Path) -> None:
    folder = challenge(tmp_path / "c", NAMES[:1])
    found = run_challenge(folder, workers=1, diagnosis=lambda campaign, out: None)
    assert found == {"done": 0, "failed": 1, "open": 0}
    assert "no result.json" in failures(folder / RUNS, NAMES[0])[0]["message"]


def test_faults_are_told(tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = challenge(tmp_path / "c", NAMES[:1])
    monkeypatch.setattr("stickslip.system.cluster.PATIENCE", 1.0)
    assert run(["challenge", "run", str(folder), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "no scheduler answers" in capsys.readouterr().err
    assert run(["challenge", "run", str(tmp_path)]) == 2
    assert "no challenge" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"^workers: .* own workers"):
        run_challenge(folder, scheduler="tcp://127.0.0.1:9", workers=2)


@pytest.mark.slow
def test_a_worker_killed_on_the_way_loses_nothing(tmp_path: Path) -> None:
    """A scheduler and two workers as separate processes; one is killed in the middle of a case."""
    folder, log = challenge(tmp_path / "c"), tmp_path / "log"
    killed: list[tuple[str, int]] = []

    def kill(progress: Progress) -> None:
        if killed:
            return
        busy = {pid: name for name, pid in started(log)}
        # the worker that is at another case than the one just finished
        for process in workers:
            name = busy.get(process.pid)
            if name is not None and name != progress.case and not (folder / RUNS / name).exists():
                process.send_signal(signal.SIGKILL)
                killed.append((name, process.pid))
                return

    with loopback_cluster(tmp_path, 2) as (address, workers):
        found = run_challenge(folder, scheduler=address, diagnosis=invented_diagnosis(log, slow=0.7), tell=kill)
        assert [process.poll() for process in workers].count(None) == 1
    assert found == {"done": 6, "failed": 0, "open": 0}
    (cut, pid), all_started = killed[0], started(log)
    assert {pid for _, pid in all_started} == {process.pid for process in workers}
    # started twice, the second time by the other worker, which went on from the first one's pieces
    assert [p for name, p in all_started if name == cut] == [pid, next(w.pid for w in workers if w.pid != pid)]
    pieces = {name: json.loads((folder / RUNS / name / "result.json").read_text())["pieces"] for name in NAMES}
    assert pieces == {name: 2 if name == cut else 1 for name in NAMES}
    assert score_challenge(folder)["finished"] == 6


@pytest.mark.long
def test_the_real_diagnosis_from_making_to_the_score(tmp_path: Path) -> None:
    folder = str(tmp_path / "c")
    assert run(["challenge", "make", folder, "--cases", "2", "--seed", "3", "--grouped", "--jobs", "1"]) == 0
    settings = ["--workers", "1", "--candidates", "contact-ageing", "--max-effects", "1"]
    assert run(["challenge", "run", folder, *settings]) == 0
    for name in ("case-001", "case-002"):
        assert (tmp_path / "c" / RUNS / name / "report.html").stat().st_size > 10_000
    assert run(["challenge", "score", folder]) == 0
    score = json.loads((tmp_path / "c" / "score" / "score.json").read_text())
    assert (score["finished"], score["failed"]) == (2, 0)
    assert all(case["heldout_base"] > 0 for case in score["list"])
