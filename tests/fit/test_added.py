"""``stickslip fit --add``: which effect in which form, and that the added mass is one of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.cli.fit import _gains_of_effects, _named
from stickslip.data.campaign import Rig
from stickslip.data.segment import segment
from stickslip.errors import InputError
from stickslip.inference.diagnose.model_ladder import chosen, climb
from stickslip.inference.diagnose.model_record import fitted_model
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.fit.serialised import from_record, record
from stickslip.inference.force.backbone import backbone, power_law
from stickslip.physics.effects import catalogue

from . import synthetic


def test_the_usual_form_unless_another_is_named():
    effects = chosen(("machine-compliance", "tilt:by=contact", "wear: course = saturating , changes=thresholds"))
    assert effects == [
        ("machine-compliance", {}), ("tilt", {"by": "contact"}),
        ("wear", {"course": "saturating", "changes": "thresholds"}),
    ]  # fmt: skip
    assert chosen(("wear:course=logarithmic",)) == [("wear", {"course": "logarithmic"})]


@pytest.mark.parametrize(
    ("added", "words"),
    [
        (
            ["machine-compliance:where=serial"],
            "allowed: machine-compliance:where=read-out, machine-compliance:where=se",
        ),
        (["machine-compliance:series"], "effects: no form of machine-compliance (got 'machine-compliance:series')"),
        (["machine-compliance:were=series"], "allowed: machine-compliance:where=read-out"),
        (["machine-compliance:"], "allowed: machine-compliance:where=read-out"),
        (["tilt:by=spring,by=contact"], "allowed: tilt:by=spring, tilt:by=contact"),
        (["inertia:share=0.05"], "allowed: inertia, which has one form\n  to fix: a fit finds the values of"),
        (["viscous:by=spring"], "effects: there is no effect 'viscous'"),
        (["tild"], "effects: there is no effect 'tild'\n  to fix: did you mean 'tilt'"),
        (["tilt", "wear", "tilt:by=contact"], "effects: an effect can be added once (got 'tilt')"),
    ],
)
def test_what_cannot_be_added_is_one_message(added, words):
    with pytest.raises(InputError) as refused:
        chosen(added)
    assert words in str(refused.value)


def test_the_added_mass_has_a_name_of_its_own():
    assert _named(["static"]) == "static"
    assert _named(["static", "inertia", "tilt"]) == "static + inertia + tilt"
    assert _named(["static", "inertia", "tilt", "inertia"]) == "static + inertia + tilt + added mass"


def test_an_effect_that_takes_nothing_off_is_said_to():
    said = _gains_of_effects({"viscous-drag": 23.8, "wear": 0.0})
    assert said[0].startswith("viscous-drag takes 23.8 off the cost")
    assert said[1].startswith("wear takes nothing off the cost")


@pytest.mark.slow
def test_the_added_mass_is_fitted_and_kept():
    rng = np.random.default_rng(1)
    traces = [
        t.replace(displacement=t.displacement + 5e-9 * rng.standard_normal(t.time.size), noise=5e-9)
        for t in synthetic.traces(effect=catalogue.make("inertia", share=0.05))
    ]
    rig = Rig(mass=synthetic.composition().mass, contacts=4, spring_stiffness=1000.0)
    prepared = prepare(
        SimpleNamespace(rig=rig, rig_of=lambda name: rig, path=None), traces, [segment(t) for t in traces]
    )
    done = climb(prepared, chosen(("inertia",)), lambda *a: None)
    assert [rung.added for rung in done.ladder] == [None, "inertia", "inertia"]
    share, std = done.fit.values["inertia.share"], done.fit.std()["inertia.share"]
    assert std < 0.01
    assert abs(share - 0.05) < 3 * std
    assert done.gains["inertia"] > 20.0
    law = power_law(backbone(done.fit), 4)
    back = from_record(record(fitted_model(done.fit, law, traces, 4)))
    assert back.parts == ("static", "inertia")
    (effect,) = back.effects()
    assert effect.tag == "inertia"
