"""What the pages show, without a browser."""

from __future__ import annotations

import http.client
import io
import re
import urllib.error
import urllib.request
from types import SimpleNamespace

import numpy as np
import panel as pn
import pytest
from bokeh.resources import INLINE

import stickslip.workbench
from stickslip.inference.fit.parameters import effect_parameters
from stickslip.inference.force.candidates import every_form, try_effect
from stickslip.inference.force.first_order import promise
from stickslip.inference.force.signatures import Explained
from stickslip.objects.diagnosis import Diagnosis
from stickslip.physics.effects import catalogue
from stickslip.system.units import shown, shown_with, to_si
from stickslip.workbench import (
    app,
    backbone_view,
    curves,
    error_map,
    history_text,
    keep_page,
    ladder_view,
    missing_page,
    model_page,
    phase_period,
    residual_view,
)
from stickslip.workbench.evidence import best_forms, bins, rows, signature
from stickslip.workbench.figures import DARK, LIGHT
from stickslip.workbench.free_panel import Free
from stickslip.workbench.parameter_sliders import Knob, given, knobs
from stickslip.workbench.parameter_sliders import rows as knob_rows
from stickslip.workbench.session import Session
from stickslip.workbench.session_callbacks import Place

from .page_outline import OUTLINE, outline

pytestmark = pytest.mark.slow

LISTED = ("contact-ageing", "drive-ripple", "sensor-drift", "viscous-drag")


@pytest.fixture
def session(campaign, base, monkeypatch):
    made = Session(campaign=campaign)
    monkeypatch.setattr(made, "list_promises", lambda: None)
    made.first(base)
    return made


@pytest.fixture(scope="module")
def promises(base):
    explained = Explained(base.force_fit)
    return [promise(base.force_fit, explained, tag, form) for tag, form in every_form(LISTED)]


def test_a_slider_shows_and_gives_back_its_value(base):
    made = knobs(base)
    assert set(made) == {"contact.strength", *(f.name for f in base.free)}
    for name, knob in made.items():
        value = base.values[name]
        assert knob.value(knob.place(value)) == pytest.approx(value, rel=1e-9)
        assert knob.value(-1.0) == knob.value(0.0) < knob.value(0.5) < knob.value(1.0)
        base.with_values({name: knob.value(0.0)}), base.with_values({name: knob.value(1.0)})
    for row in knob_rows(base, base, made, {"weakening.drop"}):
        assert row["band"][0] <= row["place"] <= row["band"][1]
        assert row["locked"] == (row["name"] == "weakening.drop")
        number, deviation, unit = re.fullmatch(r"(-?[\d.]+) ± ([\d.]+) ?(.*)", row["text"]).groups()
        assert len(number.partition(".")[2]) == len(deviation.partition(".")[2])  # to the same place, in one unit
        shown_value = to_si(f"{number} {unit}".strip(), made[row["name"]].free.unit)
        assert shown_value == pytest.approx(base.values[row["name"]], rel=0.1)


def test_a_slider_reaches_the_bounds_of_a_parameter():
    free = next(f for f in effect_parameters(catalogue.make("rate-and-state")) if f.name.endswith("cutoff_velocity"))
    knob = Knob(free, *free.bounds, "")
    assert free.lower <= knob.value(0.0) < knob.value(1.0) <= free.upper


def test_the_pages_are_made_and_follow(session, base):
    model, missing = model_page.page(session), missing_page.page(session)
    assert model is not None and missing is not None
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.02})
    session.undo()


def test_a_saved_view_and_every_page_give_bokeh_the_sizes_that_it_asks_for(session, base, caplog):
    for made in (stickslip.workbench.view(base), *(app.module(name).page(session) for name in app.TITLES)):
        made.save(io.StringIO(), resources=INLINE)
    assert not [record.message for record in caplog.records if "SIZING" in record.message]


def test_the_slip_is_run_freely_and_follows_the_model(session, base):
    """With a larger drop of the strength slips are longer; drawn is the selected cycle on its measured clock."""
    panel = Free(session)
    assert "early" in panel.words.text
    model, measured = (np.array(d.data["x"]) for d in (panel._model, panel._measured))
    assert model.max() == pytest.approx(measured.max(), rel=0.02)
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.05})
    assert np.max(panel._model.data["x"]) > 1.03 * model.max()
    assert session.free[0] is session.fit
    session.run, session.event = "holds", 2
    assert session.free[1] == "holds"
    session.undo()
    assert session.free[0] is base


def test_the_nearest_rough_lines_are_drawn_beside_the_backbone(session, base):
    made = backbone_view.Backbone(session)
    assert "H = " in made.words.text
    drawn, curve = np.array(made._line.data["force"]), np.array(made._data.data["force"])
    assert drawn.size == curve.size and np.abs(drawn - curve).max() < 0.2 * curve.max()


def test_the_pictures_of_the_docs_are_of_these_pages(session):
    now, then = outline(session).splitlines(), OUTLINE.read_text(encoding="utf-8").splitlines()
    assert now == then, "python docs/make_workbench.py makes them anew"


def test_curves_of_many_runs_are_distinguishable(session, monkeypatch):
    names = [f"run {i}" for i in range(28)]
    monkeypatch.setattr(type(session.campaign), "names", names)
    part = residual_view.Residual(session)
    drawn = {r.data_source.id: (r.glyph.line_color, str(r.glyph.line_dash)) for r in part.figure.renderers}
    assert len({drawn[part._medians[name].id] for name in names}) == len(names)


@pytest.mark.parametrize("module", map(app.module, app.PAGES))
def test_every_axis_says_what_is_on_it(session, module):
    made = module.page(session)
    for pane in made.select(pn.pane.Bokeh):
        for axis in pane.object.axis:
            below = axis.major_label_text_font_size == "0px"  # the axis of the figure below is its own
            said = axis.axis_label or (axis in pane.object.yaxis and " / " in pane.object.title.text)
            assert said or below or not pane.object.visible, pane.object.title.text


def test_errors_and_the_law_of_the_backbone_have_their_deviations(session, base):
    errors = [shown_with(base.error, base.error_std), shown_with(base.unseen_error, base.unseen_error_std)]
    assert all("±" in text for text in errors)
    assert app.frame(session).errors == f"error {errors[0]} fitted, {errors[1]} unseen"
    assert history_text.rows(session)[0][3:5] == errors
    ladder = ladder_view.Ladder(session)
    assert all(text in ladder.table.object for text in errors)
    hover = [ladder._data.data[name][-1] for name in ("fitted_text", "unseen_text")]
    assert hover == [shown_with(base.error, base.error_std), shown_with(base.unseen_error, base.unseen_error_std)]
    texts = error_map.ErrorMap(session)._data.data["text"]
    assert f"{base.error:.2f}\n±{base.error_std:.2f}" in texts and sum("±" in t for t in texts) > 0.8 * len(texts)
    law = base.backbone.attrs
    told = backbone_view.Backbone(session).words.text
    assert (
        f"u_max = {shown_with(law['u_max'], law['u_max_std'], 'm')}, p = {shown_with(law['p'], law['p_std'])}" in told
    )
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.02})
    moved = session.fit
    assert f"error {shown_with(moved.error, moved.error_std)} by hand" in app.frame(session).errors


def test_the_pages_are_made_before_there_is_a_model(campaign):
    session = Session(campaign=campaign)
    for module in (model_page, missing_page):
        assert module.page(session) is not None


def test_a_page_that_fails_says_so_and_leaves_the_others(session, monkeypatch):
    def broken(session):
        raise ValueError("<b>oh</b>")

    monkeypatch.setattr(keep_page, "page", broken)
    assert "oh" in app._made("keep_page", session).object


def test_the_residual_is_folded_over_a_period(session, base):
    part = residual_view.Residual(session)
    part.against.value, part.period.value = "load point", "20 um"
    assert "phase of load point" in part.figure.xaxis.axis_label
    force = base.force
    run = str(force.run.values[0])
    use = (force.run.values == run) & ~force.left_out.values
    turns = np.sort(np.mod(force.load_point.values[use] / 20e-6, 1.0))
    assert part._points[run].data["x"] == pytest.approx(turns)
    for wrong in ("20", "20 s", "-1 um", "0 um", "wide"):
        session.said = ""
        part.period.value = wrong
        assert session.said and "phase" not in part.figure.xaxis.axis_label
    part.against.value = "velocity"
    assert part.period.disabled


def test_the_phase_of_the_drive_is_of_what_is_stated_or_of_a_periodic_effect_in_the_model(session, base, monkeypatch):
    part = residual_view.Residual(session)
    part.against.value = "phase of the drive"
    assert "no effect in the model is periodic" in session.said
    force = base.force
    run = str(force.run.values[0])
    use = (force.run.values == run) & ~force.left_out.values
    for text, variable, period in (("20 um", "load_point", 20e-6), ("20 ms", "time", 0.02), ("40 Hz", "time", 0.025)):
        part.period.value = text
        turns = np.sort(np.mod(force[variable].values[use] / period, 1.0))
        assert part._points[run].data["x"] == pytest.approx(turns), text
        assert part.figure.xaxis.axis_label.startswith("phase of ") and "periods" in part.figure.xaxis.axis_label
        assert session.said == ""
    part.period.value = "5 kg"
    assert "50 Hz" in session.said
    for tag, name, value, found in (
        ("drive-ripple", "pitch", 1e-4, ("load point", 1e-4)), ("load-modulation", "frequency", 25.0, ("time", 0.04)),
    ):  # fmt: skip
        effect = SimpleNamespace(tag=tag)
        problem = SimpleNamespace(composition=SimpleNamespace(effects=(effect,)))
        fit = SimpleNamespace(force_fit=SimpleNamespace(problem=problem), values={f"{tag}.{name}": value})
        assert phase_period.drive("", fit) == found


def test_the_effect_that_is_laid_over_is_drawn_over_all_else(session, base, promises):
    made = residual_view.Residual(session)
    session.promises, made.chosen = promises, promises[0].tag
    made.update()
    last = made.figure.renderers[-1].data_source
    assert last is made._law and len(last.data["x"]) > 3


def test_an_effect_in_the_model_is_laid_over_as_what_it_takes_off(campaign, base, aged):
    session = Session(campaign=campaign)
    session.first(aged)
    made = residual_view.Residual(session)
    made.chosen = "contact-ageing"
    made.update()
    x, y = (np.asarray(made._law.data[name]) for name in "xy")
    bare = aged.with_values({"contact-ageing.rate": 0.0})
    data, parts = aged.force, bins(aged, "age")
    taken = (bare.force.residual - data.residual).values / data.floor.values
    np.testing.assert_allclose(y, [np.median(taken[p]) for p in parts], rtol=1e-9)
    assert x.size == len(parts) and np.ptp(y) > 1.0


def test_what_the_file_states_of_the_rig_is_shown(base):
    rig = base.campaign.rig
    assert {row["label"]: row["text"] for row in given(base)} == {
        "spring stiffness": shown(rig.spring_stiffness, "N/m"), "mass": shown(rig.mass, "kg"),
    }  # fmt: skip
    assert not set(knobs(base)) & {"rig.mass", "rig.spring_stiffness"}


def test_legends_name_what_is_drawn_from_the_first_look_on(session):
    cycle, ladder = model_page.Cycle(session), ladder_view.Ladder(session)
    for figure in (cycle.force, cycle.residual, cycle.creep, ladder.figure):
        (legend,) = figure.legend
        assert [item.visible for item in legend.items] == [True] * len(legend.items), figure.title.text
    residual = residual_view.Residual(session)
    hidden = [item.label.value for item in residual.figure.legend[0].items if not item.visible]
    assert hidden == ["part explained by the chosen effect"]  # for none is chosen


def test_an_error_of_five_floors_is_seen_beside_one_of_sixty():
    blue = [int(error_map.colour(value, 60.0)[5:], 16) for value in (1.0, 5.0, 60.0)]
    assert blue[0] - blue[1] > 0.3 * (blue[0] - blue[2]) > 0


def test_the_slip_path_is_the_way_there_and_back(base):
    force = base.force
    for run in np.unique(force.run.values):
        own = force.isel(point=np.flatnonzero(force.run.values == run))
        path = own.slip_path.values[np.argsort(own.time.values)]
        assert (np.diff(path) >= 0.0).all() and path[-1] >= np.ptp(own.displacement.values) * 0.999


def test_a_slider_sends_only_what_can_be_used(session, base):
    part = model_page._sliders(session)
    for message in (
        {"kind": "move", "name": "nothing", "place": 0.5},
        {"kind": "move", "name": "weakening.drop", "place": "half"},
        {"kind": "move", "name": "weakening.drop", "place": float("nan")},
        {"kind": "move", "name": ["weakening.drop"], "place": 0.5},
        {"kind": "dance"},
        "move",
        None,
    ):
        part._handle_msg(message)
    assert session.fit is base
    part._handle_msg({"kind": "move", "name": "weakening.drop", "place": 0.9, "first": True})
    assert session.fit.by_hand


def test_the_hidden_effect_promises_most(promises):
    best = best_forms(promises)
    assert best[0].tag == "contact-ageing" and best[0].fall > 3.0 * best[1].fall
    assert {p.tag for p in best} == set(LISTED)


def test_a_promise_is_what_the_trial_of_an_effect_begins_with(base, promises):
    (found,) = try_effect(base.force_fit, Explained(base.force_fit), "viscous-drag", [{}])
    quick = next(p for p in promises if p.tag == "viscous-drag")
    assert quick.fall == pytest.approx(found.promise, rel=0.02)


def test_what_a_promise_takes_off_brings_the_cost_down(base, promises):
    from stickslip.inference.force.scatter import covariance

    fit = base.force_fit
    found = next(p for p in promises if p.tag == "contact-ageing")
    _, whole = covariance(fit.scatter.sizes, fit.known)
    inverse = np.linalg.inv(np.asarray(whole))

    def chi2(residual):
        side = fit.blocks(residual)
        return float(np.einsum("ei,eij,ej->", side, inverse, side))

    fallen = chi2(fit.marginal) - chi2(fit.marginal - found.force)
    assert fallen == pytest.approx(found.fall, rel=0.1)


def test_the_catalogue_has_its_rows(base, promises):
    made = rows(base, promises, None, "age", chosen="drive-ripple")
    assert made[0]["tag"] == "contact-ageing"
    assert [r["tag"] for r in made if r["chosen"]] == ["drive-ripple"]
    assert made[0]["share"] == 1.0 and all(0.0 <= r["share"] <= 1.0 for r in made)
    assert "±" in made[0]["amplitude"] and "similar to" in made[0]["similar"]
    assert all(0.0 <= y <= 1.0 for curve in made[0]["picture"] for _, y in curve)


def test_the_catalogue_shows_what_a_diagnosis_found(campaign, base, promises):
    ranked = {"effect": "contact-ageing", "gain": 955.0, "heldout_cost": 900.0, "heldout_cost_std": 30.0, "note": "",
              "heldout_error": 0.96, "amplitude": {"value": 0.003, "std": 1e-4, "unit": "1"}}  # fmt: skip
    found = Diagnosis(campaign, None, {"ranking": [ranked], "visible": {}}, {})
    made = rows(base, promises, found, "age")
    assert made[0]["gain"] == "gains 955 when fitted" and made[0]["unseen"] == "on unseen runs 900 ± 30"
    assert rows(base, (), found, "age")[0]["tag"] == "contact-ageing"


def test_the_catalogue_is_in_the_order_of_what_it_shows(campaign, base, promises):
    ranked = [
        {"effect": tag, "gain": gain, "heldout_cost": gain, "heldout_cost_std": 1.0, "note": "", "heldout_error": 1.0,
         "amplitude": {"value": 0.003, "std": 1e-4, "unit": "1"}}
        for tag, gain in (("drive-ripple", 2000.0), ("contact-ageing", 955.0), ("viscous-drag", 1500.0))
    ]  # fmt: skip
    made = rows(base, promises, Diagnosis(campaign, None, {"ranking": ranked, "visible": {}}, {}), "age")
    assert [r["tag"] for r in made][:3] == ["drive-ripple", "viscous-drag", "contact-ageing"]


def test_an_effect_in_the_model_shows_what_it_takes_off(aged):
    (made,) = rows(aged, (), None, "age")
    before, after = made["unseen"].removeprefix("error on unseen runs ").split(" to ")
    assert after == shown_with(aged.unseen_error, aged.unseen_error_std) and "±" in after
    assert float(before.split()[0]) > 2.0 * aged.unseen_error
    residual, law, _ = (np.array(curve) for curve in made["picture"])
    assert np.corrcoef(residual[:, 1], law[:, 1])[0, 1] > 0.9


def test_a_signature_of_another_model_is_not_drawn(base):
    assert signature(base, np.zeros(3), []) == []
    assert signature(base, np.zeros(3), [np.arange(3)]) == []


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_text_can_be_read_on_what_is_behind_it(theme):
    def luminance(colour):
        parts = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    def contrast(one, other):
        high, low = sorted((luminance(one), luminance(other)), reverse=True)
        return (high + 0.05) / (low + 0.05)

    for behind in (theme.surface, theme.page):
        assert contrast(theme.text, behind) > 7.0
        assert contrast(theme.soft, behind) > 4.5
        assert contrast(theme.accent, behind) > 4.5
        assert min(contrast(c, behind) for c in (*theme.runs, theme.model, theme.measured)) > 2.2


def test_a_page_behind_another_follows_when_it_is_seen():
    done: list[str] = []
    place = Place()

    def update():
        done.append("update")

    place.call(update)
    place.hide()
    place.call(update)
    place.call(update)
    assert len(done) == 1
    place.show()
    assert len(done) == 2
    place.show()
    assert len(done) == 2


def test_a_notebook_shows_the_same_pages(campaign, base, monkeypatch):
    import stickslip as ss

    monkeypatch.setattr(type(campaign), "fit", lambda self, **_: base)
    monkeypatch.setattr(Session, "list_promises", lambda self: None)
    shown = ss.workbench(campaign)
    assert f'<iframe src="{shown.url}"' in shown._repr_html_() and shown.url in repr(shown)
    page = urllib.request.urlopen(shown.url, timeout=30).read().decode()
    assert "<title>stickslip" in page and "cdn." not in page
    with pytest.raises(urllib.error.HTTPError):  # without the token
        urllib.request.urlopen(shown.url.rsplit("/", 2)[0] + "/", timeout=30)
    assert "on the machine of the kernel" in repr(shown) and repr(shown) in shown._repr_html_()
    with shown:
        pass
    assert "closed" in repr(shown) and "iframe" not in shown._repr_html_()
    with pytest.raises(urllib.error.URLError, match="refused"):
        urllib.request.urlopen(shown.url, timeout=30)
    shown.close()


def test_a_notebook_of_a_hub_shows_them_through_its_proxy(campaign, base, monkeypatch):
    import stickslip as ss

    monkeypatch.setattr(type(campaign), "fit", lambda self, **_: base)
    monkeypatch.setattr(Session, "list_promises", lambda self: None)
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/me/")
    with ss.workbench(campaign) as shown:
        port, token = re.fullmatch(r"/user/me/proxy/(\d+)/([\w-]+)/", shown.url).groups()
        assert f'src="{shown.url}"' in shown._repr_html_() and "of the kernel" not in repr(shown)
        connection = http.client.HTTPConnection(f"127.0.0.1:{port}", timeout=30)
        upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
        key = {"Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg==", "Origin": "https://hub.example.org"}
        connection.request("GET", f"/{token}/ws", headers={**upgrade, **key})
        assert connection.getresponse().status != 403
    with ss.workbench(campaign, proxy="") as shown:
        assert shown.url.startswith("http://127.0.0.1:")


def test_of_many_steps_the_first_by_hand_are_forgotten(session, base, monkeypatch):
    monkeypatch.setattr("stickslip.workbench.history_steps.MOST", 3)
    for share in (1.01, 1.02, 1.03, 1.04, 1.05):
        session.by_hand({"weakening.drop": base.values["weakening.drop"] * share})
    assert len(session.steps) == 4 and session.steps[0].fit is base
    assert session.fit.values["weakening.drop"] == pytest.approx(1.05 * base.values["weakening.drop"])


def test_the_smooth_curve_is_that_of_the_law_and_not_of_the_noise():
    rng = np.random.default_rng(0)
    x = rng.uniform(0.0, 6.0, 4000)
    at, curve = curves.smooth(x, np.sin(x) + rng.normal(size=x.size))
    assert np.sqrt(np.mean((curve - np.sin(at)) ** 2)) < 0.08 and at.size == 200
    assert curves.smooth(np.ones(100), np.ones(100))[0].size == 0
    assert curves.smooth(np.zeros(0), np.zeros(0))[0].size == 0


def test_what_all_runs_ask_for_is_drawn(session):
    part = residual_view.Residual(session)
    for against in ("age", "velocity", "event", "time"):
        part.against.value = against
        assert np.isfinite(part._smooth.data["y"]).all() and len(part._smooth.data["x"]) == 200
