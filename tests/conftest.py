"""What every test shares."""

from __future__ import annotations

import sys

import pytest

from stickslip.system.threads import alone, one_for_linear_algebra

one_for_linear_algebra()
alone(False)  # tests run in processes side by side


@pytest.fixture(autouse=True, scope="module")
def _bounded_memory():
    """Compiled programs of one module are of no use to the next, and some hundred of them fill gigabytes."""
    yield
    if "jax" in sys.modules:
        sys.modules["jax"].clear_caches()
