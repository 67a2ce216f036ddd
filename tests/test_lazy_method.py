"""A method whose function stands elsewhere is like any other method, and costs nothing until it is asked for."""

from __future__ import annotations

import inspect
import pickle
import subprocess
import sys

import pytest

import stickslip as ss
from stickslip.objects.diagnosis import diagnose


def test_signature_text_and_name_are_those_of_the_function():
    method = ss.Campaign.diagnose
    assert inspect.signature(method) == inspect.signature(diagnose) and method.__doc__ == diagnose.__doc__
    assert inspect.isfunction(method) and method.__qualname__ == "Campaign.diagnose"
    assert pickle.loads(pickle.dumps(method)) is method  # noqa: S301
    assert diagnose.__qualname__ == "diagnose"
    with pytest.raises(TypeError, match=r"Campaign\.diagnose\(\) .* 'holdot'"):
        method(None, holdot="v050")


def test_it_is_imported_when_it_is_asked_for():
    code = (
        "import sys, stickslip as ss; ss.Campaign; name = 'stickslip.objects.forecast'; before = name in sys.modules; "
        "ss.Campaign.forecast; print(before, name in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["False", "True"]
