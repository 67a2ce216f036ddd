"""What became slower is said, and a slower machine is not."""

from __future__ import annotations

from tests import kept_results

from . import measuring
from .measuring import slower, times

TABLE = {
    "columns": ["way", "processor s", "runs"],
    "rows": [["one", "2.0", "5"], ["two", "0.5", "7"], ["three", "1", ""]],
}
RUNS = {"series": {"own": [{"size": 10, "processor_s": 0.1}, {"size": 20, "processor_s": 0.2}]}}


def test_times_of_tables_and_runs_are_found():
    assert times(TABLE) == {"one, processor s": 2.0, "two, processor s": 0.5, "three, processor s": 1.0}
    assert times(RUNS) == {"own size 10": 0.1, "own size 20": 0.2}
    assert times({"columns": ["way", "first"], "rows": [["drawn after", "3.5 s"], ["a second", "26"]]}) == {
        "drawn after, first": 3.5
    }


def test_only_what_became_slower_than_the_rest_is_said():
    twice = [[name, f"{2.0 * float(value)}", more] for name, value, more in TABLE["rows"]]
    assert slower(TABLE, {**TABLE, "rows": twice}) == []
    twice[1][1] = "4.0"
    (line,) = slower(TABLE, {**TABLE, "rows": twice})
    assert "two, processor s, 0.5 -> 4 s (4.0 times" in line
    assert slower({}, TABLE) == []


def test_a_part_that_became_slower_as_a_whole_is_said_and_a_slower_machine_is_not():
    three = {"rows": [[name, f"{3.0 * float(value)}", more] for name, value, more in TABLE["rows"]]}
    before = {**TABLE, "yardstick_s": 0.2}
    assert len(slower(before, {**TABLE, **three, "yardstick_s": 0.2})) == len(TABLE["rows"])
    assert slower(before, {**TABLE, **three, "yardstick_s": 0.6}) == []


def test_what_is_no_longer_finished_is_said():
    now = {"series": {"own": [{"size": 10, "processor_s": None}, {"size": 20, "processor_s": 0.2}]}}
    (line,) = slower(RUNS, now)
    assert "no longer finished: own size 10, 0.1 s" in line


def test_what_is_measured_under_another_name_is_said():
    renamed = {**TABLE, "rows": [["first", *TABLE["rows"][0][1:]], *TABLE["rows"][1:]]}
    assert slower(TABLE, renamed) == ["no longer measured under this name: one, processor s"]


def test_former_times_stay_when_a_part_is_measured_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_results, "RESULTS", tmp_path)
    monkeypatch.setattr(measuring, "yardstick", lambda: 0.2)
    for first in ("2.0", "3.0", "4.0"):
        measuring.keep("part", "part", columns=["way", "processor s"], rows=[["one", first]])
    kept = kept_results.kept("performance")["part"]
    assert [old["times"] for old in kept["earlier"]] == [{"one, processor s": 2.0}, {"one, processor s": 3.0}]
    assert kept["rows"] == [["one", "4.0"]] and times(kept) == {"one, processor s": 4.0}
