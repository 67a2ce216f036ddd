"""A registry is what Python calls a mapping: things registered here and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import EntryPoint

import pytest

from stickslip.errors import InputError
from stickslip.system import registry


@pytest.fixture
def tools(monkeypatch):
    """Two own ones; a package offers two more, one of them under a name that is taken."""
    points = [EntryPoint(name, "math:pi", "stickslip.tools") for name in ("saw", "file")]
    monkeypatch.setattr(registry, "entry_points", lambda group: [p for p in points if p.group == group])
    made = registry.Registry[float]("stickslip.tools", "tool")
    made.register("hammer", 1.0)
    made.register("file", 2.0)
    return made


def test_a_registry_is_a_mapping_with_plug_ins_from_the_first_question_on(tools):
    assert isinstance(tools, Mapping)
    with pytest.warns(UserWarning, match="'file' of math:pi is left out: the name is taken"):
        assert tools["saw"] == pytest.approx(3.14159, abs=1e-5)  # nothing was listed before
    assert "saw" in tools and "axe" not in tools and 0 not in tools
    assert len(tools) == 3 and list(tools) == tools.names() == ["hammer", "file", "saw"]
    assert tools["file"] == 2.0 and tools.get("axe") is None


def test_a_name_that_is_not_there_teaches_those_that_are(tools):
    with pytest.warns(UserWarning, match="taken"), pytest.raises(InputError, match="no tool 'hamer'") as told:
        tools.find("hamer")
    assert told.value.hint == "did you mean 'hammer'?"
