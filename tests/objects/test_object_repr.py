"""What a console and a notebook show of measured runs: what one asks of them, not every sample."""

from pathlib import Path

import numpy as np
import pytest

import stickslip as ss

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


@pytest.fixture(scope="module")
def run():
    return ss.load_campaign(SHIPPED)["v050"]


def test_a_trace_shows_what_was_measured_with_units(run):
    text = repr(run)
    assert text.startswith("<Trace>") and "array" not in text and len(text) < 1000
    for said in ("run: v050", f"samples: {run.time.size}", "drive: 50 µm/s", "displacement: ", "to 477.7 µm"):
        assert said in text
    assert run._repr_html_().startswith("<div") and "run: v050" in run._repr_html_()


def test_a_name_from_a_file_is_escaped(run):
    assert "<script>" not in run.replace(name="<script>x</script>")._repr_html_()


def test_what_was_mended_and_what_is_not_known_is_seen():
    made = ss.Trace.from_arrays(time=np.arange(3.0), spring_force=[0.0, 1.0, 2.0])
    assert "drive" not in repr(made) and "spring_force: 0 N to 2 N" in repr(made)
    warned = made.replace(warnings=("the record ends within a slip",))
    assert "the record ends within a slip" in repr(warned)


def test_events_that_were_found_are_a_table(run):
    found = ss.find_events(run)
    text, html = repr(found), found._repr_html_()
    assert text.startswith("<Segmentation>") and "Phase(" not in text and len(text) < 3000
    assert f"slips: {len(found.events)}" in text and "slip (m)" in text and f"{found.events[1].t_onset:.4g}" in text
    assert html.count("<table") == 1 and "regime: stick-slip" in html


def test_events_are_a_table_to_go_on_with(run):
    found = ss.find_events(run)
    frame = found.to_dataframe()
    assert list(frame.index) == list(range(1, len(found.events) + 1))
    assert list(frame["slip (m)"]) == [event.slip for event in found.events]
    np.testing.assert_allclose(frame["onset (s)"].diff(), frame["recurrence (s)"], rtol=1e-12)
    assert ss.find_events(run, minimum_slip="1 mm").to_dataframe().empty
