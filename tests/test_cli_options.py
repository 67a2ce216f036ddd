"""Commands list their options themselves, for help must not import the library: they are those of the functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import pytest

from stickslip.blind.make import make_challenge
from stickslip.blind.run import run_challenge
from stickslip.blind.score import score_challenge
from stickslip.cli import challenge, creep, diagnose, fit, forecast
from stickslip.objects.diagnosis import diagnose as diagnose_function
from stickslip.objects.fit import fit as fit_function
from stickslip.objects.forecast import forecast as forecast_function
from stickslip.objects.static_fit import fit_static
from stickslip.simulation.scenario import static_creep
from stickslip.system.units import to_si

TOLD = {"progress", "tell", "note"}  # who is told, in Python only
CALLED = {"effects": "add", "profiles": "profile", "expected": "seal"}
PAIRS = (  # and what only Python has, for other methods and for messages
    (diagnose.diagnose, diagnose_function, set()),
    (forecast.forecast, forecast_function, set()),
    (fit.fit, fit_static, set()),
    (fit.fit, fit_function, {"key"}),
    (challenge.make, make_challenge, {"own"}),
    (challenge.score, score_challenge, set()),
    (creep.creep, static_creep, set()),
    (challenge.run, run_challenge, {"diagnosis"}),
)


def defaults(function: Callable[..., Any]) -> dict[str, Any]:
    return {name: p.default for name, p in inspect.signature(function).parameters.items()}


@pytest.mark.parametrize(("command", "function", "inner"), PAIRS, ids=lambda p: getattr(p, "__qualname__", ""))
def test_a_command_has_the_arguments_of_its_function_with_the_same_defaults(command, function, inner):
    options, arguments = defaults(command), defaults(function)
    for name, value in arguments.items():
        if name in TOLD | inner:
            continue
        option = CALLED.get(name, name)
        assert option in options, name
        given = options[option]
        if isinstance(given, str) and isinstance(value, float):
            given = to_si(given, "m/s", key=name)
        if value is not inspect.Parameter.empty:
            assert given == value, name
