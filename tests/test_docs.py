"""What the documentation is made of: pages, tables, effects, the tutorial, the paper's rigs. Nothing is built."""

from __future__ import annotations

import ast
import doctest
import functools
import importlib
import importlib.util
import inspect
import json
import pydoc
import re
import runpy
import sys
from pathlib import Path
from types import ModuleType

import pytest

from stickslip.inference.fit.parameters import priors
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.latex_to_text import plain
from stickslip.physics.params import specs, variants
from stickslip.simulation.scenario import load_scenario

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
RIGS = sorted((ROOT / "scenarios" / "grzemba2014").glob("*.toml"))


WRITTEN = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(DOCS.glob("*.md"))]
SCREEN = 310  # words of a page before its first picture
RESULTS = sorted((DOCS / "results").glob("*.json"))


def script(name: str) -> ModuleType:
    """A script of docs as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    return script("effect_pages")


@pytest.fixture(scope="module")
def tables() -> ModuleType:
    return script("tables")


@pytest.fixture(scope="module")
def written(pages: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder as a build makes it, the pictures left out."""
    folder = tmp_path_factory.mktemp("effects")
    draw = pages.draw

    def touch(classes: list, into: Path) -> None:
        for cls in classes:
            (into / f"{cls.tag}.png").touch()
        numbers = {
            cls.tag: {"without": [0.3, 6e-5, 3e-3, 9e-8, -1e-8], "with": [0.3, None, 3e-3, 9e-8, 4e-9]}
            for cls in classes
        }
        (into / pages.NUMBERS).write_text(json.dumps(numbers))

    pages.draw = touch
    try:
        pages.write_all(folder)
    finally:
        pages.draw = draw
    return folder


@pytest.mark.parametrize("tag", catalogue.EFFECTS.names())
def test_every_effect_has_its_page(pages: ModuleType, written: Path, tag: str) -> None:
    cls, text = catalogue.get(tag), (written / f"{tag}.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {tag}\n")
    assert pages.display(cls.equation) in text
    for form in catalogue.forms(cls):
        assert pages.display(cls(**form).formula()) in text
        assert all(f"`{name} = {choice}`" in text for name, choice in form.items())
    rows = [line for line in text.splitlines() if line.startswith("|")]
    for name, spec in specs(cls).items():
        (row,) = [r for r in rows if f"| `{name}` |" in r]
        assert row.count("|") == 9, "a cell too many or too few"
        assert row.endswith(f"| {priors(cls())[name]} |")
        assert f"${spec.symbol}$" in row and (spec.unit == "1" or spec.unit in row)
    for name, choices in variants(cls).items():
        assert f"`{name}`" in text and all(f"`{choice}`" in text for choice in choices)
    for other in catalogue.confused(cls.tag):
        assert f"({other}.md)" in text and (written / f"{other}.md").exists()
    assert f"({tag}.png)" in text and (written / f"{tag}.png").exists()
    assert len(text.partition("![")[0].split()) < SCREEN
    assert "**Acts on** the" in text or "**Acts on** what" in text
    assert "## Source" in text
    assert (f"`stickslip fit --add {tag}` says so" in text) == cls.drawn
    assert f"({tag}.md)" in (written / "index.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("tag", catalogue.EFFECTS.names())
def test_every_symbol_of_an_equation_is_explained(pages: ModuleType, tag: str) -> None:
    cls = catalogue.get(tag)
    missing = [s for s in pages.symbols(cls) if not pages.meaning(cls, s)]
    assert not missing, f"give them a meaning in the class's symbols: {missing}"
    page = pages.page(cls)
    assert all(f"${s}$ {pages.prose(pages.meaning(cls, s))}" in page for s in pages.symbols(cls))
    assert set(cls.symbols) <= set(pages.symbols(cls)), "a meaning for a symbol that stands nowhere"


def test_numbers_of_an_effects_runs(pages: ModuleType) -> None:
    numbers = {"without": [0.3, 6e-5, 3e-3, 9e-8, -1e-8], "with": [0.33, None, 3e-3, 9e-8, 4e-8]}
    (table,) = pages._numbers(numbers)
    assert "| 300.00 | 330.00 | +10 % |" in table  # s to ms
    assert "| second slip" not in table, "a run without that slip has no number"
    assert "| -10.0 | 40.0 |  |" in table, "no percentage of what changes sign"


def test_pages_of_effects_that_are_gone_are_removed(pages: ModuleType, written: Path) -> None:
    stray = written / "no-such-effect.md"
    stray.write_text("# left over")
    pages.write_all(written)  # the pictures are up to date: nothing is simulated
    assert not stray.exists() and (written / "inertia.md").exists()


def test_markdown_means_itself(pages: ModuleType) -> None:
    assert pages.prose("far below v* and ``a_b`` of [x]") == r"far below v\* and `a_b` of \[x\]"
    assert pages.cell("a | b\n c") == r"a \| b c"
    assert [pages.number(x) for x in (0.1, 1e-6, -2.5e-7)] == ["0.1", "$10^{-6}$", r"$-2.5\times 10^{-7}$"]


def test_every_page_is_in_a_table_of_contents() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = [
        line.strip() for block in re.findall(r"```\{toctree\}(.*?)```", index, re.DOTALL) for line in block.split("\n")
    ]
    there = {path.stem for path in DOCS.glob("*.md")} - {"index"}
    assert there <= set(listed), f"not in docs/index.md: {sorted(there - set(listed))}"
    missing = [name for name in listed if name and name[0] != ":" and name not in there | {"effects/index"}]
    assert not missing


def test_the_readme_tells_of_the_run_in_its_picture() -> None:
    story = json.loads((DOCS / "results" / "story.json").read_text(encoding="utf-8"))
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = " ".join(re.search(r"<!-- story -->(.*?)<!-- /story -->", text, re.DOTALL)[1].split())  # type: ignore[index]
    assert f"version {story['version']}, {story['date']}" in shown
    # the static model has no fit of its own, and so nothing that it has not seen
    assert len(story["fitted"]) == len(story["unseen"]) + 1 == len(story["models"])
    for value in story["fitted"] + story["unseen"]:
        assert (f"{value:.2g}" if value < 99.5 else f"{value:.0f}") in shown
    assert all(effect in shown for effect in story["effects"])
    assert f"falls from {story['unseen'][0]:.2g} to {story['unseen'][-1]:.2g} floors" in text
    words = (DOCS / "images" / "diagnosis.txt").read_text(encoding="utf-8")
    assert all(model in words for model in story["models"]) and story["verdict"] in words


def test_every_picture_and_page_that_is_linked_is_there() -> None:
    for path in WRITTEN:
        text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for link in re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", text):
            if "effects/" not in link:  # written by the build
                assert (path.parent / link).exists(), f"{path.name}: {link}"


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.stem)
def test_pages_are_easily_read(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert max(len(line) for line in lines) <= 300
    cells = [c.strip() for line in lines if line.startswith("|") for c in re.split(r"(?<!\\)\|", line)[1:-1]]
    assert [c for c in cells if len(c) > 200] == []


@pytest.mark.parametrize(
    "name", ["index", "quick-start", "theory", "measuring", "diagnosis", "real-data", "verification"]
)
def test_a_page_has_its_first_picture_on_the_first_screen(name: str) -> None:
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8").partition("![")[0]
    assert (
        len(re.sub(r"```\{code-cell\}.*?```|^---.*?^---$", "", text, flags=re.DOTALL | re.MULTILINE).split()) < SCREEN
    )


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("path", [p for p in DOCS.glob("*.md") if p.stem != "history"], ids=lambda path: path.stem)
def test_pages_hold_no_dates_and_commits(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.findall(r"\b20\d\d-\d\d-\d\d\b|\d+ \w+ 20[2-9]\d\b", text), "dates belong to docs/results"
    assert not re.findall(r"\b(?=[a-f]*\d)(?=\d*[a-f])[0-9a-f]{7,40}\b", text), "a commit is no figure"


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.stem)
def test_results_say_their_version_date_and_command(path: Path) -> None:
    found = json.loads(path.read_text(encoding="utf-8"))
    for part in [found] if "version" in found else found.values():
        assert part["version"] and part["date"]
        assert _script(part["command"]).is_file(), part["command"]


def _script(command: str) -> Path:
    """The file that a command of python runs."""
    _, first, *more = command.split()
    if first != "-m":
        return ROOT / first
    module = ROOT.joinpath(*more[0].split("."))
    return module / "__main__.py" if module.is_dir() else module.with_suffix(".py")


def test_targets_are_computed_from_the_kept_figures(tables: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    targets = importlib.import_module("targets")
    found = tables.results("performance")
    help_row = "| `--help` under 0.2 s | 0.10 s | yes |"
    rows = {row[0]: row for row in found["command-line"]["rows"]}
    rows["stickslip --help"][2] = "0.10"
    text = targets.targets(found)
    assert help_row in text and text.count("| `python -m tests.benchmark") >= 15
    rows["stickslip --help"][2] = "0.30"
    assert "| `--help` under 0.2 s | 0.30 s | no |" in targets.targets(found)


def test_tables_say_what_is_not_measured(tables: ModuleType) -> None:
    assert tables.part("no-such-file", "part") == {}
    for draw in (
        tables.rates,
        tables.cases,
        tables.plain,
        tables.by_springs,
        tables.by_drive,
        tables.sizes,
    ):
        assert draw({}) == tables.MISSING


def test_the_table_of_rates_has_the_parts_that_are_measured(tables: ModuleType) -> None:
    rate = {"count": 9, "of": 10, "share": 0.9, "low": 0.6, "high": 0.98}
    none = {"count": 0, "of": 0, "share": None, "low": None, "high": None}
    case = {
        "hidden": ["wear"], "multiples": [10.0], "lines": "same", "kind": "ambiguous", "named": ["wear"],
        "set": ["wear", "tilt"], "unseen": [2.0, None], "seconds": 1.0,
    }  # fmt: skip
    part = {
        "seed": 1,
        "version": "0.1.0",
        "date": "2026-01-01",
        "rates": {"exact": rate, "right": none},
        "cases": [case],
    }
    rows = tables.rates({"one": part}).splitlines()
    assert rows[0] == f"| hidden | {tables.PARTS['one']} |"
    assert rows[2:4] == ["| campaigns | 1 |", "| exact | 9 of 10 (60 to 98 %) |"]
    assert not any(row.startswith("| right |") for row in rows), "a rate of nothing has no row"
    assert all(words in rows[-1] for key, words in tables.PARTS.items() if key != "one")
    assert "| wear | same | 10 | `ambiguous` | wear, tilt | 2.00 |" in tables.cases(part)
    assert "Version 0.1.0, 2026-01-01, seed 1" in tables.cases(part)


def test_small_p_values_are_no_zeros(tables: ModuleType) -> None:
    assert [tables.chance(p) for p in (0.5, 0.01, 9.6e-6)] == ["0.50", "0.01", "9.6 · 10⁻⁶"]


def test_ambiguous_campaigns_are_all_accounted_for(tables: ModuleType) -> None:
    named = {"hidden": "wear", "set": ["wear", "tilt"], "before": "ambiguous", "experiment": "back", "after": "missing"}
    cases = [
        {**named, "left": ["wear"]},
        {"hidden": "wear", "set": ["wear", "tilt"], "before": "ambiguous", "experiment": ""},
        {"hidden": "inertia", "set": ["inertia"], "before": "ambiguous", "experiment": ""},
        {"hidden": "wear", "set": ["tilt", "creep"], "before": "ambiguous"},
        {"hidden": "wear", "set": ["wear"], "before": "missing"},
    ]
    found = {"version": "0.1.0", "date": "2026-01-01", "campaigns": 5, "made": 1, "alone": 1, "cases": cases}
    told = tables.experiments(found)
    assert "Of 5 campaigns 4 end with a set" in told and "Of all 4 sets these are 25 %" in told
    assert "The other 3 were not tested: in 1 the hidden effect is missing; in 1 the rival" in told
    assert "for 1 no experiment of the drive alone" in told


def test_pages_that_draw_a_picture_show_it() -> None:
    pages = [
        path for path in DOCS.glob("*.md") if re.search(r"^import pictures$", path.read_text("utf-8"), re.MULTILINE)
    ]
    assert pages
    for path in pages:  # a figure is shown as its text otherwise
        assert "%matplotlib inline\nimport pictures\n" in path.read_text("utf-8"), path.name


def test_pictures_are_drawn_from_the_kept_results(tables: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    pictures = importlib.import_module("pictures")
    assert pictures.damaged(tables.part("robustness", "damaged files")).axes[0].patches
    assert pictures.challenged(tables.results("sealed")).axes[0].patches


def test_every_picture_has_a_script() -> None:
    own = [ROOT / "tests" / f"{name}.py" for name in ("forecast/simulated", "force/ranks")]
    files = [*DOCS.glob("*.py"), *DOCS.glob("*/*.py"), *own]
    scripts = "\n".join(path.read_text(encoding="utf-8") for path in files)
    pictures = [p for folder in ("images", "paper", "figures", "verification") for p in (DOCS / folder).glob("*.png")]
    assert pictures
    for picture in pictures:
        assert re.search(rf"\b{picture.stem}\b", scripts), f"no script makes {picture.name}"


@pytest.mark.long
def test_the_readmes_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    lines = code.strip().splitlines()
    assert len(lines) <= 11
    made = (ROOT / "out" / "demo" / "result.json").exists()
    script = tmp_path / "example.py"
    script.write_text("\n".join(line for line in lines if made or "found" not in line))
    runpy.run_path(str(script))


def test_the_tutorials_effect_is_short_and_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "_user", {})
    text = (DOCS / "writing-an-effect.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"%%writefile my_effect\.py\n(.*?)```", text, re.DOTALL)
    assert len(code.strip().splitlines()) < 20
    path = tmp_path / "my_effect.py"
    path.write_text(code)
    (cls,) = catalogue.load_file(path)
    assert cls.tag == "surface-finish" and plain(cls.equation)
    assert float(catalogue.make("surface-finish", size=0.05, length="500 um").length) == pytest.approx(5e-4)


@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_the_papers_rigs_load(path: Path) -> None:
    scenario = load_scenario(path)
    contact = scenario.file.contact
    assert contact.contacts * contact.normal_force * contact.friction_coefficient == pytest.approx(0.2604)
    assert scenario.file.block.mass == pytest.approx(0.0894)
    assert scenario.file.drive.velocity == pytest.approx(5e-5)


def test_the_papers_page_has_its_numbers() -> None:
    assert {path.stem for path in RIGS} == {"fig2", "fig4", "fig5", "statistics"}
    found = json.loads((DOCS / "results" / "paper.json").read_text())
    rows = found["statistics"]["table"]
    assert all(row["processes"] == 27 for row in rows)
    states = {(row["contacts"], row["state"], row["procedure"]) for row in rows}
    assert len(states) == len(rows) == 20
    text = (DOCS / "paper.md").read_text(encoding="utf-8")
    for picture in re.findall(r"\]\((paper/\w+\.png)\)", text):
        assert (DOCS / picture).exists()


def test_the_page_of_the_api_has_what_public_functions_take_and_return() -> None:
    """Classes of this package, by their names in the signatures."""
    import stickslip

    told = re.findall(r"auto\w+:: stickslip\.(?:\w+\.)*(\w+)", (DOCS / "api.md").read_text())
    own = {node.name for path in (ROOT / "stickslip").rglob("*.py") for node in ast.parse(path.read_text()).body
           if isinstance(node, ast.ClassDef)}  # fmt: skip
    asked = {
        (name, word)
        for name in stickslip.__all__
        for note in getattr(getattr(stickslip, name), "__annotations__", {}).values()
        for word in re.findall(r"[A-Z]\w+", str(note))
    }
    tables = {word for word in own if word.endswith("Table")}  # of a scenario's file, which have a page of their own
    assert {(name, word) for name, word in asked if word in own - tables and word not in told} == set()


EXAMPLES = [path for path in sorted((ROOT / "stickslip").rglob("*.py")) if ">>> " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_in_docstrings_give_what_they_show(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    failed, tried = doctest.testmod(module, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert tried > 0 and failed == 0


def test_the_page_of_the_api_has_every_public_name() -> None:
    import stickslip

    page = (DOCS / "api.md").read_text()
    named = set(re.findall(r"(?:auto\w+:: stickslip|`ss)\.(\w+)", page))
    assert set(stickslip.__all__) - {"__version__"} <= named


def properties() -> dict[str, str]:
    """Docstrings of the properties of the classes that the page of the API has."""
    named = re.findall(r"autoclass:: ([\w.]+)", (DOCS / "api.md").read_text())
    kinds = (property, functools.cached_property)
    return {
        f"{name}.{key}": inspect.getdoc(member) or ""
        for name in named
        for key, member in inspect.getmembers(pydoc.locate(name))
        if isinstance(member, kinds) and not key.startswith("_")
    }


def test_a_property_is_told_in_a_sentence() -> None:
    """What stands before a colon in its first line, the page of the API shows as its type."""
    found = properties()
    assert len(found) > 50
    first = {name: re.sub(r":\w+:`.*?`|`+.*?`+", "", doc).splitlines()[0] for name, doc in found.items()}
    assert {name: line for name, line in first.items() if ":" in line} == {}


def test_a_property_is_understood_by_itself() -> None:
    """As a notebook shows it, without the one that stands before it in the code."""
    found = {name: doc for name, doc in properties().items() if re.match(r"(The same|Of|What they|It)\b", doc)}
    assert found == {}


@pytest.mark.parametrize("room", ["blind", "objects", "show", "inference/forecast"])
def test_a_docstring_that_tells_of_arguments_tells_of_all(room: str) -> None:
    missing = {}
    for path in sorted((ROOT / "stickslip" / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                taken = {a.arg for a in (*node.args.args, *node.args.kwonlyargs)} - {"self", "cls"}
                _, _, told = (ast.get_docstring(node) or "").partition("Args:\n")
                heads = re.findall(r"(?:^ +|\. )([\w, ]+):", told.split("\n\n")[0], re.MULTILINE)
                left = taken - set(", ".join(heads).split(", "))
                if told and left:
                    missing[f"{path.name}: {node.name}"] = sorted(left)
    assert missing == {}


def test_all_that_the_page_of_the_api_names_is_there() -> None:
    named = re.findall(r"auto\w+:: ([\w.]+)", (DOCS / "api.md").read_text())
    assert [name for name in named if not getattr(pydoc.locate(name), "__doc__", None)] == []
    challenge = ("make.make_challenge", "run.run_challenge", "score.score_challenge", "generator.make_campaign")
    assert {f"stickslip.blind.{name}" for name in challenge} <= set(named)
