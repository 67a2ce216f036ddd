"""Campaigns of the independent simulator: files a user could bring, a truth kept apart, and nothing shared."""

from __future__ import annotations

import ast
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from stickslip.blind import generator
from stickslip.blind.generator import Run, campaigns, draw_setup, make_campaign
from stickslip.blind.generator.__main__ import main
from stickslip.blind.generator.rigs import unstable
from stickslip.blind.generator.sensor import COUNT
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.errors import InputError

SHORT = (
    Run("v200", 2e-4, events=4),
    Run("v400", 4e-4, events=4),
    Run("holds", 4e-4, pieces=((1.2, 4e-4), (1.7, 0.0), (2.2, 4e-4))),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    folder = tmp_path_factory.mktemp("campaign") / "case"
    return folder, make_campaign(folder, 4, [("contact-ageing", 0.004)], runs=SHORT, spring_known=False)


def test_campaign_loads_and_agrees_with_its_truth(made: tuple[Path, dict]) -> None:
    folder, truth = made
    campaign = load_campaign(folder / "campaign.toml")
    traces = {trace.name: trace for trace in load_traces(campaign)}
    assert list(traces) == ["v200", "v400", "holds"]
    assert campaign.rig.mass == pytest.approx(0.0894)
    spring = campaign.rig.spring_stiffness
    assert spring.lower < truth["rig"]["spring_stiffness"] < spring.upper
    for run in truth["runs"]:
        trace = traces[run["name"]]
        assert trace.resolution == pytest.approx(COUNT, rel=1e-3)
        assert len(run["onset"]) >= 4
        assert run["start"] == 0.0
        for onset, arrest, before, after in zip(
            run["onset"], run["arrest"], run["onset_position"], run["arrest_position"], strict=True
        ):
            moved = np.interp([onset, arrest], trace.time, trace.displacement)
            assert moved == pytest.approx([before, after], abs=4 * COUNT + 1e-4 * after)
        assert not trace.repairs
        assert not trace.warnings
    assert np.allclose(traces["holds"].drive.holds(0.0, 2.2), [(1.2, 1.7)])


def test_constant_runs_end_in_a_stick_phase_after_their_events(made: tuple[Path, dict]) -> None:
    folder, truth = made
    for name, velocity in (("v200", 2e-4), ("v400", 4e-4)):
        run = next(run for run in truth["runs"] if run["name"] == name)
        size = np.loadtxt(folder / f"{name}.csv", skiprows=1).size
        assert len(run["onset"]) == 4
        tail = (size - 1) / 1e4 - run["arrest"][-1]
        assert tail == pytest.approx(0.4 * (run["arrest"][-1] - run["arrest"][-2]), abs=2e-3)
        assert velocity * size / 1e4 > run["arrest_position"][-1]


def test_folder_holds_no_word_of_the_truth(made: tuple[Path, dict]) -> None:
    folder, truth = made
    assert sorted(path.name for path in folder.iterdir()) == ["campaign.toml", "holds.csv", "v200.csv", "v400.csv"]
    text = (folder / "campaign.toml").read_text()
    assert "ageing" not in text
    assert "seed" not in text
    shown = tomllib.loads(text)["rig"]
    assert set(shown["spring_stiffness"]) == {"guess", "lower", "upper"}
    assert json.loads(json.dumps(truth)) == truth


def test_seed_fixes_every_byte_and_effects_leave_the_rest_alone(made: tuple[Path, dict], tmp_path: Path) -> None:
    folder, truth = made
    again = make_campaign(tmp_path / "again", 4, [("contact-ageing", 0.004)], runs=SHORT, spring_known=False)
    assert again == truth
    for path in folder.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes()
    other = make_campaign(tmp_path / "other", 4, [], runs=SHORT[:1], spring_known=False)
    assert other["rig"] == truth["rig"]
    assert other["sensor"] == truth["sensor"]
    assert other["runs"][0]["onset"] != truth["runs"][0]["onset"]
    make_campaign(tmp_path / "zero", 4, [("contact-ageing", 0.0)], runs=SHORT[:1], spring_known=False)
    assert (tmp_path / "zero" / "v200.csv").read_bytes() == (tmp_path / "other" / "v200.csv").read_bytes()


def test_start_after_slips(tmp_path: Path) -> None:
    runs = (SHORT[1], SHORT[2])
    truth = make_campaign(tmp_path / "case", 4, [], runs=runs, virgin=False)
    traces = {trace.name: trace for trace in load_traces(load_campaign(tmp_path / "case" / "campaign.toml"))}
    for run in truth["runs"]:
        trace = traces[run["name"]]
        assert run["start"] > 0.5
        assert not trace.virgin
        assert len(run["onset"]) >= 3
        assert trace.displacement[0] == pytest.approx(0, abs=2 * COUNT)
        slip = np.interp([run["onset"][0], run["arrest"][0]], trace.time, trace.displacement)
        expected = run["arrest_position"][0] - run["onset_position"][0]
        assert np.diff(slip)[0] == pytest.approx(expected, abs=4 * COUNT)


def test_new_lines_change_from_event_to_event(tmp_path: Path) -> None:
    sizes = {}
    for flag in (False, True):
        truth = make_campaign(tmp_path / str(flag), 4, [], runs=SHORT[:1], new_lines=flag)
        run = truth["runs"][0]
        sizes[flag] = (np.array(run["arrest_position"]) - np.array(run["onset_position"]))[1:]
    assert np.ptp(sizes[True]) > 5 * np.ptp(sizes[False])


@pytest.mark.slow
def test_no_line_comes_twice_however_many_slips(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pools: list[int] = []
    real = campaigns.make_bank

    def counting(*given: object, **options: int) -> campaigns.Bank:
        pools.append(options["pool"])
        return real(*given, **options)

    monkeypatch.setattr(campaigns, "make_bank", counting)
    plenty = make_campaign(tmp_path / "plenty", 4, [], runs=SHORT, new_lines=True, virgin=False)
    slips = [len(run["onset"]) + 2 for run in plenty["runs"]]
    assert all(pool > n for pool, n in zip(pools, slips, strict=True))
    pools.clear()
    monkeypatch.setattr(campaigns, "MOST_SLIPS", -1)
    scarce = make_campaign(tmp_path / "scarce", 4, [], runs=SHORT, new_lines=True, virgin=False)
    assert len(pools) > 3  # the run with holds was made again with more lines
    assert pools[-2] <= slips[-1] < pools[-1]
    for a, b in zip(plenty["runs"], scarce["runs"], strict=True):
        assert a["onset"] == pytest.approx(b["onset"], abs=1e-6)
    # other lines in every run, too
    first, second = (make_campaign(tmp_path / str(n), 4, [], runs=[SHORT[1]] * n, new_lines=True) for n in (1, 2))
    assert second["runs"][0]["onset"] == first["runs"][0]["onset"]
    assert second["runs"][1]["onset"] != first["runs"][0]["onset"]


def test_drawn_rigs_stick_and_slip_at_every_velocity() -> None:
    rng = np.random.default_rng(0)
    setups = [draw_setup(rng) for _ in range(20)]
    assert all(unstable(setup.rig, 4e-4) for setup in setups)
    assert np.std([setup.rig.mu_s for setup in setups]) > 1e-3
    assert len({setup.rig.spring_stiffness for setup in setups}) == 20


@pytest.mark.slow
def test_faults_are_told(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main([str(tmp_path / "x"), "--effect", "contact-aging"]) == 2
    assert "contact-ageing" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    (tmp_path / "y").mkdir()
    (tmp_path / "y" / "campaign.toml").write_text("")
    with pytest.raises(InputError, match="already"):
        make_campaign(tmp_path / "y", 1)
    with pytest.raises(InputError, match="slips"):
        make_campaign(tmp_path / "z", 4, [("direct-effect", 0.05)], runs=SHORT[:1])


@pytest.mark.parametrize(
    ("option", "said"), [("--effect=wear=much", "invalid effect value: 'wear=much'"), ("--seed=-1", "0 or more")]
)
def test_a_wrong_option_is_told_in_words(tmp_path: Path, capsys: pytest.CaptureFixture, option: str, said: str) -> None:
    try:
        code = main([str(tmp_path / "x"), option])
    except SystemExit as end:
        code = end.code  # type: ignore[assignment]
    assert code == 2 and said in capsys.readouterr().err and not (tmp_path / "x").exists()


def test_generator_shares_nothing_with_the_model() -> None:
    """Of the package it may import the errors and the units alone."""
    root = Path(generator.__file__).parent
    for path in root.rglob("*.py"):
        package = ("stickslip.blind.generator." + str(path.relative_to(root).parent).replace(".", "")).rstrip(".")
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
                names = [".".join([*above, node.module] if node.module else above)]
            else:
                continue
            for name in names:
                allowed = ("stickslip.blind.generator", "stickslip.errors", "stickslip.system.units")
                assert not name.startswith("stickslip") or name.startswith(allowed), f"{path.name} imports {name}"


def test_every_spring_by_itself_or_in_groups(tmp_path: Path) -> None:
    """The truth says which; on small lines both have the same slips, to a thousandth of the time between them."""
    found = {}
    for grouped in (True, False):
        setup = draw_setup(np.random.default_rng(4), points=2048)
        found[grouped] = make_campaign(tmp_path / str(grouped), 4, runs=SHORT[-1:], setup=setup, grouped=grouped)
    assert [found[g]["elements_a_contact"] for g in (True, False)] == [128, "every spring"]
    onsets = [np.array(found[g]["runs"][0]["onset"]) for g in (True, False)]
    assert onsets[0].size == onsets[1].size > 2
    assert not np.array_equal(*onsets)
    assert np.diff(onsets[0]) == pytest.approx(np.diff(onsets[1]), rel=1e-3)
