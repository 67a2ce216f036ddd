"""The page of the data, without a browser: what is drawn, what is stored, what is refused."""

from __future__ import annotations

import dataclasses
import shutil
import threading
import time
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.objects.campaign import Campaign
from stickslip.workbench import data_page, new_run_form
from stickslip.workbench.background_work import close_all
from stickslip.workbench.event_view import PARTS, EventView, part
from stickslip.workbench.file_names import new_place
from stickslip.workbench.new_run import NONE, Choice, add, appended, entry_text, guess, look
from stickslip.workbench.new_run_form import FirstRun, Form
from stickslip.workbench.overview import AROUND, DISPLACEMENT, FORCE, GAP, Levels, Window, record, reduced
from stickslip.workbench.session import Session
from stickslip.workbench.signals import Signals
from stickslip.workbench.worker import Worker

MARKUP = "<img src=x onerror=alert(1)>"
CSV = "time [s],x [um],F [mN]\n"


def _table(rows: int = 400) -> bytes:
    t = np.arange(rows) / 1e3
    return (CSV + "".join(f"{a:.4f},{10 * a:.4f},{0.1 * a:.4f}\n" for a in t)).encode()


@pytest.fixture
def own(folder, tmp_path):
    """A campaign of one run, in a folder of its own."""
    shutil.copy(folder / "v400.csv", tmp_path)
    text = (folder / "campaign.toml").read_text()
    head, *tables = text.split("[[trace]]")
    path = tmp_path / "campaign.toml"
    path.write_text("# kept as it is\r\n".replace("\r", "") + head + "[[trace]]" + tables[3].rstrip())
    return ss.load_campaign(path)


@pytest.mark.parametrize("place", [0, 1, 123_457, 499_998, 999_999])
def test_a_curve_keeps_its_extremes_however_it_is_looked_at(place):
    n = 1_000_000
    t = np.arange(n) / 1e4
    y = np.sin(t)
    y[place], y[n // 3] = 5.0, -7.0
    curve = Levels(t, y)
    for low, high in ((0.0, t[-1]), (t[place] - 3.0, t[place] + 20.0), (t[place] - 0.01, t[place] + 0.01)):
        times, values = curve(low, high, 2000)
        inside = (times >= low) & (times <= high)
        assert values[inside].max() == 5.0 and t[place] in times
        assert times.size <= 2004 and np.all(np.diff(times) > 0)
    assert curve(0.0, t[-1], 2000)[1].min() == -7.0


def test_a_reduced_curve_looks_like_the_whole():
    t = np.linspace(0.0, 1.0, 200_000)
    y = np.sin(40.0 * t)
    times, values = reduced(t, y, 0.0, 1.0, 3000)
    assert np.abs(np.interp(t, times, values) - y).max() < 1e-3
    few, _ = reduced(t, y, 0.5, 0.5001, 3000)
    assert few.size <= 23 and few[0] <= 0.5 and few[-1] >= 0.5001


def test_what_was_sent_serves_until_the_hand_leaves_it():
    window = Window((0.0, 100.0))
    assert window.needed(0.0, 100.0) == (0.0, 100.0)
    assert window.needed(0.0, 99.0) is None
    near = window.needed(50.0, 52.0)
    assert near == (50.0 - 2 * AROUND, 52.0 + 2 * AROUND)
    assert window.needed(50.5, 52.5) is None, "a short pan is served"
    assert window.needed(52.5, 54.5) is not None, "a long one is not"
    assert window.needed(53.0, 53.2) is not None, "nor is a zoom"
    assert window.needed(1.0, 1.0) is None


def test_the_page_shows_the_runs_and_what_is_selected(campaign):
    session = Session(campaign=campaign)
    signals, event = Signals(session), EventView(session)
    assert all(signals.figures[name].visible for name in (DISPLACEMENT, FORCE, GAP))
    data_page.select(session, "holds", 4)
    assert data_page.chosen(session) == ("holds", 4)
    onset = campaign.events[4].events[4].t_onset
    assert signals._mark[DISPLACEMENT].data["t"] == pytest.approx([onset])
    assert event.figures["slip"].title.text.startswith("slip of event 5") and len(event._others["slip"].data["t"]) == 9
    data_page.select(session, "holds", 400)
    assert data_page.chosen(session) == ("holds", 9)
    data_page.select(session, MARKUP, 0)
    assert data_page.chosen(session) == ("holds", 9)


def test_every_axis_has_its_unit(campaign):
    session = Session(campaign=campaign)
    signals, event = Signals(session), EventView(session)
    units = {name: f.yaxis.axis_label.partition(" / ")[2] for name, f in signals.figures.items() if f.visible}
    assert units == {DISPLACEMENT: "µm", FORCE: "mN", GAP: "µm"}
    assert signals.figures[GAP].xaxis.axis_label == "time / s"
    assert all("/ s" in f.xaxis.axis_label and "/ " in f.yaxis.axis_label for f in event.figures.values())


@pytest.mark.slow
def test_a_spring_force_that_nobody_measured_follows_from_the_stated_stiffness(campaign, base, monkeypatch):
    session = Session(campaign=campaign)
    made = Signals(session)
    gap, force = (made._curves[name][0].values for name in (GAP, FORCE))
    np.testing.assert_allclose(force, campaign.traces[0].spring_stiffness * gap, rtol=1e-12)
    assert made.figures[FORCE].visible and "not measured: stated stiffness, 980 N/m" in made.figures[FORCE].title.text
    unknown = [dataclasses.replace(t, spring_stiffness=None) for t in campaign.traces]
    monkeypatch.setattr(type(campaign), "__getitem__", lambda self, name: unknown[self.names.index(name)])
    bare = Signals(session)
    assert FORCE not in bare._curves and not bare.figures[FORCE].visible
    monkeypatch.setattr(type(base), "values", {**base.values, "rig.spring_stiffness": 500.0})
    session.first(base)
    assert "fitted stiffness, 500 N/m" in bare.figures[FORCE].title.text and bare.figures[FORCE].visible


def test_a_tap_near_a_mark_selects_and_one_far_from_it_does_not(campaign):
    session = Session(campaign=campaign)
    signals = Signals(session)
    onsets = [e.t_onset for e in campaign.events[0].events]

    class Tapped:
        model = signals.figures[GAP]
        x = onsets[5] + 0.01

    signals._tapped(Tapped)
    assert (session.run, session.event) == ("v050", 5)
    Tapped.x = 0.5 * (onsets[1] + onsets[2])
    signals._tapped(Tapped)
    assert session.event == 5


def test_parts_of_an_event_are_laid_on_onset_and_arrest(campaign):
    found = campaign.events[1]
    own = record(campaign.traces[1], found)
    made = {name: part(own, found, 3, name) for name in PARTS}
    event = found.events[3]
    t, x = made["slip"]
    assert np.interp(0.0, t, x) == pytest.approx(0.0, abs=1e-8)
    assert x[-1] == pytest.approx(event.slip, rel=0.02)
    assert made["creep"][0][-1] == pytest.approx(0.0, abs=1e-3) and made["creep"][0][0] < 0
    assert made["ring-down"][0][0] == pytest.approx(0.0, abs=1e-3)


def test_columns_are_guessed_by_name_and_unit():
    found = guess(look("run.csv", _table()))
    assert found.columns == {"time": "time", "displacement": "x", "spring_force": "F"}
    assert found.units == {"time": "s", "displacement": "um", "spring_force": "mN"}
    other = b"t (ms);stage position (mm);laser (um);v (mm/s)\n" + b"".join(
        b"%d;%d;%d;1\n" % (i, i, i) for i in range(9)
    )
    found = guess(look("a.csv", other))
    assert found.columns == {
        "time": "t", "drive_position": "stage position", "displacement": "laser", "velocity": "v",
    }  # fmt: skip


def test_a_file_like_the_others_is_taken_as_they_are(campaign, folder):
    found = guess(look("v400.csv", (folder / "v400.csv").read_bytes()), campaign)
    assert found.columns == {"displacement": "counts"} and found.units == {"displacement": "7.91 nm"}
    assert found.sampling_rate == "10000 Hz" and found.virgin


@pytest.mark.slow
def test_a_dropped_file_is_stored_and_the_campaign_grows(own, folder):
    session = Session(campaign=own)
    form, content = Form(session), (folder / "v200.csv").read_bytes()
    before = own.description.path.read_bytes()
    form.take("run 6.csv", content)
    assert form.velocity.value == ""
    form.velocity.value = "200 um/s"
    form.send()
    grown = session.campaign
    assert grown is not own and grown.names == ["v400", "run 6"]
    assert (own.description.folder / "run 6.csv").read_bytes() == content
    after = own.description.path.read_bytes()
    assert after.startswith(before) and after != before
    assert grown["run 6"].drive_velocity == pytest.approx(2e-4)
    assert sorted(p.name for p in own.description.folder.iterdir() if p.suffix != ".json") == [
        "campaign.toml", "run 6.csv", "v400.csv",
    ]  # fmt: skip
    assert form.dropped is None


@pytest.mark.parametrize(
    "name",
    ["../up.csv", "a/b.csv", "a\\b.csv", "/tmp/x.csv", "", "  ", ".hidden.csv", "..", "-out.csv", "a\nb.csv", "nul.csv",
     "c:x.csv", "x" * 200 + ".csv", "v400.csv", "V400.CSV", "other.toml", MARKUP],
)  # fmt: skip
def test_names_that_lead_elsewhere_or_are_taken_are_refused(own, name):
    before = {p.name: p.read_bytes() for p in own.description.folder.iterdir()}
    text = entry_text(
        "x.csv",
        Choice({"time": "time", "displacement": "x"}, {"time": "s", "displacement": "um"}, drive_velocity="1 um/s"),
    )
    with pytest.raises(InputError):
        add(own, name, _table(), text)
    assert {p.name: p.read_bytes() for p in own.description.folder.iterdir()} == before


def test_a_link_in_the_folder_leads_nowhere(own, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "target.csv"
    (own.description.folder / "link.csv").symlink_to(elsewhere)
    with pytest.raises(InputError, match="already"):
        new_place(own.description.folder, "link.csv")


def test_a_run_that_cannot_be_loaded_leaves_the_campaign_as_it_was(own):
    before = {p.name: p.read_bytes() for p in own.description.folder.iterdir()}
    back = "50 um/s until 5 s, 0 um/s until 3 s"
    choice = Choice({"time": "time", "displacement": "x"}, {"time": "s", "displacement": "um"}, drive_velocity=back)
    with pytest.raises(InputError) as told:
        add(own, "run.csv", _table(), entry_text("run.csv", choice))
    assert "campaign.toml" in str(told.value) and "drive" in str(told.value) and "adding" not in str(told.value)
    assert {p.name: p.read_bytes() for p in own.description.folder.iterdir()} == before


def test_what_is_wrong_is_said_in_the_form(own):
    form = Form(Session(campaign=own))
    form.take("bad.csv", b"\x00\x01\x02 nothing")
    assert form.dropped is None and "bad.csv" in form.said.text
    form.take("run.csv", _table())
    for channel in ("drive_position", "spring_force"):
        form.columns[channel].value = NONE
    form.velocity.value = "fast"
    form.send()
    assert "velocity of the load point" in form.said.text
    form.velocity.value, form.said.text = "", ""
    form.send()
    assert "velocity of the load point" in form.said.text and "campaign.toml" not in form.said.text
    form.columns["time"].value = NONE
    form.velocity.value = "50 um/s"
    form.send()
    assert "sampling rate" in form.said.text


def test_a_dropped_file_is_read_beside_and_only_its_own_window_asks(own, monkeypatch):
    seen, begin = [], threading.Event()

    def slow(name, content):
        seen.append(threading.current_thread())
        assert begin.wait(20)
        return look(name, content)

    monkeypatch.setattr(new_run_form, "look", slow)
    session = Session(campaign=own, worker=Worker())
    try:
        form, other = Form(session), Form(session)
        form.take("run.csv", _table())
        other.take("other.csv", _table())
        assert form.dropped is None and "another file" in other.said.text
        begin.set()
        end = time.monotonic() + 20
        while form.dropped is None and time.monotonic() < end:
            time.sleep(0.01)
        assert form.dropped == ("run.csv", _table()) and other.dropped is None
        assert seen != [threading.main_thread()] and len(seen) == 1
    finally:
        close_all(session)
        session.worker.close()


def test_a_file_that_is_too_large_is_refused_by_the_server(own, monkeypatch):
    monkeypatch.setattr(new_run_form, "LARGEST", 0.01)
    form = Form(Session(campaign=own))

    def send(name: str, content: bytes, chunks: int) -> None:
        for i, data in enumerate(np.array_split(np.frombuffer(content, np.uint8), chunks)):
            given = {"name": name, "chunk": i + 1, "total_chunks": chunks, "data": data.tobytes(), "type": "text/csv"}
            form.drop._process_event(SimpleNamespace(event_name="upload_event", data=given))

    send("large.csv", _table(1000), 5)
    assert "large.csv is larger than 0.01 MB" in form.said.text
    assert form.dropped is None and not form.drop.value and not form.drop._file_buffer
    send("run.csv", _table(), 3)
    assert form.dropped == ("run.csv", _table()) and "400 rows" in form.said.text
    send("other.csv", _table(300), 1)
    send("run.csv", _table(), 1)
    assert form.dropped[0] == "run.csv" and list(form.drop.value) == ["run.csv"]


@pytest.mark.slow
def test_a_file_that_is_dropped_where_nothing_is_open_begins_a_campaign(folder, base, tmp_path, monkeypatch):
    monkeypatch.setattr(Campaign, "fit", lambda self, effects=(): base)
    with closing(Session(home=tmp_path)) as session:
        form = FirstRun(session)
        form.take("v400.csv", (folder / "v400.csv").read_bytes())
        form.rate.value, form.velocity.value, form.units["displacement"].value = "10 kHz", "400 um/s", "7.91 nm"
        for name, mass, told in (("../rig", "", "cannot be used"), ("", "", "cannot be used"), ("rig", "3 N", "mass")):
            form.folder.value, form.mass.value = name, mass
            form.send()
            assert told in form.said.text and session.campaign is None and not list(tmp_path.iterdir())
        form.mass.value, form.spring.value = "89.4 g", "980 N/m"
        form.send()
        made = session.campaign
        assert [p.name for p in tmp_path.iterdir()] == ["rig"]
        assert made.description.path == tmp_path / "rig" / "campaign.toml"
        assert (made.rig.mass, made.rig.spring_stiffness) == pytest.approx((0.0894, 980.0))
        assert made["v400"].drive_velocity == pytest.approx(4e-4) and len(made.events[0].events) == 7
        assert session.fit is base


def test_a_drive_with_holds_can_be_given(own, folder):
    holds = "100 um/s until 4.3 s, 0 um/s until 5.3 s; 100 um/s until 7.6 s, 0 m/s until 12.6 s, 100 um/s until 15.2 s"
    choice = Choice({"displacement": "counts"}, {"displacement": "7.91 nm"}, "10 kHz", holds, virgin=True)
    grown = add(own, "holds.csv", (folder / "holds.csv").read_bytes(), entry_text("holds.csv", choice))
    assert grown["holds"].drive.breakpoints == pytest.approx([4.3, 5.3, 7.6, 12.6])
    assert len(grown.events[1].events) == 10
    for wrong in ("100 um/s until", "100 um/s until 4 um", "until 3 s", "1 um/s until 2 s, 3 um/s"):
        with pytest.raises(InputError, match="load point"):
            entry_text("x.csv", Choice({"displacement": "x"}, {"displacement": "um"}, "10 kHz", wrong))


def test_names_with_markup_are_quoted_in_the_file_and_shown_as_text(own):
    content = _table().replace(b"x [um]", MARKUP.encode() + b' "\\ [um]')
    columns = look("run.csv", content)
    choice = guess(columns)
    choice.columns["displacement"] = next(n for n in columns.data if "img" in n)
    choice.units["displacement"], choice.drive_velocity, choice.name = "um", "10 um/s", MARKUP
    choice.columns.pop("spring_force", None)
    grown = add(own, "run.csv", content, entry_text("run.csv", choice, columns.units))
    assert grown.names[-1] == MARKUP
    _, rows = data_page.run_rows(grown)
    assert rows[-1][0] == MARKUP  # the table sets it as text


def test_a_table_more_leaves_the_file_byte_for_byte():
    for old, end in ((b"a = 1", b"\n"), (b"a = 1\r\nb = 2\r\n", b"\r\n"), (b"\xef\xbb\xbfa = 1\n", b"\n")):
        new = appended(old, "[[trace]]\nfile = 'x'\n")
        assert new.startswith(old) and new.endswith(b"[[trace]]" + end + b"file = 'x'" + end)


@pytest.mark.slow
def test_events_are_listed_in_the_unit_and_to_the_place_of_their_deviations(campaign):
    found = data_page.Looked(campaign, campaign.events, campaign.inspect())
    heads, rows = data_page.event_rows(found, "v050")
    at = next(i for i, head in enumerate(heads) if head.startswith("slip / µm ± "))
    std = heads[at].split("± ")[1]
    trace = found.inspection.result["traces"][0]
    assert float(std) == pytest.approx(1e6 * trace["features"]["slip"]["sensor"], rel=0.1)
    for row, event in zip(rows, trace["events"], strict=True):
        assert float(row[at]) == pytest.approx(1e6 * event["slip"], abs=float(std))
        assert len(row[at].partition(".")[2]) == len(std.partition(".")[2])
    assert rows[0][heads.index(next(h for h in heads if h.startswith("recurrence / s")))] == "-"


@pytest.mark.slow
def test_what_the_data_tell_is_said(campaign):
    session = Session(campaign=campaign)
    assert data_page.page(session) is not None
    found = data_page.background(session, "inspection").found
    told = {g["head"]: g["items"] for g in data_page.groups(found)}
    assert told["Can tell"] == campaign.inspect().can and told["Repaired or left out"] == ["nothing"]
    columns, rows = data_page.event_rows(found, "v100")
    ringing = next(i for i, head in enumerate(columns) if head.startswith("ringing / Hz ± "))
    assert len(rows) == 7 and float(rows[3][ringing]) > 100.0
