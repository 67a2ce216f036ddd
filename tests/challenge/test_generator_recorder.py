"""What recorders do to the counts, and that ``stickslip inspect`` finds, counts and mends it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.blind.generator import Run, draw_setup, make_campaign
from stickslip.blind.generator.recorder import RANGE, RECORDERS, record
from stickslip.blind.generator.sensor import COUNT
from stickslip.cli import run
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.trace import Trace
from stickslip.errors import InputError

pytestmark = pytest.mark.slow

RUNS = (
    Run("v200", 2e-4, events=4),
    Run("v400", 4e-4, events=6),
    Run("holds", 4e-4, pieces=((1.2, 4e-4), (1.7, 0.0), (2.2, 4e-4))),
)
STAIRS = np.repeat(np.arange(0, 60_000, 6000), 1000)
STICKS = [(0.1 * i + 0.01, 0.1 * i + 0.09) for i in range(9)]


def rng() -> np.random.Generator:
    return np.random.default_rng(2)


def test_a_counter_starts_again_after_its_range() -> None:
    up = np.arange(10_000)
    made = record("wrap", np.concatenate([up, up[::-1]]), [], 1e4, rng())
    assert made.counts.min() == -RANGE // 2
    assert made.counts.max() == RANGE // 2 - 1
    assert not np.any((made.counts[:10_000] - up) % RANGE)
    assert made.truth["wraps"] == 4  # at 2048 and 6144, up and down
    assert made.keys == {"wrap": RANGE}


def test_a_counter_is_cleared_while_the_block_sticks() -> None:
    made = record("cleared", STAIRS, STICKS, 1e4, rng())
    moments = made.truth["cleared"]
    assert 2 <= len(moments) < len(STICKS)
    assert moments[0] < 0.1
    for moment in moments:
        assert any(a < moment < b for a, b in STICKS)
        assert made.counts[round(moment * 1e4)] == 0
    parts = np.split(np.arange(STAIRS.size), [round(m * 1e4) for m in moments])
    assert all(np.ptp(STAIRS[part] - made.counts[part]) == 0 for part in parts)
    ways = {type(record("cleared", STAIRS, STICKS, 1e4, np.random.default_rng(i)).keys["resets"]) for i in range(10)}
    assert ways == {bool, list}


def test_samples_are_lost_anywhere_but_oftener_in_motion() -> None:
    ramp = np.concatenate([np.zeros(9000), np.arange(1000)]).astype(int)
    in_motion = total = 0
    for seed in range(200):
        made = record("drop-outs", ramp, [], 1e4, np.random.default_rng(seed))
        gone = np.isnan(made.counts)
        assert gone.sum() == made.truth["lost"]
        assert np.array_equal(made.counts[~gone], ramp[~gone])
        assert 2 <= len(made.truth["losses"]) <= 6
        in_motion += sum(place >= 9000 for place, _ in made.truth["losses"])
        total += len(made.truth["losses"])
    assert in_motion / total == pytest.approx(0.6, abs=0.1)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, dict]]:
    root = tmp_path_factory.mktemp("recorders")
    return {kind: (root / kind, make_campaign(root / kind, 9, runs=RUNS, recorder=kind)) for kind in RECORDERS}


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, dict]]:
    """The same with a sensor whose samples scatter by less than a count."""
    root = tmp_path_factory.mktemp("calm")
    drawn = draw_setup(np.random.default_rng(9))
    setup = replace(drawn, sensor=replace(drawn.sensor, white=2e-11))
    return {
        kind: (root / kind, make_campaign(root / kind, 9, runs=RUNS, recorder=kind, setup=setup)) for kind in RECORDERS
    }


@pytest.mark.parametrize("kind", RECORDERS)
def test_inspect_finds_and_counts_what_was_done(
    made: dict[str, tuple[Path, dict]], kind: str, capsys: pytest.CaptureFixture
) -> None:
    folder, truth = made[kind]
    assert truth["recorder"] == kind
    assert run(["inspect", str(folder / "campaign.toml"), "--json"]) == 0
    told = {trace["name"]: trace for trace in json.loads(capsys.readouterr().out)["traces"]}
    for true in truth["runs"]:
        found = dict(repair.split(" ")[:2] for repair in told[true["name"]]["repairs"])  # "wrap: 12 (where): why"
        expected = {
            "plain": {},
            "wrap": {"wrap": true.get("wraps")},
            "cleared": {"reset": len(true.get("cleared", ()))},
            "drop-outs": {"nan": true.get("lost"), "dropped-samples": true.get("lost")},
        }[kind]
        assert found == {f"{name}:": str(count) for name, count in expected.items()}
        assert len(told[true["name"]]["events"]) == len(true["onset"])
    assert kind not in (folder / "campaign.toml").read_text() or kind == "wrap"


def _traces(folder: Path) -> dict[str, Trace]:
    return {trace.name: trace for trace in load_traces(load_campaign(folder / "campaign.toml"))}


def test_mended_records_are_those_of_a_plain_recorder(calm: dict[str, tuple[Path, dict]]) -> None:
    plain, wrapped, cleared, lost = (_traces(calm[kind][0]) for kind in RECORDERS)
    for true in calm["cleared"][1]["runs"]:
        name = true["name"]
        whole = plain[name].displacement
        assert np.allclose(wrapped[name].displacement, whole, rtol=0, atol=1e-3 * COUNT)
        # at each clearing the motion of one sample, a count at most of a block that sticks, is lost
        assert np.abs(cleared[name].displacement - whole).max() <= 1.001 * COUNT * len(true["cleared"])
        kept = np.isin(np.round(plain[name].time * 1e4), np.round(lost[name].time * 1e4))
        assert 0 < (~kept).sum() < 40
        assert np.allclose(lost[name].displacement, whole[kept], rtol=0, atol=1e-3 * COUNT)


def test_the_same_seed_gives_the_same_faults(made: dict[str, tuple[Path, dict]], tmp_path: Path) -> None:
    again = make_campaign(tmp_path / "again", 9, runs=RUNS, recorder="drop-outs")
    folder, truth = made["drop-outs"]
    assert again == truth
    for path in folder.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes()


def test_unknown_recorder_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such recorder"):
        make_campaign(tmp_path / "x", 9, runs=RUNS[:1], recorder="tape")
    assert not (tmp_path / "x").exists()
