"""The page of simulations, without a browser."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.objects import experiments
from stickslip.objects.diagnosis import Diagnosis
from stickslip.objects.experiments import Setting
from stickslip.objects.experiments.rival_experiments import CREEP as HELD
from stickslip.objects.experiments.rival_experiments import farthest, signs
from stickslip.simulation.scenario import make_scenario
from stickslip.system.progress import Cancelled, cancellable
from stickslip.system.units import to_si
from stickslip.workbench import simulate_page, vibrometer_files
from stickslip.workbench.background_work import background
from stickslip.workbench.rivals_view import Rivals, _undecided
from stickslip.workbench.session import Session
from stickslip.workbench.simulated_view import SimulatedView
from stickslip.workbench.simulation_form import SimulationForm
from stickslip.workbench.sweep_view import SweepView, reach, ticks

CREEP = "creep before slip"
RIVALS = ("contact-ageing", "viscous-drag")


def _silent(text, share):
    assert 0.0 <= share <= 1.0


@pytest.fixture(scope="module")
def undecided(campaign):
    proposed = {"text": "holds of 1 s and 10 s", "separates": list(RIVALS)}
    verdict = {"kind": "set", "effects": [], "set": list(RIVALS), "forms": {}}
    return Diagnosis(campaign, None, {"verdict": verdict, "next_experiment": proposed}, {})


@pytest.mark.slow
def test_what_is_left_empty_is_as_in_the_measured_run(base):
    mine = experiments.run(experiments.scenario(base, Setting("v400")))
    theirs = base.simulate(run="v400")
    assert np.array_equal(mine["displacement"].values, theirs["displacement"].values)
    other = experiments.run(experiments.scenario(base, Setting("v100", "400 um/s", events=3)))
    assert other.sizes["event"] >= 3 and other["time"].values[-1] < mine["time"].values[-1]
    holds = experiments.scenario(base, Setting("holds"))
    assert [(p.velocity, p.duration) for p in holds.file.drive.piece] == [
        (v, pytest.approx(dt)) for v, dt in next(r for r in base.fitted.runs if r.name == "holds").pieces
    ]


@pytest.mark.slow
def test_velocity_spring_and_mass_are_taken_with_their_units(base):
    made = experiments.scenario(base, Setting("v100", "0.3 mm/s", "", "0.5 N/mm", "100 g", 2))
    file = made.file
    assert (file.drive.velocity, file.block.spring_stiffness, file.block.mass) == pytest.approx((3e-4, 500.0, 0.1))
    for wrong, key in (
        (Setting("v100", "fast"), "velocity"),
        (Setting("v100", "0.3"), "velocity"),
        (Setting("v100", "0 m/s"), "velocity"),
        (Setting("v100", hold="-1 s"), "hold"),
        (Setting("v100", hold="1 h"), "hold"),
        (Setting("v100", mass="0 kg"), "mass"),
        (Setting("v100", mass="3 N"), "mass"),
    ):
        with pytest.raises(InputError, match=key):
            experiments.scenario(base, wrong)


@pytest.mark.slow
def test_a_hold_begins_amid_a_stick(base):
    made = experiments.scenario(base, Setting("v100", "100 um/s", "5 s"))
    first, hold, last = made.file.drive.piece
    assert (hold.velocity, hold.duration) == (0.0, 5.0) and first.velocity == last.velocity == pytest.approx(1e-4)
    done = experiments.run(made)
    arrests, onsets = done["arrest"].values, done["onset"].values
    begin, end = first.duration, first.duration + 5.0
    assert np.sum(onsets < begin) >= 1 and np.sum(onsets > end) >= 1
    assert not np.any((onsets < begin) & (arrests > begin)), "the load point halts while the block sticks"


@pytest.mark.slow
def test_a_simulation_is_shown_beside_the_measurement(session):
    simulate_page.page(session)
    asked = SimulationForm(session)
    made = SimulatedView(session, asked)
    asked.run.value, asked.velocity.value, asked.events.value = "v400", "400 um/s", 7
    made.start()
    assert background(session, "simulation").said == ""
    assert len(made._model.data["t"]) > 500 and len(made._measured.data["t"]) > 500
    own, model = (float(np.max(d.data["x"])) for d in (made._measured, made._model))
    assert model == pytest.approx(own, rel=0.15)
    assert "/ µm" in made.figures["x"].yaxis.axis_label and made.figures["gap"].xaxis.axis_label.endswith("/ s")
    columns, rows = made._table.columns, made._table.rows
    assert len(rows) == 2 and all(len(r) == len(columns) for r in rows) and "±" in rows[1][1]
    creep = [to_si(f"{cell.split()[0]} {cell.split()[-1]}", "m") for cell in (r[columns.index(CREEP)] for r in rows)]
    assert creep[1] == pytest.approx(creep[0], rel=0.05) and creep[0] > 1e-6
    assert rows[1][0] == made._name.label.value == "model: static + inertia"
    session.by_hand({"weakening.drop": session.fit.values["weakening.drop"] * 1.05})
    assert made._table.rows[1][0] == made._name.label.value == "an earlier model: static + inertia"


@pytest.mark.slow
def test_a_wrong_quantity_is_said_and_nothing_else_happens(session):
    asked = SimulationForm(session)
    made = SimulatedView(session, asked)
    asked.mass.value = "heavy"
    made.start()
    work = background(session, "simulation")
    assert "mass" in work.said and work.found is None and work.doing == ""


def test_without_a_model_it_is_said(campaign):
    session = Session(campaign=campaign)
    simulate_page.page(session)
    asked = SimulationForm(session)
    SimulatedView(session, asked).start()
    assert "no model yet" in background(session, "simulation").said


@pytest.mark.slow
def test_a_simulation_can_be_cancelled(base):
    asked = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) > 1

    with cancellable(stop), pytest.raises(Cancelled):
        experiments.run(experiments.scenario(base, Setting("v050", events=60)))


@pytest.mark.slow
def test_a_sweep_comes_to_the_measured_recurrence(session, campaign, base):
    shown = []
    found = experiments.sweep(base, Setting("v100", events=3), "100 um/s", "400 um/s", 3, _silent, shown.append)
    assert [len(d.velocities) for d in shown] == [1, 2, 3]
    speed, values = experiments.steady_runs(campaign)["v200"]
    assert speed == pytest.approx(2e-4) and "holds" not in experiments.steady_runs(campaign)
    assert found.velocities[1] == pytest.approx(2e-4)
    assert found.mean("recurrence")[1] == pytest.approx(values["recurrence"][0], rel=0.1)
    for low, high, points in (("2 um/s", "1 um/s", 3), ("1 um/s", "2 um/s", 400), ("x", "2 um/s", 3)):
        with pytest.raises(InputError):
            experiments.sweep(base, Setting("v100"), low, high, points, _silent, shown.append)


@pytest.mark.slow
def test_the_sweep_is_drawn_with_measured_points(session):
    asked = SimulationForm(session)
    made = SweepView(session, asked)
    assert list(made._measured.data["run"]) == ["v050", "v100", "v200", "v400"]
    made.low.value, made.high.value, made.points.value, asked.events.value = "200 um/s", "400 um/s", 2, 3
    made.start()
    assert len(made._model.data["v"]) == 2 and np.isfinite(made._model.data["recurrence"]).all()
    assert [row["text"] for row in made.signs.rows] == ["measured", "model: static + inertia"]
    session.by_hand({"weakening.drop": session.fit.values["weakening.drop"] * 1.05})
    assert [row["text"] for row in made.signs.rows] == ["measured", "an earlier model: static + inertia"]
    session.undo()
    assert [row["text"] for row in made.signs.rows] == ["measured", "model: static + inertia"]


@pytest.mark.slow
def test_a_synthetic_record_can_be_opened(campaign, base, folder):
    made = vibrometer_files.write(base, Setting("v400", "400 um/s", events=4), campaign, "synthetic run", _silent)
    assert made == folder / "synthetic run" and not list(folder.glob(".synthetic*"))
    read = ss.load_campaign(made / "campaign.toml")
    assert len(read.events[0].events) >= 3 and read.traces[0].drive_velocity == pytest.approx(4e-4)
    again = experiments.run(experiments.scenario(base, Setting("v400", "400 um/s", events=4)))
    seen = experiments.simulated(again, campaign["v400"])
    for key, (mean, _, count) in experiments.measured(read.traces[0], read.events[0]).items():
        assert seen[key][2] == count, key
        if key != "creep_before_slip":  # its end is told to a sample, in which the block moves by some twenty counts
            assert seen[key][0] == pytest.approx(mean, rel=3e-3), key
    trace = read.traces[0]
    own = trace.time <= again["time"].values[-1]
    counted = trace.displacement[own] - np.interp(trace.time[own], again["time"].values, again["displacement"].values)
    assert np.abs(counted).max() < 1.01 * trace.resolution
    for name in ("synthetic run", "../elsewhere", "a/b", ".hidden", ""):
        with pytest.raises(InputError):
            vibrometer_files.write(base, Setting("v400"), campaign, name, _silent)


@pytest.mark.slow
def test_rivals_are_separated_by_the_experiment_in_which_only_one_of_them_acts(session, base, campaign, undecided):
    session.diagnosis = undecided
    assert _undecided(undecided) == [(RIVALS, "holds of 1 s and 10 s")]
    fits = experiments.rivals(base, RIVALS, {}, _silent)
    assert {tag: fit.effects for tag, fit in fits.items()} == {tag: (tag,) for tag in RIVALS}
    set_to = {"contact-ageing": {"contact-ageing.rate": 0.03}, "viscous-drag": {"viscous-drag.drag": 1e-6}}
    fits = {tag: fit.with_values(set_to[tag]) for tag, fit in fits.items()}
    plain = Setting("v200", "200 um/s", events=3)
    hold, wrong = Setting("v200", "200 um/s", "10 s"), Setting("v200", "200 um/s", mass="0 kg")
    options = {"as driven": plain, "a hold of 10 s": hold, "wrong": wrong}
    shown = []
    found = experiments.simulate_rivals(base, fits, options, _silent, shown.append)
    assert [t.words for t in found] == ["a hold of 10 s", "as driven", "wrong"] and len(shown) == 3
    assert found[0].margin > found[1].margin > 0.0 and found[0].information == pytest.approx(np.log(2.0))
    assert "mass" in found[2].note and not found[2].recordings
    assert set(found[0].recordings) == set(RIVALS)
    drives = [r["drive_position"].values for r in found[0].recordings.values()]
    np.testing.assert_array_equal(*drives)  # each is put to the very same
    made = Rivals(session, SimulationForm(session))
    assert "holds of 1 s and 10 s" in made._said.text and made.effects.value == list(RIVALS)
    background(session, "rivals").found = found
    assert made._table.rows[0][0] == "a hold of 10 s" and made._table.chosen == 0
    words, _, table = made._place
    assert (
        "They differ most in the" in words.text
        and "as likely as any other" in words.text
        and table.rows[0][0] == "contact-ageing"
    )
    made._table._handle_msg({"kind": "row", "row": 1})
    assert made._table.chosen == 1 and made._drawn is found[1]


@pytest.mark.slow
def test_practicable_experiments_change_one_thing_each(base):
    options = experiments.practicable(Setting("v200", events=2), 2e-4, 1000.0, 0.1)
    made = {words: experiments.scenario(base, setting).file for words, setting in options.items()}
    assert [p.velocity for p in made["a hold of 10 s"].drive.piece] == pytest.approx([2e-4, 0.0, 2e-4])
    assert [p.velocity for p in made["a step to ten times the velocity"].drive.piece] == pytest.approx([2e-4, 2e-3])
    assert made["a quarter of the velocity"].drive.velocity == pytest.approx(5e-5)
    assert made["a block twice as heavy"].block.mass == pytest.approx(0.2)
    assert made["a spring half as stiff"].block.spring_stiffness == pytest.approx(500.0)


@pytest.mark.slow
def test_a_load_and_a_way_back_are_simulated(base):
    loaded = experiments.scenario(base, Setting("v400", "400 um/s", events=2, load="2")).file
    plain = experiments.scenario(base, Setting("v400", "400 um/s", events=2)).file
    assert loaded.contact.normal_force == pytest.approx(2.0 * plain.contact.normal_force)
    assert loaded.contact.u_max == pytest.approx(2.0 ** (1.0 / plain.contact.p) * plain.contact.u_max)
    heavy, light = (experiments.run(experiments.scenario(base, Setting("v050", "50 um/s", events=3, load=n)))
                    for n in ("2", "1"))  # fmt: skip
    assert heavy["slip"].values[1:] == pytest.approx(2.0 * light["slip"].values[1:], rel=0.03)  # the drop over k
    back = experiments.run(experiments.scenario(base, Setting("v400", "400 um/s", back=True)))
    way = back["drive_position"].values
    turned = back["time"].values[np.argmax(way)]
    assert way[-1] < 0.5 * way.max() and np.sum(back["onset"].values > turned) >= 2
    assert experiments.simulated(back, base.campaign["v400"])["slip"][2] > 2
    with pytest.raises(InputError, match="load"):
        experiments.scenario(base, Setting("v400", load="-1"))


@pytest.mark.slow
def test_models_that_differ_in_a_hold_only_are_separated(base):
    """As the sensor reads it: a drift shows in no motion of the block."""
    setting = Setting("v400", "400 um/s", hold="2 s")
    drifting = base.scenario().content | {"effect": [{"type": "sensor-drift", "rate": 2e-8}]}
    changes = experiments.changes(base, setting)
    made = {"plain": experiments.scenario(base, setting), "drift": make_scenario(drifting).with_changes(changes)}
    found = {name: experiments.run(scenario) for name, scenario in made.items()}
    key, number, _ = farthest(found)
    creep = [signs(r)[HELD][0] for r in found.values()]
    assert (key, number) == (HELD, 0) and creep[1] - creep[0] == pytest.approx(4e-8, rel=0.05)


@pytest.mark.slow
def test_where_nothing_was_proposed_effects_can_be_chosen(session):
    made = Rivals(session, SimulationForm(session))
    assert "Choose effects" in made._said.text and {"wear", *RIVALS} <= set(made.effects.options)
    made.effects.value = ["wear"]
    made.start()
    assert "two effects" in background(session, "rivals").said


@pytest.mark.slow
def test_what_is_offered_follows_the_promises_until_others_are_chosen(session):
    made = Rivals(session, SimulationForm(session))
    falls = {"wear": 0.1, **dict(zip(RIVALS, (9.0, 5.0), strict=True))}
    promised = [SimpleNamespace(tag=tag, fall=fall) for tag, fall in falls.items()]
    session.promises = promised[:1]
    assert made.effects.value == []
    session.promises = promised[:2]
    assert made.effects.value == ["contact-ageing"]
    session.promises = promised
    assert made.effects.value == list(RIVALS)
    made.effects.value = ["wear", "viscous-drag"]
    session.promises = promised[:2]
    assert made.effects.value == ["wear", "viscous-drag"]


@pytest.mark.slow
def test_models_that_differ_in_nothing_are_said_to(base):
    same = experiments.run(experiments.scenario(base, Setting("v400", "400 um/s", events=2)))
    assert farthest({"a": same, "b": same}) is None


def test_an_effect_that_is_in_the_model_stays_and_the_other_takes_its_place():
    class Fake:
        def __init__(self, *effects):
            self.effects = effects

        def add(self, name):
            return Fake(*self.effects, name)

        def remove(self, tag):
            return Fake(*(e for e in self.effects if e != tag))

    fit = Fake("wear", "contact-ageing")
    found = experiments.rivals(fit, RIVALS, {"viscous-drag": {"law": "linear"}}, _silent)
    assert found["contact-ageing"] is fit
    assert found["viscous-drag"].effects == ("wear", "viscous-drag:law=linear")


def test_the_ticks_of_a_logarithmic_axis_are_plain_numbers():
    assert ticks(np.array([25.0, 800.0, np.nan])) == [10, 20, 50, 100, 200, 500, 1000, 2000]
    assert ticks(np.array([])) == []


@pytest.mark.parametrize("values", [[359.5, 360.1], [200.0], [1000.0], [0.116, 2.72], [np.nan, 4.999], [9.9e-3]])
def test_a_logarithmic_axis_has_two_numbers_and_all_values_however_close_these_are(values):
    low, high = reach(np.array(values))
    assert low < np.nanmin(values) and np.nanmax(values) < high
    assert sum(low < v < high for v in ticks(np.array(values))) >= 2
    assert reach(np.array([])) == (1.0, 10.0)


@pytest.mark.slow
def test_the_sweep_beside_one_run_has_numbers_on_its_axes(session, monkeypatch):
    one = {"v200": experiments.steady_runs(session.campaign)["v200"]}
    monkeypatch.setattr(experiments, "steady_runs", lambda campaign: one)
    made = SweepView(session, SimulationForm(session)).figures["recurrence"]
    for axis, shown in ((made.xaxis, made.x_range), (made.yaxis, made.y_range)):
        assert sum(shown.start <= v <= shown.end for v in axis.ticker.ticks) >= 2


@pytest.mark.slow
def test_nothing_is_proposed_where_nothing_is_undecided(session, campaign):
    assert _undecided(None) == []
    found = Diagnosis(campaign, None, {"verdict": {"kind": "complete"}, "next_experiment": None}, {})
    assert _undecided(found) == []
