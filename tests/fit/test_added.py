"""``stickslip fit --add``: which effect in which form, and that the added mass is one of them."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.cli import _inertial
from stickslip.cli._inertial import chosen
from stickslip.cli.fit import _named
from stickslip.effects import catalogue
from stickslip.errors import InputError
from stickslip.fit.record import Fitted, from_record, record
from stickslip.floors import floors

from . import synthetic


def test_the_usual_form_unless_another_is_named():
    effects = chosen(("machine-compliance", "tilt:by=contact", "wear: course = saturating , changes=thresholds"))
    assert [e.tag for e in effects] == ["machine-compliance", "tilt", "wear"]
    assert effects[0].where == "read-out"
    assert effects[1].by == "contact"
    assert (effects[2].changes, effects[2].course) == ("thresholds", "saturating")
    (partly,) = chosen(("wear:course=logarithmic",))
    assert (partly.changes, partly.course) == ("friction", "logarithmic")


@pytest.mark.parametrize(
    ("added", "words"),
    [
        (
            ["machine-compliance:where=serial"],
            "allowed: machine-compliance:where=read-out, machine-compliance:where=se",
        ),
        (["machine-compliance:series"], "--add: no form of machine-compliance (got 'machine-compliance:series')"),
        (["machine-compliance:were=series"], "allowed: machine-compliance:where=read-out"),
        (["machine-compliance:"], "allowed: machine-compliance:where=read-out"),
        (["tilt:by=spring,by=contact"], "allowed: tilt:by=spring, tilt:by=contact"),
        (["inertia:share=0.05"], "allowed: inertia, which has one form\n  to mend: a fit finds the values of"),
        (["viscous:by=spring"], "--add: there is no effect 'viscous'"),
        (["tild"], "--add: there is no effect 'tild'\n  to mend: did you mean 'tilt'"),
        (["tilt", "wear", "tilt:by=contact"], "--add: an effect can be added once (got 'tilt')"),
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


@pytest.mark.slow
def test_the_added_mass_is_fitted_and_kept():
    data = synthetic.measured(synthetic.traces(effect=catalogue.make("inertia", share=0.05)))
    train = np.asarray(data.cycles.used)
    (added,) = chosen(("inertia",))
    composition, found, ladder = _inertial._climb(
        data, synthetic.composition(), [added], floors(data), train, 1, lambda *a: None
    )
    assert [step["added"] for step in ladder] == [None, None, "inertia"]
    assert ladder[-1]["parameters"] == ladder[-2]["parameters"] + 1
    share, std = found.values["inertia.share"], found.std()["inertia.share"]
    assert std < 0.01
    assert abs(share - 0.05) < 3 * std
    assert ladder[-1]["cost"] < 0.2 * ladder[-2]["cost"]
    back = from_record(record(Fitted(composition, found.z, found.covariance)))
    assert back.parts == ("static", "inertia")
    (effect,) = back.effects()
    assert effect.tag == "inertia"
    assert float(effect.share) == pytest.approx(share, rel=1e-9)
