"""An effect is compared with a model that had the same chance to arrive."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.cli import _inertial
from stickslip.cli.fit import _gains_of_effects


def optimum(cost, free=2):
    return SimpleNamespace(cost=cost, z=np.zeros(free), events=None, free=(None,) * free)


@pytest.mark.parametrize(("again", "base"), [(514.2, 514.2), (600.0, 537.8)])
def test_the_model_without_the_effect_is_fitted_again_from_where_it_arrived(monkeypatch, again, base):
    asked = {}

    def fit(problem, floor, **how):
        asked.update(how)
        return optimum(again)

    found = SimpleNamespace(fit=optimum(514.0, 4), composition=SimpleNamespace(free=(0, 0, 0, 0)), note="")
    monkeypatch.setattr(_inertial, "Problem", lambda composition, m: SimpleNamespace(threads=1))
    monkeypatch.setattr(_inertial, "best_of", lambda *a, **k: optimum(537.8))
    monkeypatch.setattr(_inertial, "try_effect", lambda *a, **k: found)
    monkeypatch.setattr(_inertial, "fit", fit)
    monkeypatch.setattr(_inertial, "_static_step", lambda *a: {"model": ["static"], "added": None})
    monkeypatch.setattr(
        _inertial, "_step",
        lambda problem, fit, floor, train, model, added: {
            "model": model, "added": added, "cost": fit.cost, "parameters": len(fit.free),
        },
    )  # fmt: skip
    base_model, effect = SimpleNamespace(free=(0, 0)), SimpleNamespace(tag="viscous-drag")
    _, last, ladder = _inertial._climb(None, base_model, [effect], None, None, 4, lambda *a: None)
    assert last.cost == 514.0
    assert [step.get("cost") for step in ladder] == [None, base, 514.0]
    assert asked["z"].size == 2
    (line,) = _gains_of_effects(ladder)
    gain = {514.2: "0.2", 537.8: "23.8"}[base]
    assert line.startswith(f"viscous-drag takes {gain} off the cost")
    assert line.endswith(f"{base} without, 514.0 with it and 2 more free parameters")


def test_an_effect_that_takes_nothing_off_is_said_to():
    ladder = [{"added": None}, {"added": "inertia", "cost": 512.4, "parameters": 8},
              {"added": "wear", "cost": 513.9, "parameters": 9}]  # fmt: skip
    assert _gains_of_effects(ladder)[0].startswith("wear takes nothing off the cost")
