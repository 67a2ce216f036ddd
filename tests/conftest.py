"""What every test shares."""

from __future__ import annotations

import os
import sys
from pathlib import Path

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


@pytest.fixture
def real_data():
    """Folder of measured data, or a skip that says where it was looked for."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data" / "real"
    folder = Path(os.environ.get("STICKSLIP_REAL_DATA", default))
    if not folder.is_dir():
        pytest.skip(f"measured data are not there ({folder}); set STICKSLIP_REAL_DATA to their folder")
    return folder
