"""Finding, making and loading effects; a user's own effect in a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from stickslip.effects import Threshold, parameter
from stickslip.errors import InputError
from stickslip.physics.contact import RoughLines, power_law_bank
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.equations import of_model, of_tags
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.physics.params import specs
from stickslip.simulation.conformance import check_effect
from stickslip.simulation.solve import integrate

MY_EFFECT = """
from jax import Array
import jax.numpy as jnp
from stickslip.effects import Threshold
from stickslip.effects import parameter

class Humming(Threshold):
    tag = "humming"
    summary = "friction follows the sine of the displacement"
    equation = r"\\mu \\to \\mu\\,[1 + \\varepsilon \\sin(x/\\ell)]"
    amplitude = "size"
    size: Array = parameter(0.0, unit="1", lower=-0.1, upper=0.1, null=0.0, doc="relative change of friction")
    length: Array = parameter(20e-6, unit="m", lower=5e-6, upper=1e-3, log=True, doc="length over which it changes")

    def strength(self, state, motion, contact):
        return 1.0 + self.size * jnp.sin(motion.x / self.length)
"""


@pytest.fixture
def no_user_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "_user", {})


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_laws_show_their_values_with_units() -> None:
    effect = catalogue.make("rate-and-state", evolution=0.01, slip_distance="30 um", law="slip")
    text = repr(effect)
    assert text.startswith("RateAndState(") and "evolution=0.01, " in text and "slip_distance=30 µm" in text
    assert "law='slip'" in text and "f64" not in text
    assert "mass=50 g" in repr(Block(mass=0.05)) and "healing_time=20 ms" in repr(Weakening())
    model = Model(
        Block(), power_law_bank(0.26, 1e-6, 3.6, n=24), Weakening(), LoadPoint(jnp.arange(2.0), jnp.ones(2)), (effect,)
    )
    assert repr(Block()) in repr(model) and text in repr(model) and "Bank(24 elements, total_stiffness=" in repr(model)
    lanes = repr(Block(mass=jnp.ones(3)))  # as within vmap, and where it is traced
    assert "mass=f64[3]" in lanes and "damping=10 N s/m" in lanes
    seen: list[str] = []
    jax.jit(lambda block: seen.append(repr(block)) or block.mass)(Block())
    assert "mass=f64[]" in seen[0]


def test_texts_with_units_are_what_their_numbers_in_si_are(tmp_path: Path, no_user_effects: None) -> None:
    block = Block(mass="89 g", spring_stiffness="1.5 N/mm", damping=3.0)
    assert [float(v) for v in jax.tree.leaves(block)] == pytest.approx([0.089, 1500.0, 3.0], rel=1e-15)
    assert block.mass.dtype == jnp.float64 and float(replace(block, mass="0.2 kg").mass) == 0.2
    ageing = catalogue.get("contact-ageing")(rate="0.02", onset_time="1 min")
    assert (float(ageing.rate), float(ageing.onset_time)) == (0.02, 60.0)
    (own,) = catalogue.load_file(write(tmp_path / "my_effect.py", MY_EFFECT))
    assert float(own(length="0.03 mm").length) == pytest.approx(30e-6, rel=1e-15)
    for make, message in (
        (lambda: Block(mass="89 mm"), r"(?s)^Block\.mass: the unit 'mm' is not one of kg.*such as '1 kg'"),
        (lambda: Weakening(healing_time="3"), r"(?s)^Weakening\.healing_time: the unit is missing.*write '3 s'"),
        (lambda: type(ageing)(rate="2 s"), r"^contact-ageing\.rate: a pure number has no unit 's'"),
        (lambda: own(length="30 kg"), r"^humming\.length: .*not one of m"),
    ):
        with pytest.raises(InputError, match=message):
            make()


def test_values_that_are_traced_pass_a_parameter_untouched() -> None:
    def momentum(mass: Array) -> Array:
        block = Block(mass=mass, damping="2 N s/m")
        assert block.mass is mass
        return block.damping * block.mass**2

    assert float(jax.grad(momentum)(jnp.asarray(3.0))) == 12.0
    np.testing.assert_array_equal(jax.jit(jax.vmap(momentum))(jnp.arange(3.0)), [0.0, 2.0, 8.0])


@pytest.mark.slow
def test_a_users_effect_takes_part(tmp_path: Path, no_user_effects: None) -> None:
    assert len(MY_EFFECT.strip().splitlines()) < 20
    (cls,) = catalogue.load_file(write(tmp_path / "my_effect.py", MY_EFFECT))
    assert "humming" in catalogue.tags() and catalogue.get("humming") is cls
    effect = catalogue.make("humming", size=0.05, length="30 um")
    assert float(effect.length) == pytest.approx(30e-6)
    assert check_effect(cls, full_metadata=False) == []

    def slip_time(effects: tuple) -> float:
        drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 1e-3]))
        bank = power_law_bank(0.2604, 0.95e-6, 3.6, n=24)
        steps = integrate(Model(Block(damping=20.0), bank, Weakening(), drive, effects), 0.4)[0].steps
        return float(np.interp(20e-6, steps.x, steps.t))

    shift = slip_time((catalogue.make("humming", size=0.1, length=5e-6),)) - slip_time(())
    assert 1e-3 < shift < 0.1  # caps rise by 2 % over the 1 um of creep, 0.26 N/(1 N/s) long
    assert "humming" in of_tags(["static", "inertia", "humming"]).text()


def test_loading_again_replaces(tmp_path: Path, no_user_effects: None) -> None:
    path = write(tmp_path / "my_effect.py", MY_EFFECT)
    catalogue.load_file(path)
    (second,) = catalogue.load_file(write(path, MY_EFFECT.replace("upper=0.1,", "upper=0.2,")))
    assert float(catalogue.make("humming", size=0.15).size) == 0.15
    assert catalogue.get("humming") is second
    with pytest.raises(InputError, match="line 3"):
        catalogue.load_file(write(path, "import os\n\nos.no_such_thing()\n"))
    assert catalogue.get("humming") is second  # a faulty edit leaves the last good one
    assert list(tmp_path.iterdir()) == [path]  # no byte code beside the user's file


def test_a_cell_that_is_run_again_replaces_its_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a notebook does, whose classes are all of the module __main__."""
    monkeypatch.setattr(catalogue.EFFECTS, "_own", dict(catalogue.EFFECTS._own))
    cell = MY_EFFECT.replace("class", "from stickslip.effects import register\n@register\nclass", 1)
    names = {"__name__": "__main__"}
    for summary in ("as it was", "as it is"):
        exec(cell.replace("friction follows the sine of the displacement", summary), names)  # noqa: S102
    assert catalogue.get("humming") is names["Humming"] and catalogue.get("humming").summary == "as it is"
    with pytest.raises(InputError, match="taken by another effect"):
        exec(cell.replace("Humming", "Another"), names)  # noqa: S102


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('amplitude = "size"', 'amplitude = "length"'), "needs an amplitude"),
        (('tag = "humming"', 'tag = "sensor-drift"'), "taken"),
        (('tag = "humming"', 'tag = "Humming"'), "needs a tag"),
        (("(Threshold)", "(Treshold)"), "line 7.*Treshold"),
        (
            ("from stickslip.effects import Threshold", "from stickslip.effects import Treshold"),
            "line 4.*Treshold",
        ),
        (("def strength", "def strengt"), "method is not written"),
        (("(self, state", "(self state"), "not valid Python"),
        (("null=0.0, ", ""), "needs an amplitude"),
        (("parameter(0.0,", "parameter(0.5,"), "outside its range"),
        (("lower=-0.1", "lower=0.3"), "bounds"),
        (("null=0.0,", "null=0.0, usual=(0.0, 0.2),"), r"usual range.*allowed: -0\.1 \.\.\. 0\.1$"),
        (("null=0.0,", "null=0.0, usual=(0.1, 0.0),"), "usual range"),
        (("(Threshold)", ""), "no effect"),
    ],
)
def test_errors_teach(tmp_path: Path, no_user_effects: None, change: tuple[str, str], message: str) -> None:
    text = MY_EFFECT.replace(*change)
    assert text != MY_EFFECT
    with pytest.raises(InputError, match=f"(?s)my_effect.py.*{message}"):
        catalogue.load_file(write(tmp_path / "my_effect.py", text))
    assert "humming" not in catalogue.tags()


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        catalogue.load_file(tmp_path / "missing.py")
    with pytest.raises(InputError, match="not a Python file"):
        catalogue.load_file(write(tmp_path / "effect.txt", MY_EFFECT))


def test_names_and_values_are_checked() -> None:
    with pytest.raises(InputError, match="did you mean 'sensor-drift'"):
        catalogue.get("sensor-drif")
    with pytest.raises(InputError, match="did you mean 'ripple'"):
        catalogue.make("drive-ripple", riple=1e-7)
    with pytest.raises(InputError, match=r"(?s)drive-ripple\.ripple.*allowed: -5e-06 \.\.\. 5e-06 m"):
        catalogue.make("drive-ripple", ripple="6 um")
    with pytest.raises(InputError, match=r"drive-ripple\.ripple.*not one of m"):
        catalogue.make("drive-ripple", ripple="6 s")
    with pytest.raises(InputError, match="spring, contact"):
        catalogue.make("tilt", by="weight")


def test_the_catalogue_is_a_table_to_choose_from() -> None:
    import stickslip as ss

    found = ss.effects.table()
    assert list(found.index) == catalogue.tags()
    friction = found.query("family == 'friction'")
    assert 5 < len(friction) < len(found) and friction.loc["contact-ageing", "source"].startswith("Dieterich")
    assert found.loc["drive-ripple", "acts as"] == "Drive"
    assert found.loc["contact-ageing", "parameters"].split(", ")[0] == "rate"


def test_what_is_confused_is_confused_both_ways() -> None:
    for tag in catalogue.tags():
        for other, experiment in catalogue.confused(tag).items():
            assert tag in catalogue.confused(other), (tag, other)
            own = catalogue.get(tag).confused_with
            assert experiment == own.get(other, catalogue.get(other).confused_with.get(tag))
    assert "viscoelastic-contact" not in catalogue.get("sensor-drift").confused_with
    assert "hold" in catalogue.confused("sensor-drift")["viscoelastic-contact"]


def test_forms_start_with_the_default() -> None:
    assert list(catalogue.forms(catalogue.get("tilt"))) == [{"by": "spring"}, {"by": "contact"}]
    assert list(catalogue.forms(catalogue.get("inertia"))) == [{}]


def test_equations_hold_the_values() -> None:
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 1e-3]))
    effects = (catalogue.make("inertia", share=0.03), catalogue.make("sensor-drift", rate="5 nm/s"))
    model = Model(Block(mass=0.05), power_law_bank(0.2604, 0.95e-6, 3.6, n=24), Weakening(), drive, effects)
    shown = of_model(model)
    assert shown.model == ("static", "inertia", "sensor-drift")
    text = shown.text()
    for part in (
        "m x'' = F_spring - c x' - Σ_i f_i",
        "y → y + ε t",
        "contact.elements",
        "sensor-drift.rate",
        "5e-09",
        "block.mass",
        "0.05",
    ):
        assert part in text
    latex = shown.latex()
    assert r"m \ddot x" in latex and r"$5 \times 10^{-9}$" in latex and r"\begin{tabular}" in latex
    for group, number in (("align*", 1), ("tabular", 2)):  # one table of parameters, one of other symbols
        assert latex.count(rf"\begin{{{group}}}") == latex.count(rf"\end{{{group}}}") == number


def test_equations_of_the_static_model_have_no_inertia() -> None:
    text = of_tags(["static"], block=Block(), weakening=Weakening()).text()
    assert "0 = F_spring" in text and "x''" not in text and "block.mass" not in text and "ψ" not in text
    assert "block.spring_stiffness" in text
    with pytest.raises(InputError, match="did you mean 'static'"):
        of_tags(["statc"])


def test_inertia_alone_is_not_the_static_model() -> None:
    assert "m x''" in of_tags(["static", "inertia"]).text()


def test_the_amplitude_is_the_parameter_that_can_vanish(tmp_path: Path, no_user_effects: None) -> None:
    """Its name and its default are said once; two such parameters leave it open which one it is."""
    short = MY_EFFECT.replace('    amplitude = "size"\n', "").replace("parameter(0.0,", "parameter(")
    catalogue.load_file(write(tmp_path / "my_effect.py", short))
    made = catalogue.make("humming")
    assert made.amplitude == "size" and float(made.size) == 0.0
    both = short.replace("humming", "buzzing").replace("20e-6, unit", "20e-6, null=20e-6, unit")
    with pytest.raises(InputError, match=r"(?s)several parameters have a null value.*size, length.*amplitude = "):
        catalogue.load_file(write(tmp_path / "other_effect.py", both))
    named = both.replace("    size: Array", '    amplitude = "length"\n    size: Array')
    catalogue.load_file(write(tmp_path / "named_effect.py", named))
    assert catalogue.get("buzzing").amplitude == "length"
    with pytest.raises(InputError, match=r"line 11.*needs a default"):
        catalogue.load_file(write(tmp_path / "third_effect.py", short.replace("null=0.0, ", "")))


def test_parameters_that_can_vanish_are_counted_with_those_of_a_base() -> None:
    class Loud(Threshold):
        size: Array = parameter(null=0.0, unit="1", lower=-1.0, upper=1.0, doc="a factor")

    class Alone(Loud):
        pass

    class Shrill(Loud):
        pitch: Array = parameter(null=0.0, unit="1", lower=-1.0, upper=1.0, doc="another")

    assert (Loud.amplitude, Alone.amplitude, Shrill.amplitude) == ("size", "size", "")


def test_a_class_of_ones_own_is_named_by_its_own_name_where_its_parameters_are_inherited() -> None:
    ageing = catalogue.get("contact-ageing")

    class Slower(ageing):  # type: ignore[misc, valid-type]
        tag = "slower-ageing"

    class Nameless(ageing):  # type: ignore[misc, valid-type]
        size: Array = parameter(1.0, unit="m", lower=0.0, upper=2.0, doc="a length")

    class Sled(Block):
        pass

    for make, said in (
        (lambda: Slower(onset_time="3 kg"), r"slower-ageing\.onset_time"),
        (lambda: Nameless(rate="2 s"), r"Nameless\.rate"),
        (lambda: Nameless(size="2 s"), r"Nameless\.size"),
        (lambda: Sled(mass="3 s"), r"Sled\.mass"),
        (lambda: ageing(rate="2 s"), r"contact-ageing\.rate"),
        (lambda: Block(mass="3 s"), r"Block\.mass"),
    ):
        with pytest.raises(InputError, match=f"^{said}: "):
            make()
    assert list(specs(Slower)) == list(specs(ageing)) and list(specs(Nameless)) == [*specs(ageing), "size"]
    assert float(Slower("0.02").rate) == 0.02 and Slower.amplitude == "rate"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Block(mass="-89 g"), r"(?s)^block\.mass: mass of the block is outside.*-0\.089.*allowed: 1e-09"),
        (lambda: Block(mass=float("nan")), r"^block\.mass"),
        (lambda: Block(spring_stiffness=0.0), r"^block\.spring_stiffness"),
        (lambda: Block(damping=jnp.asarray(-1.0)), r"^block\.damping"),
        (lambda: replace(Block(), damping="-1 N s/m"), r"^block\.damping"),
        (lambda: Weakening(slip_distance=np.array([1e-6, -1e-6])), r"^weakening\.slip_distance"),
        (lambda: type("Sled", (Block,), {})(mass=-1.0), r"^sled\.mass"),
    ],
)
def test_what_cannot_be_is_refused_where_it_is_made(make: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()


def test_what_a_fit_may_find_beyond_a_range_is_not_refused_where_it_is_made() -> None:
    assert float(Block(mass=3e-10, damping=5e6).mass) == 3e-10
    assert float(Weakening(slip_distance=0.02, healing_time=5e-7).healing_time) == 5e-7


@pytest.mark.parametrize("name", ["H", "h_rms", "length"])
def test_rough_lines_have_their_sizes(name: str) -> None:
    with pytest.raises(InputError, match=f"^{name}: "):
        RoughLines(**{name: None})


def test_what_is_traced_is_not_refused_where_it_is_made() -> None:
    def made(mass: Array) -> Array:
        return Block(mass=mass).mass

    assert float(jax.jit(made)(-1.0)) == -1.0 and float(jax.grad(made)(-1.0)) == 1.0
    np.testing.assert_array_equal(jax.vmap(made)(jnp.array([-1.0, 2.0])), [-1.0, 2.0])
