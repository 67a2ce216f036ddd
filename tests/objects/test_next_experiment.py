"""Effects that a campaign cannot distinguish, and the experiment that would."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss
from stickslip.blind.detection import detection
from stickslip.blind.generator import Run, make_campaign
from stickslip.blind.generator.forms import EFFECTS
from stickslip.errors import InputError, RunFolderError
from stickslip.inference.diagnose.search_round import Round
from stickslip.inference.diagnose.work import Work
from stickslip.objects import next_experiment as module
from stickslip.objects.diagnosis import Diagnosis
from stickslip.objects.experiments import Setting, rival_experiments
from stickslip.objects.next_experiment import next_experiment
from stickslip.show.report.html import render
from stickslip.system.progress import Cancelled

pytestmark = pytest.mark.slow

SET = ("contact-ageing", "viscous-drag")
FORM = "logarithm"
KNOWN = {"text": "holds of 1 s and 10 s", "separates": list(SET)}


@pytest.fixture(scope="module")
def undecided(tmp_path_factory):
    """A campaign with contact ageing hidden, and a search that took it or a drag for what is missing."""
    folder = tmp_path_factory.mktemp("undecided") / "case"
    hidden = [("contact-ageing", 2.0 * detection(EFFECTS["contact-ageing"], FORM), FORM)]
    make_campaign(folder, 11, hidden, runs=(Run("v100", 1e-4, 4), Run("v400", 4e-4, 4)), spring_known=True)
    campaign = ss.load_campaign(folder / "campaign.toml")
    base = campaign.fit()
    fits = [base.add(tag) for tag in SET]
    close = tuple(
        SimpleNamespace(tag=t, candidate=SimpleNamespace(fit=f.force_fit)) for t, f in zip(SET, fits, strict=True)
    )
    ladder, prepared = base.climbed.ladder, base.climbed.prepared
    named = {SET[0]: Round(base.force_fit, (), (), close)}
    return campaign, SimpleNamespace(prepared=prepared, ladder=ladder, named=named)


def test_every_experiment_is_simulated_and_the_best_is_proposed(undecided, monkeypatch):
    campaign, found = undecided
    few = {"a hold of 1 s", "a hold of 100 s", "a block twice as heavy", "half the load"}
    usual = module.practicable
    monkeypatch.setattr(module, "practicable", lambda *args: {k: v for k, v in usual(*args).items() if k in few})
    said = []
    made = next_experiment(campaign, found, KNOWN, Work(tell=lambda text, share: said.append((text, share))))
    rows = made["experiments"]
    assert {row["experiment"] for row in rows} == few
    done = [row for row in rows if not row["note"]]
    assert len(done) == len(few)
    informed = [round(row["information"], 3) for row in done]
    assert informed == sorted(informed, reverse=True) and min(informed) >= 0.0 and max(informed) <= np.log(2.0) + 1e-9
    margins = {row["experiment"]: row["margin"] for row in done}
    assert margins["a hold of 100 s"] > margins["a hold of 1 s"] > 0.0  # ageing grows with the time in contact
    assert made["text"].startswith(rows[0]["experiment"]) and made["text"].endswith(KNOWN["text"])
    assert made["separates"] == list(SET) and json.loads(json.dumps(made)) == made
    page = render({"kind": "diagnose", "next_experiment": made}, [])
    assert all(f'<td class="text">{row["odds"]}</td>' in page for row in done)
    assert said and all(0.0 <= share <= 1.0 for _, share in said)
    table = Diagnosis(campaign, None, {"next_experiment": made}, {}).experiments
    assert list(table.index) == [row["experiment"] for row in rows] and table["margin"].iloc[0] == rows[0]["margin"]


def test_experiments_over_draws_of_the_posterior(undecided, monkeypatch):
    campaign, found = undecided
    few = {"a hold of 1 s", "a hold of 100 s"}
    usual = module.practicable
    monkeypatch.setattr(module, "practicable", lambda *args: {k: v for k, v in usual(*args).items() if k in few})
    said = []
    made = Diagnosis(campaign, found, {}, {})
    table = made.sampled_experiments(20, 20, progress=lambda text, share: said.append((text, share)))
    gaussian = next_experiment(campaign, found, KNOWN)["experiments"]
    assert set(table.index) == few and not table["note"].any()
    for row in gaussian:
        assert table["margin"][row["experiment"]] == pytest.approx(row["margin"], rel=0.5)
    assert table["margin"]["a hold of 100 s"] > table["margin"]["a hold of 1 s"] > 0.0
    assert any(text.startswith("posterior with contact-ageing") for text, _ in said)
    assert all(0.0 <= share <= 1.0 for _, share in said)


def test_sampled_experiments_need_models_and_a_set(undecided):
    campaign, found = undecided
    with pytest.raises(RunFolderError, match="only the result was kept"):
        Diagnosis(campaign, None, {}, {}).sampled_experiments()
    with pytest.raises(InputError, match="draws"):
        Diagnosis(campaign, found, {}, {}).sampled_experiments(1)
    alone = SimpleNamespace(**{**vars(found), "named": {}})
    with pytest.raises(InputError, match="no set of effects"):
        Diagnosis(campaign, alone, {}, {}).sampled_experiments(2)


def test_without_models_or_time_the_words_of_the_catalogue_stand(undecided):
    campaign, found = undecided
    of_geometry = SimpleNamespace(**{**vars(found), "named": {}})
    assert next_experiment(campaign, of_geometry, KNOWN) == KNOWN
    assert next_experiment(campaign, found, KNOWN, Work(in_time=lambda: False)) == KNOWN
    once = iter([True, False])
    assert next_experiment(campaign, found, KNOWN, Work(in_time=lambda: next(once))) == KNOWN
    assert next_experiment(campaign, found, None) is None
    sets = {**KNOWN, "others": [{"text": "weigh it", "separates": ["curvature", "roll-off"]}]}
    made = next_experiment(campaign, of_geometry, sets)
    assert made == sets


def test_a_law_that_fails_is_a_note_and_a_cancel_ends_it(monkeypatch):
    def failing(words, *rest):
        if words == "cancelled":
            raise Cancelled("")
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(rival_experiments, "_told", failing)
    found = rival_experiments.simulate_rivals(
        None, {}, {"one": Setting("v100"), "two": Setting("v100")}, lambda text, share: None
    )
    assert [t.note for t in found] == ["ZeroDivisionError: by zero"] * 2 and not found[0].recordings
    with pytest.raises(Cancelled):
        rival_experiments.simulate_rivals(None, {}, {"cancelled": Setting("v100")}, lambda text, share: None)
