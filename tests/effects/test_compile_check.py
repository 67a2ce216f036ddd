"""A law from elsewhere that the model cannot be compiled with is refused with its file and line."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.effects import catalogue
from stickslip.simulation.conformance import blamed, compile_check, load_file, try_laws

LAW = """from jax import numpy as jnp
from stickslip.effects import Memory, Threshold
from stickslip.effects import parameter, variant

class Mine(Memory, Threshold):
    tag = "mine"
    summary, equation, amplitude = "friction falls", "f", "size"
    size: object = parameter(0.0, unit="1", lower=0.0, upper=0.1, null=0.0, doc="relative change of friction")
    form: str = variant("first", ("first", "second"), "of the law")

    def start(self, bank):
        return jnp.zeros(())

    def advance(self, state, motion, contact):
        return state + motion.path

    def strength(self, state, motion, contact):
        return 1.0 - self.size * jnp.tanh(state)
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    monkeypatch.setattr(catalogue, "_user", {})

    def load(*changes):
        text = LAW
        for old, new in changes:
            assert text.count(old) == 1
            text = text.replace(old, new)
        path = tmp_path / "mine.py"
        path.write_text(text, encoding="utf-8")
        return path, load_file(path)

    return load


def test_a_good_one_is_loaded(load):
    _, (cls,) = load()
    assert catalogue.get("mine") is cls


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("return state + motion.path", "return state + float(motion.path)", 15, "ConcretizationTypeError"),
        ("jnp.tanh(state)", "(1.0 if state > 0 else 2.0)", 18, "TracerBoolConversionError"),
        ("jnp.tanh(state)", "(state if self.form == 'first' else nothing)", 18, "NameError"),  # of the second form
        ("jnp.tanh(state)", "jnp.zeros(3)", None, "cannot be compiled"),
        ("jnp.zeros(())", "jnp.zeros(3)", None, "cannot be compiled"),
    ],
)
def test_a_bad_one_is_refused_with_its_place(load, tmp_path, old, new, line, words):
    with pytest.raises(InputError, match=words) as refused:
        load((old, new))
    assert refused.value.file == str(tmp_path / "mine.py")
    assert refused.value.key == (None if line is None else f"line {line}")
    assert "'mine'" in str(refused.value)
    assert "jax.numpy" in str(refused.value)
    assert "mine" not in catalogue.all()


def test_a_unit_that_is_none_is_refused(load):
    with pytest.raises(InputError, match=r"mine.*metre-ish"):
        load(('unit="1"', 'unit="metre-ish"'))
    assert "mine" not in catalogue.all()


@pytest.mark.parametrize("state", ["jnp.stack([state, motion.path])", "(state, state)", "jnp.zeros((), int)"])
def test_the_state_stays_what_it_is(load, state):
    with pytest.raises(InputError, match=r"'mine' cannot be compiled: its state .* another shape or type"):
        load(("return state + motion.path", f"return {state}"), ("jnp.tanh(state)", "1.0"))


def test_the_programs_own_are_not_tried(load, monkeypatch):
    tried = []

    def base_model(effects):
        tried.extend(effect.tag for effect in effects)
        return made(effects)

    made = compile_check.base_model
    monkeypatch.setattr(compile_check, "base_model", base_model)
    _, (mine,) = load()
    assert tried == ["mine", "mine"]  # in both forms of its law
    try_laws([catalogue.get("wear"), mine])
    assert tried == ["mine"] * 4


def test_a_law_that_fails_when_it_is_used_is_named_with_its_line(load):
    path, (cls,) = load(("1.0 - self.size", "[1.0][int(state.size > 1)] - self.size"))
    with pytest.raises(IndexError) as raised:
        cls().strength(np.zeros(2), None, None)
    found = blamed(raised.value)
    assert found is not None
    assert str(path) in str(found)
    assert "line 18" in str(found)
    assert "'mine' failed: IndexError" in str(found)
    assert blamed(IndexError("of the program's own")) is None
