"""Effects that installed packages offer in the entry point group ``stickslip.effects``."""

from __future__ import annotations

import importlib
import sys
import warnings
from pathlib import Path

import pytest

from stickslip.errors import InputError
from stickslip.inference.force.candidates import every_form
from stickslip.objects.checkpoints import code_digest
from stickslip.physics.effects import catalogue
from stickslip.simulation.conformance import check_effect
from stickslip.simulation.scenario import make_scenario, simulate
from stickslip.simulation.scenario.demonstration import RIG

MODULE = """
from jax import Array
from stickslip.effects import Threshold
from stickslip.effects import parameter, variant

class Humming(Threshold):
    tag = "humming"
    summary = "friction hums"
    equation = "f"
    amplitude = "size"
    size: Array = parameter(0.0, unit="1", lower=-0.1, upper=0.1, null=0.0, doc="relative change of friction")
    key: str = variant("minor", ("minor", "major"), "of the tune")

    def strength(self, state, motion, contact):
        return 1.0 + self.size
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs an invented package: version, its entry points, its module."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(catalogue, "_user", {})

    def install(points: str, module: str = MODULE, version: str = "1.0") -> Path:
        for old in tmp_path.glob("*.dist-info"):
            for file in old.iterdir():
                file.unlink()
            old.rmdir()
        folder = tmp_path / f"humming_friction-{version}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: humming-friction\nVersion: {version}\n")
        (folder / "entry_points.txt").write_text(f"[stickslip.effects]\n{points}\n")
        path = tmp_path / "humming_friction.py"
        path.write_text(module)
        sys.modules.pop("humming_friction", None)
        monkeypatch.setattr(catalogue.EFFECTS, "_plugged", None)
        importlib.invalidate_caches()
        return path

    yield install
    sys.modules.pop("humming_friction", None)


@pytest.mark.parametrize("name", ["humming", "my-effect"])
def test_it_is_known_by_its_tag(installed, name):
    installed(f"{name} = humming_friction:Humming")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert catalogue.tags()[-1] == "humming"
    cls = catalogue.get("humming")
    assert cls.__name__ == "Humming"
    assert cls.__module__ == "humming_friction"
    assert float(catalogue.make("humming", size=0.05).size) == 0.05
    # as a sweep over the catalogue makes its candidates and finds them again
    assert [form["key"] for tag, form in every_form(catalogue.tags()) if tag == "humming"] == ["minor", "major"]
    if name != "humming":
        assert name not in catalogue.all()
        with pytest.raises(InputError, match="there is no effect 'my-effect'"):
            catalogue.get(name)


@pytest.mark.slow
def test_it_keeps_the_rules_and_is_simulated(installed):
    installed("humming = humming_friction:Humming")
    assert check_effect(catalogue.get("humming"), full_metadata=False) == []
    drive = {"velocity": 2e-4, "events": 2}
    plain, humming = (
        simulate(make_scenario({**RIG, "drive": drive, "effect": effects}))
        for effects in ([], [{"type": "humming", "size": 0.05, "key": "major"}])
    )
    ratio = float(humming["spring_force"].max() / plain["spring_force"].max())
    assert ratio == pytest.approx(1.05, abs=0.005)


@pytest.mark.parametrize(
    ("points", "module", "message"),
    [
        ("humming = humming_friction:Huming", MODULE, "'humming' of humming-friction cannot be loaded.*Huming"),
        ("humming = humming_friction:Humming", "import os\nos.no_such_thing", "'humming' of humming-friction cannot"),
        ("humming = nowhere_at_all:Humming", MODULE, "'humming' of humming-friction cannot be loaded.*nowhere_at_all"),
        ("humming = humming_friction:Humming", MODULE.replace("null=0.0, ", ""), "needs an amplitude"),
        ("humming = humming_friction:Humming", MODULE.replace('"humming"', '"wear"'), "'wear' of humming-.*is taken"),
    ],
)
def test_what_cannot_be_used_is_left_out_with_a_warning(installed, points, module, message):
    before = catalogue.tags()
    installed(points, module)
    with pytest.warns(UserWarning, match=f"(?s){message}"):
        assert catalogue.tags() == before
    assert catalogue.get("wear").__module__ == "stickslip.physics.effects.wear"


def test_one_that_fails_leaves_the_others(installed):
    installed("broken = humming_friction:Huming\ngood = humming_friction:Humming\nagain = humming_friction:Humming")
    with pytest.warns(UserWarning, match="'broken' of humming-friction cannot be loaded") as told:
        assert catalogue.tags().count("humming") == 1
    assert len(told) == 1


def test_finished_pieces_of_another_version_are_not_taken_up(installed):
    without = code_digest()
    path = installed("humming = humming_friction:Humming")
    first = code_digest()
    assert first != without
    assert code_digest() == first
    installed("humming = humming_friction:Humming", version="1.1")
    second = code_digest()
    assert second != first
    path.write_text(MODULE.replace("1.0 + self.size", "1.0 - self.size"))  # as in a package that is worked on
    assert code_digest() != second
