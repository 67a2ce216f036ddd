"""A fit hands its model back: the same numbers from the run folder, the same physics as a scenario."""

from __future__ import annotations

import json

import jax
import numpy as np
import pytest

import stickslip as ss
from stickslip.cli import run
from stickslip.errors import InputError, RunFolderError
from stickslip.inference.fit.composition import Composition
from stickslip.inference.fit.parameters import Free, effect_parameters
from stickslip.inference.fit.serialised import KEY, Driven, Fitted, record
from stickslip.physics.effects import catalogue
from stickslip.simulation.scenario import build
from stickslip.system.runstore import json_text
from tests.fit.synthetic import TRUTH

DRIVE = ss.LoadPoint(*map(jax.numpy.array, ([0.0, 1.0], [0.0, 3e-4])))


def found(**changes):
    """A fitted model with two effects, one of which has a form, and a free start of the second run."""
    free = [Free(name, unit, "log", v, v, 1.0, v / 20, 20 * v, name) for name, (unit, v) in TRUTH.items()]
    free.append(Free("start.1", "m", 1e-6, 2e-6, 0.0, 3.0, -1e-5, 1e-5, "start of run v200"))
    ageing = catalogue.make("contact-ageing", rate=0.013, onset_time=0.02)
    drag = catalogue.make("viscous-drag", drag=0.001, exponent=0.7)
    effects = [
        f.starting(float(getattr(e, f.name.split(".")[1]))) for e in (ageing, drag) for f in effect_parameters(e)
    ]
    free = (*free, *effects)
    composition = Composition(0.0894, 4, 48, free, {"rig.spring_stiffness": 1000.0}, (ageing, drag))
    runs = (
        Driven("v100", 1e-4, ((1e-4, 2.0),)),
        Driven("v200", 2e-4, ((2e-4, 1.6), (0.0, 0.5), (2e-4, 0.8)), None, False),
    )
    z = np.array([f.inward(f.start) for f in free])
    known = {"normal_force": 0.31, "friction": 0.2, **changes}
    return Fitted(composition, z, np.diag(np.linspace(1e-4, 4e-4, z.size)), runs, **known)


def folder_of(path, fitted):
    path.mkdir()
    content = {"schema": 1, "kind": "fit", "title": "two velocities", KEY: record(fitted)}
    (path / "result.json").write_text(json_text(content), encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path):
    return folder_of(tmp_path / "fit", found())


def leaves(tree):
    return [np.asarray(leaf, float) for leaf in jax.tree.leaves(tree)]


def test_the_model_comes_back_as_it_was(folder):
    original, back = found(), ss.load_run(folder)
    wanted, got = original.model(DRIVE), back.fitted.model(DRIVE)
    assert jax.tree.structure(got) == jax.tree.structure(wanted)
    for a, b in zip(leaves(got), leaves(wanted), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12)
    assert back.parts == ("static", "inertia", "contact-ageing", "viscous-drag")
    assert float(back.model.effects[0].rate) == pytest.approx(0.013, rel=1e-12)
    np.testing.assert_allclose(back.fitted.covariance, original.covariance)
    assert back.parameters.loc["contact.u_max", "value"] == pytest.approx(0.95e-6)
    # the standard deviation of a logarithm times the value
    k = list(TRUTH).index("contact.u_max")
    assert back.parameters.loc["contact.u_max", "std"] == pytest.approx(0.95e-6 * np.sqrt(original.covariance[k, k]))
    assert "start.1" not in back.parameters.index


def test_a_run_shows_its_model_and_not_all_that_was_kept(folder):
    back = ss.load_run(folder)
    text, html = repr(back), back._repr_html_()
    assert text.startswith("<FittedRun>") and len(text) < 3000
    assert "static + inertia + contact-ageing" in text and "contact.u_max" in text and "model_parts" not in text
    assert html.count("<table") == 1 and "contact.u_max" in html


def test_the_scenario_is_the_same_model(folder):
    back = ss.load_run(folder)
    scenario = back.scenario(["drive.velocity=300um/s"])
    got, wanted = build(scenario).model, back.fitted.model(DRIVE)
    assert [e.tag for e in got.effects] == [e.tag for e in wanted.effects]
    for part in ("block", "bank", "weakening", "effects"):
        for a, b in zip(leaves(getattr(got, part)), leaves(getattr(wanted, part)), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-18)
    heavier = build(back.scenario(["contact.normal_force=0.62"]))
    assert heavier.contact.strength == pytest.approx(2 * 0.26)


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_a_value_at_its_bound_is_one_that_the_effect_takes(end):
    """exp(log(1e-10)) is less than 1e-10."""
    for tag in catalogue.tags():
        effect = catalogue.make(tag)
        for free in effect_parameters(effect):
            value = free.outward(free.inward(getattr(free, end)))
            assert free.lower <= value <= free.upper and value == pytest.approx(getattr(free, end), rel=1e-12)
            catalogue.make(tag, **{free.name.split(".")[1]: value})


def test_a_parameter_is_set_by_the_name_that_the_fit_gives_it(folder):
    back = ss.load_run(folder)
    model = build(back.scenario(["rig.mass=0.1", "contact-ageing.rate=0.02", "contact.u_max=1um"])).model
    assert float(model.block.mass) == 0.1
    assert float(model.effects[0].rate) == 0.02
    assert float(model.effects[1].drag) == pytest.approx(0.001)
    for name, hint in (("weakening.drop", "weakening.ratio"), ("contact.strength", "contact.friction_coefficient")):
        with pytest.raises(InputError, match=hint):
            back.scenario([f"{name}=0.2"])


@pytest.mark.slow
def test_and_so_in_a_series(folder, capsys):
    assert run(["simulate", str(folder), "--sweep", "rig.mass=0.08,0.1", "--set", "drive.events=2", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["key"] == "block.mass"
    assert run(["simulate", str(folder), "--sweep", "weakening.drop=0.1,0.2"]) == 2
    assert "weakening.drop: a scenario has this parameter" in capsys.readouterr().err


def test_without_a_known_load_the_strength_is_kept(tmp_path):
    back = ss.load_run(folder_of(tmp_path / "fit", found(normal_force=None, friction=None)))
    assert build(back.scenario()).contact.strength == pytest.approx(0.26)


def test_a_run_can_be_driven_as_it_was_measured(folder):
    back = ss.load_run(folder)
    scenario = back.scenario(run="v200")
    motion = build(scenario).motion
    assert motion.duration == pytest.approx(2.9)
    np.testing.assert_allclose(motion.position(np.array([1.6, 2.1, 2.9])), [3.2e-4, 3.2e-4, 4.8e-4], rtol=1e-9)
    held = back.model_of("v200").load_point
    np.testing.assert_allclose([float(held(t)) for t in (1.7, 2.0)], 3.2e-4, rtol=1e-12)
    with pytest.raises(InputError, match="v200"):
        back.scenario(run="v20")


def test_a_drive_is_a_velocity_or_pieces(folder):
    back = ss.load_run(folder)
    assert back.scenario(drive="0.8 mm/s", events=3).file == back.scenario(["drive.velocity=0.8mm/s"], events=3).file
    assert back.scenario(drive=8e-4).file.drive.velocity == 8e-4
    made = build(back.scenario(run="v200", drive=[("1.5 s", "100 um/s"), (2.0, 0), ("3 s", "-50 um/s")])).motion
    assert made.duration == pytest.approx(3.0)
    np.testing.assert_allclose(made.position(np.array([1.5, 2.0, 3.0])), [1.5e-4, 1.5e-4, 1e-4], rtol=1e-12)


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ("800", "unit is missing"),
        ("3 N", "drive: the unit"),
        (["800 um/s"], "until when and how fast"),
        ([], "until when and how fast"),
        ([("2 s", "1 um/s"), ("1 s", 0)], "must be finite and increase"),
        ({"velocity": 1.0}, "until when and how fast"),
    ],
)
def test_a_drive_that_is_none_is_refused(folder, drive, words):
    with pytest.raises(InputError, match=words):
        ss.load_run(folder).scenario(drive=drive)


def test_a_spring_of_its_own_belongs_to_its_run(tmp_path):
    runs = (Driven("soft", 1e-4, ((1e-4, 2.0),), 170.0), Driven("hard", 1e-4, ((1e-4, 2.0),)))
    fitted = found()
    back = ss.load_run(folder_of(tmp_path / "fit", Fitted(fitted.composition, fitted.z, fitted.covariance, runs)))
    assert float(back.model_of("soft").block.spring_stiffness) == pytest.approx(170.0)
    assert float(back.model_of("hard").block.spring_stiffness) == pytest.approx(1000.0)
    assert build(back.scenario(run="soft")).model.block.spring_stiffness == pytest.approx(170.0)
    assert build(back.scenario()).model.block.spring_stiffness == pytest.approx(1000.0)


def test_equations_hold_the_fitted_values(folder):
    words = ss.load_run(folder).equations()
    rows = {row.name: row.value for row in words.rows}
    assert rows["contact-ageing.rate"] == pytest.approx(0.013)
    assert rows["contact.u_max"] == pytest.approx(0.95e-6)
    assert rows["weakening.ratio"] == pytest.approx(0.82)
    assert "9.5e-07" in words.text()
    assert (rows["contact.strength"], rows["contact.p"], rows["contact.spread"]) == pytest.approx((0.26, 3.3, 0.15))
    assert (rows["contact.contacts"], rows["contact.elements"]) == (4, 48)
    assert {row.unit for row in words.rows if row.name == "contact.strength"} == {"N"}
    assert "F(u) = F_s/N_c Σ_j [1 - (1 - u/U_j)^p]" in words.text()
    assert "c_i = k_i u_i" in words.text()
    assert r"u_{\mathrm{max}}" in words.latex()


@pytest.mark.slow
def test_simulate_takes_a_run_folder(folder, tmp_path, capsys):
    out = tmp_path / "out"
    words = ["simulate", str(folder), "--set", "drive.velocity=400um/s", "--set", "drive.events=2", "--out", str(out)]
    assert run([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["events"]) >= 2
    assert result["scenario"]["drive"]["velocity"] == pytest.approx(4e-4)
    assert [e["type"] for e in result["scenario"]["effect"]] == ["contact-ageing", "viscous-drag"]
    assert result["inputs"][0]["file"].endswith("result.json")
    # what slips is what the fit found: a drop of 18 % of 0.26 N on a spring of 1000 N/m, overshot by up to twice
    slip = result["events"][-1]["slip"]
    assert 0.18 * 0.26 / 1000 < slip < 2.2 * 0.18 * 0.26 / 1000
    assert (out / "arrays.nc").is_file()
    assert (out / "trace.png").is_file()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r.pop(KEY), "no fitted model"),
        (lambda r: r[KEY]["free"][0].pop("value"), "damaged"),
        (lambda r: r[KEY]["free"][0].update(name="contact.strenght"), "damaged"),
        (lambda r: r[KEY].update(contacts=float("inf")), "damaged"),
        (lambda r: r[KEY].update(covariance=[[1.0]]), "damaged"),
        (lambda r: r[KEY]["effects"][0].update(type="my-own"), "--effect"),
    ],
)
def test_a_folder_without_a_usable_model_is_one_message(folder, capsys, change, words):
    path = folder / "result.json"
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    assert run(["simulate", str(folder)]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_what_is_no_run_folder_is_refused(tmp_path, folder, capsys):
    with pytest.raises(RunFolderError, match="not a run folder"):
        ss.load_run(tmp_path)
    with pytest.raises(RunFolderError, match="no such folder"):
        ss.load_run(tmp_path / "nowhere")
    scenario = tmp_path / "a.toml"
    scenario.write_text("schema = 1\n")
    assert run(["simulate", str(scenario), "--trace", "v100"]) == 2
    assert "run folder" in capsys.readouterr().err
