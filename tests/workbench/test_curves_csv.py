"""What a figure saves as CSV, by Chromium without a screen; and the pictures of a fit in a page of their own."""

from __future__ import annotations

import io
import re
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import panel as pn
import pytest
from bokeh.embed import file_html
from bokeh.models import CustomAction, Plot
from bokeh.resources import INLINE

import stickslip as ss
from stickslip.errors import ArgumentError
from stickslip.objects.fit_plots import AGAINST
from stickslip.workbench.curves import bent
from stickslip.workbench.figures import compared, figure, label, legend, source

from .test_browser import CHROMIUM

in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
CAUGHT = """
<script>
HTMLAnchorElement.prototype.click = function () { document.title = this.download }
URL.createObjectURL = (blob) => {
  const shown = document.createElement("pre")
  shown.id = "saved"
  blob.text().then((text) => { shown.textContent = text; document.body.replaceChildren(shown) })
  return "#"
}
const wait = setInterval(() => {
  const tool = window.Bokeh && Bokeh.documents.map((d) => d.get_model_by_id("ACTION")).find((m) => m)
  if (tool) { clearInterval(wait); tool.callback.execute(tool) }
}, 50)
</script></body>
"""


def saved(page: str, made: Any, folder: Path) -> tuple[str, pd.DataFrame]:
    """Name and content of the file that a figure of a page gives."""
    (action,) = [tool for tool in made.tools if isinstance(tool, CustomAction)]
    path = folder / "page.html"
    before, _, after = page.rpartition("</body>")
    path.write_text(before + CAUGHT.replace("ACTION", action.id) + after, encoding="utf-8")
    shown = subprocess.run(
        [str(CHROMIUM), "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--enable-unsafe-swiftshader",
         f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=10000", "--dump-dom", path.as_uri()],
        capture_output=True, text=True, timeout=120,
    ).stdout  # fmt: skip
    name, text = re.search(r"<title>(.*?)</title>", shown), re.search(r'<pre id="saved">(.*?)</pre>', shown, re.DOTALL)
    assert name and text, shown[-500:]
    return unescape(name[1]), pd.read_csv(io.StringIO(unescape(text[1]).removeprefix("\ufeff")))


@in_chromium
@pytest.mark.slow
def test_the_curves_of_a_figure_are_saved_with_units_and_names(tmp_path):
    rng = np.random.default_rng(1)
    t, x, y = (rng.normal(size=7) for _ in range(3))
    y[3] = np.nan
    made = figure(y=label("force, of the contact", "mN"), height=200, tags=[label("time", "s")])
    one, other = source(t=t, measured=x), source(t=t[:4], model=y[:4])
    compared(made, one, other, ("measured", "model"), "the model")
    made.scatter("t", "measured", source=one)  # markers of the same curve
    made.varea("t", "low", "high", source=source(t=t[:2], low=[-1.0, -2.0], high=[1.0, 2.0]), legend_label="band")
    made.multi_line("ts", "ys", source=source(ts=[[1, 2], [3]], ys=[[4, 5], [6]]), name="others")
    size = np.array([0.0, 0.5, 20.0])
    drawn = source(x=bent(size), x_value=size, y=[1.0, 1.0, 1.0], y_value=[1.0, 1.0, 9.0])
    made.line("x", "y", source=drawn, legend_label="bent")
    hidden = made.line("t", "measured", source=source(t=[0.0], measured=[0.0]), legend_label="hidden")
    hidden.visible = False
    legend(made)
    name, table = saved(file_html(made, INLINE), made, tmp_path)
    assert name == "force-of-the-contact.csv"
    assert list(table.columns) == ["curve", "time / s", "force, of the contact / mN"]
    curves = {curve: own.to_numpy()[:, 1:].astype(float) for curve, own in table.groupby("curve", sort=False)}
    assert list(curves) == ["measured", "the model", "band (lower)", "band (upper)", "others 1", "others 2", "bent"]
    np.testing.assert_array_equal(curves["measured"], np.column_stack([t, x]))
    np.testing.assert_array_equal(curves["the model"], np.column_stack([t, y])[:4])
    np.testing.assert_array_equal(curves["band (upper)"], [[t[0], 1.0], [t[1], 2.0]])
    np.testing.assert_array_equal(curves["others 1"], [[1, 4], [2, 5]])
    np.testing.assert_array_equal(curves["others 2"], [[3, 6]])
    np.testing.assert_array_equal(curves["bent"], [[0.0, 1.0], [0.5, 1.0], [20.0, 9.0]])


def drawn(view: pn.Column) -> dict[str, Any]:
    """Figures of a view as a page has them, by the quantity on their vertical axis."""
    return {str(p.yaxis[0].axis_label).split(" / ")[0]: p for p in view.get_root().select({"type": Plot})}


@pytest.mark.slow
def test_a_view_draws_the_fit_in_units(base):
    made = drawn(ss.workbench.view(base))
    assert {axis.axis_label for p in made.values() for axis in p.axis} == {
        "force of the contact / mN", "measured - model / mN", "time in the cycle / s", "creep / nm", None,
        "time before the onset / s", "residual force / floor", "time in contact / s", "force / mN",
        "displacement from the force-free contact / µm",
    }  # fmt: skip
    data = base.force
    residual = made["residual force"]
    points = {
        r.data_source.id: r.data_source.data for r in residual.renderers if r.glyph.__class__.__name__ == "Scatter"
    }
    ages, found = (np.concatenate([own[key] for own in points.values()]) for key in ("x_value", "y_value"))
    use = ~data.left_out.values
    expected = (data.residual.values / data.floor.values)[use]
    np.testing.assert_allclose(np.sort(found), np.sort(expected), rtol=1e-12)
    np.testing.assert_allclose(np.sort(ages), np.sort(data[AGAINST["age"]].values[use]), rtol=1e-6, atol=1e-15)
    bone = next(r.data_source.data for r in made["force"].renderers if "law" in r.data_source.data)
    at = np.asarray(bone["u"]) * 1e-6
    np.testing.assert_allclose(
        np.asarray(bone["force"]) * 1e-3, np.interp(at, base.backbone.displacement, base.backbone.force), rtol=1e-9
    )
    view = ss.workbench.view(base)
    (chooser,) = [w for w in view.select(pn.widgets.Select) if list(w.options) == base.campaign.names]
    before = np.array(drawn(view)["force of the contact"].renderers[0].data_source.data["t"])
    chooser.value = base.campaign.names[-1]  # the pictures follow without a server
    assert not np.array_equal(before, drawn(view)["force of the contact"].renderers[0].data_source.data["t"])


@pytest.mark.slow
def test_a_model_by_hand_has_no_backbone_of_its_own(base):
    moved = base.with_values({"weakening.drop": 1.02 * base.values["weakening.drop"]})
    assert "force" in drawn(ss.workbench.view(base)) and "force" not in drawn(ss.workbench.view(moved))


@in_chromium
@pytest.mark.slow
def test_the_page_of_a_view_gives_the_residual_of_the_fit(base, tmp_path):
    view = ss.workbench.view(base)
    page = io.StringIO()
    view.save(page, resources=INLINE)
    plot = next(
        p for pane in view.select(pn.pane.Bokeh) if (p := pane.object).yaxis[0].axis_label == "residual force / floor"
    )
    name, table = saved(page.getvalue(), plot, tmp_path)
    assert name == "residual-force.csv" and list(table.columns)[1:] == ["time in contact / s", "residual force / floor"]
    run = base.campaign.names[0]
    own = base.force.isel(point=np.flatnonzero((base.force.run.values == run) & ~base.force.left_out.values))
    points = table[table.curve == run].to_numpy()[:, 1:].astype(float)
    assert (table.curve == f"{run}, medians").any()
    expected = np.column_stack([own[AGAINST["age"]], own.residual / own.floor])
    by_age = [a[np.lexsort((a[:, 1], np.round(a[:, 0], 9)))] for a in (points, expected)]
    np.testing.assert_allclose(*by_age, rtol=1e-6, atol=1e-12)


@pytest.mark.slow
def test_only_a_fit_has_a_view(campaign):
    with pytest.raises(ArgumentError, match="only a fit"):
        ss.workbench.view(campaign)
