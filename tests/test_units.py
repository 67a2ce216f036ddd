"""Quantities at the border: the short way for plain units and pint's for all others give the same numbers."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.simulation.scenario.overrides import si_value
from stickslip.system.units import _simple, shown, shown_with, to_si, unit_registry

UNITS = ("m", "s", "kg", "N", "Pa", "Hz", "m/s", "N/m", "N s/m", "m/Hz**0.5", "m/s**0.5", "1/m", "m**2", "kg/s", "K")
PREFIXES = ("", "p", "n", "u", "m", "k", "M", "G", "d", "c", "µ", "T")


@pytest.mark.parametrize("unit", UNITS)
def test_plain_units_are_read_as_pint_reads_them(unit):
    for prefix, number, gap in itertools.product(PREFIXES, ("50", "89.4", "0.31", "1e-3", "-2.5e+2"), (" ", "")):
        text = f"{number}{gap}{prefix}{unit}"
        found = _simple(text, unit)
        if found is not None:
            assert found == pytest.approx(unit_registry().Quantity(text).to(unit).magnitude, rel=1e-15)
    assert to_si(f"3 {unit}", unit) == 3.0
    assert (_simple(f"3 {unit}", unit) == 3.0) == unit[0].isalpha()


ASK = "from stickslip.system.units import to_si; print(to_si('3 mm per minute', 'm/s'))"


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["whole", "another installation", "cut", "garbage"])
def test_what_pint_keeps_of_another_installation_or_in_pieces_does_no_harm(tmp_path, damage):
    """Its cache names files of the installation it was made by, which may be gone."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "STICKSLIP_NO_CACHE": "0"}
    ask = [sys.executable, "-c", ASK]
    assert float(subprocess.run(ask, env=environment, capture_output=True, check=True).stdout) == pytest.approx(5e-5)
    kept = [path for path in (tmp_path / "stickslip" / "units").rglob("*") if path.is_file()]
    assert any(path.suffix == ".pickle" for path in kept)
    for path in kept:
        content = path.read_bytes()
        if damage == "another installation":
            gone = content.replace(b"site-packages", b"site-packageX")
            path.write_bytes(gone)
        elif damage != "whole":
            path.write_bytes(content[: len(content) // 2] if damage == "cut" else b"garbage")
    assert float(subprocess.run(ask, env=environment, capture_output=True, check=True).stdout) == pytest.approx(5e-5)


def test_a_prefix_is_not_taken_out_of_a_power_or_a_quotient():
    assert to_si("2 mm**2", "m**2") == pytest.approx(2e-6, rel=1e-12)
    assert to_si("90 g", "kg") == pytest.approx(0.09, rel=1e-15)
    assert to_si("0.05 mm/ms", "m/s") == pytest.approx(0.05, rel=1e-12)
    with pytest.raises(InputError, match="the unit is missing"):
        to_si("5", "m")
    with pytest.raises(InputError, match="not one of m"):
        to_si("5 s", "m")


def test_a_pure_number_has_no_unit_in_messages_either():
    assert to_si("0.3", "1") == 0.3
    with pytest.raises(InputError, match=r"(?s)no unit 'mm'.*allowed: a number without a unit$"):
        to_si("3 mm", "1")
    with pytest.raises(InputError, match=r"(?s)not a quantity.*allowed: a number without a unit$"):
        to_si([3], "1")
    with pytest.raises(InputError, match=r"(?s)allowed: finite: a number in m, or text such as '1 m'$"):
        to_si(float("nan"), "m")


def test_a_scenario_of_plain_units_needs_neither_pint_nor_xarray():
    """What makes the command line start quickly."""
    code = (
        "import sys; from stickslip.simulation.scenario import load_scenario; "
        "load_scenario('scenarios/grzemba2014.toml'); "
        "print(sorted({'pint', 'xarray', 'pandas', 'dask', 'scipy.ndimage', 'matplotlib'} & set(sys.modules)))"
    )
    root = __file__.rsplit("tests", 1)[0]
    seen = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert seen.stdout.strip() == "[]"


@pytest.mark.parametrize("text", ["1,31 N", "0,05 N", "1,5e3 N", "0.3.1 N", "1e3,5 N", "1 000 N", "1'000 N", "1. 5 N"])
def test_a_decimal_comma_is_never_read_as_something_else(text):
    with pytest.raises(InputError, match=r"(?s)decimal comma.*0\.05 mm/s"):
        to_si(text, "N")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (4.3e-5, "m", "43 µm"),
        (0.0894, "kg", "89.4 g"),
        (9.99996e-7, "m", "1 µm"),
        (-2.5e-3, "N", "-2.5 mN"),
        (1234.5, "1", "1234"),
        (250.0, "1/m", "250 1/m"),
        (0.15, "N s/m", "0.15 N s/m"),
        (5e-5, "m/s", "50 µm/s"),
        (0.0, "m", "0 m"),
        (3e-17, "m", "3e-05 pm"),
    ],
)
def test_quantities_are_shown_with_the_prefix_that_suits(value, unit, text):
    assert shown(value, unit) == text


@pytest.mark.parametrize(
    ("value", "std", "unit", "text"),
    [
        (1.72e-3, 9.6e-5, "1", "0.001720 ± 0.000096"),
        (0.26624, 5.3e-5, "N", "266.240 ± 0.053 mN"),
        (-0.7, 0.16, "1/m", "-0.70 ± 0.16 1/m"),
        (0.0894, 1e-4, "kg", "89.40 ± 0.10 g"),
        (1e-9, 5e-6, "m", "0.0 ± 5.0 µm"),
        (0.99, 0.0996, "1", "0.99 ± 0.10"),
        (1.2e-9, 5e-11, "1", "(1.2e-09 ± 5e-11)"),
        (3.0, 0.0, "m", "3 m"),
        (3.0, float("nan"), "m", "3 m"),
    ],
)
def test_a_value_and_its_deviation_have_one_unit_and_end_at_one_place(value, std, unit, text):
    assert shown_with(value, std, unit) == text


@pytest.mark.parametrize("number", [np.float32(0.5), np.float64(0.5), np.int64(3), np.uint8(3)])
def test_numbers_of_numpy_are_numbers(number):
    """As a row of a table, or a step of a loop over ``np.arange``, gives them."""
    found = to_si(number, "m/s")
    assert type(found) is float and found == number
    assert type(si_value(number, "drive.velocity")) is float


@pytest.mark.parametrize("other", [True, np.True_, 1j, None, [0.5], np.array([0.5, 1.0])])
def test_what_is_no_number_is_no_quantity(other):
    with pytest.raises(InputError, match="not a quantity"):
        to_si(other, "m/s")
