"""Traces that outlive a process: the same numbers, and nothing kept that could be wrong."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections import namedtuple
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.inference.force.problem import compiled
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Effect
from stickslip.system import threads, trace_cache
from stickslip.system.trace_cache import Program


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(trace_cache, "_folder", lambda: tmp_path)
    return tmp_path


class Counted:
    """A function that knows how often it was traced."""

    def __init__(self):
        self.times = 0

    def __call__(self, parts, factor):
        self.times += 1
        return jnp.sin(parts["a"]) * factor + parts["b"]


PARTS = {"a": np.linspace(0.0, 1.0, 5), "b": np.float64(2.0)}


def test_a_kept_trace_is_not_made_again_and_gives_the_same_numbers(folder):
    function = Counted()
    first = Program(function, "one")(PARTS, 3.0)
    assert len(list(folder.iterdir())) == function.times == 1
    later = Program(function, "one")
    np.testing.assert_array_equal(later(PARTS, 3.0), first)
    np.testing.assert_array_equal(later(PARTS, 4.0), jax.jit(function)(PARTS, 4.0))
    assert function.times == 2  # the second time for the comparison


def test_a_result_that_is_given_back_is_no_reason_to_compile_again(folder):
    program = Program(lambda a: a + 1.0, "one")
    np.testing.assert_array_equal(program(program(jnp.zeros(3))), 2.0)
    (ready,) = program._ready.values()
    assert ready._cache_size() == 1


@pytest.mark.parametrize(
    "name, parts", [("other", PARTS), ("one", {**PARTS, "a": np.zeros(6)}), ("one", {**PARTS, "a": np.arange(5)})]
)
def test_another_name_shape_or_kind_of_number_is_another_trace(folder, name, parts):
    function = Counted()
    Program(function, "one")(PARTS, 3.0)
    np.testing.assert_array_equal(Program(function, name)(parts, 3.0), jax.jit(function)(parts, 3.0))
    assert len(list(folder.iterdir())) == 2


def test_a_damaged_trace_is_made_anew(folder):
    function = Counted()
    first = Program(function, "one")(PARTS, 3.0)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    for broken in (whole[:100], b"", whole[:-1] + bytes([whole[-1] ^ 1])):
        path.write_bytes(broken)
        np.testing.assert_array_equal(Program(function, "one")(PARTS, 3.0), first)
        assert len(path.read_bytes()) == len(whole)


def test_nothing_is_kept_without_a_name_or_of_what_calls_back_into_python(folder):
    Program(Counted(), None)(PARTS, 3.0)

    def calls(x):
        return jax.pure_callback(np.sin, jax.ShapeDtypeStruct(x.shape, x.dtype), x, vmap_method="sequential")

    np.testing.assert_array_equal(Program(calls, "calls")(PARTS["a"]), np.sin(PARTS["a"]))
    assert not list(folder.iterdir())


@pytest.mark.parametrize("how", ["gone", "read-only"])
def test_a_folder_that_cannot_be_written_does_no_harm(folder, monkeypatch, how):
    if how == "gone":
        monkeypatch.setattr(trace_cache, "_folder", lambda: folder / "gone")
    else:

        def refuse(*args, **kwargs):
            raise OSError(errno.EROFS, "read-only file system")

        for name in ("write_bytes", "unlink", "replace"):
            monkeypatch.setattr(Path, name, refuse)
    function = Counted()
    np.testing.assert_array_equal(Program(function, "one")(PARTS, 3.0), jax.jit(function)(PARTS, 3.0))
    assert not list(folder.iterdir())


def test_no_trace_is_kept_of_code_that_was_changed_since_it_was_loaded(folder, tmp_path_factory, monkeypatch):
    package = tmp_path_factory.mktemp("package")
    monkeypatch.setattr(trace_cache, "PACKAGE", package)
    (package / "law.py").write_text("x = 1")
    os.utime(package / "law.py", (0.0, 0.0))
    Program(Counted(), "one")(PARTS, 3.0)
    assert len(list(folder.iterdir())) == 1
    (package / "law.py").write_text("x = 2")
    Program(Counted(), "other")(PARTS, 3.0)
    assert len(list(folder.iterdir())) == 1


def test_an_output_that_is_no_known_container_is_traced_every_time(folder):
    pair = namedtuple("pair", "x y")
    found = Program(lambda x: pair(x, 2.0 * x), "pair")(np.ones(2))
    np.testing.assert_array_equal(found.y, 2.0)
    assert not list(folder.iterdir())


ADDS = """
from stickslip.system import cache
cache.keep_compiled()
from stickslip.system.trace_cache import Program
print(Program(lambda x: x + 1.0, "adds")(1.0))
"""


@pytest.mark.parametrize("off, number", [("0", 1), ("1", 0)])
def test_traces_are_kept_where_compiled_code_is(tmp_path, off, number):
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "STICKSLIP_NO_CACHE": off}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    done = subprocess.run([sys.executable, "-c", ADDS], env=environment, capture_output=True, text=True, check=True)
    assert float(done.stdout) == 2.0
    assert len(list(tmp_path.glob("stickslip/traced/*/*"))) == number


def test_traces_belong_to_the_code_and_old_ones_of_other_code_go(tmp_path, monkeypatch):
    package, cache = tmp_path / "package", tmp_path / "cache"
    package.mkdir(), cache.mkdir()
    (package / "law.py").write_text("x = 1")
    monkeypatch.setattr(trace_cache, "PACKAGE", package)
    monkeypatch.setattr(trace_cache, "folder_for", lambda name: cache)
    of = trace_cache._of_this_version.__wrapped__
    assert of() is None  # changed since it was loaded: neither are traces of the new code those of this process
    os.utime(package / "law.py", (0.0, 0.0))
    first = of()
    assert of() == first
    (package / "law.py").write_text("x = 2")
    os.utime(package / "law.py", (0.0, 0.0))
    second = of()
    assert second != first
    assert {first, second} == set(cache.iterdir())
    os.utime(first, (0.0, 0.0))
    assert of() == second
    assert set(cache.iterdir()) == {second}
    for change in (
        lambda: monkeypatch.setattr(trace_cache, "version", lambda name: f"{name} 9.9"),
        lambda: monkeypatch.setenv("EQX_ON_ERROR", "breakpoint"),
        lambda: monkeypatch.setattr(jax, "default_backend", lambda: "another"),
    ):
        change()
        assert of() not in {first, second}
        second = of()


def test_traces_of_effects_from_elsewhere_are_not_kept():
    class Elsewhere(Effect):
        tag = "elsewhere"

    def name(*effects, names=("weakening.drop",), whole=True):
        return compiled(names, (), jax.tree.structure(effects), whole).name

    wear, other = catalogue.get("wear")(), catalogue.get("wear")(course="saturating")
    assert name(wear, Elsewhere()) is None
    found = {name(), name(whole=False), name(wear), name(other), name(wear, names=("weakening.drop", "wear.rate"))}
    assert None not in found
    assert len(found) == 5


def test_a_force_is_the_same_from_a_kept_trace(folder, small):
    def evaluated():
        compiled.cache_clear()
        return small.problem.evaluate(small.point)

    first, again = evaluated(), evaluated()
    assert len(list(folder.iterdir())) == 1
    for name in ("residual", "shared", "local"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))


def test_of_many_threads_one_compiles_and_all_get_the_same(folder):
    function = Counted()
    program = Program(function, "one")
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda factor: np.asarray(program(PARTS, factor)), np.linspace(0.0, 1.0, 40)))
    assert function.times == 1
    exact = [np.sin(PARTS["a"]) * f + 2.0 for f in np.linspace(0.0, 1.0, 40)]
    np.testing.assert_allclose(found, exact, rtol=1e-14)


def test_runs_side_by_side_give_the_same_numbers_as_one_after_the_other(small, monkeypatch):
    found = []
    for alone in (False, True):
        monkeypatch.setattr(threads, "_ALONE", alone)
        found.append(small.problem.evaluate(small.point))
    for name in ("residual", "shared", "local", "tangent"):
        np.testing.assert_array_equal(getattr(found[0], name), getattr(found[1], name))
