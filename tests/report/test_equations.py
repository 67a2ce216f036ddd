"""A report holds the equations that were solved as text, and their LaTeX folded below."""

from html import unescape

from stickslip.physics.effects import catalogue
from stickslip.physics.effects.equations import equations
from stickslip.physics.model import Block, Weakening
from stickslip.show.report import write_report
from stickslip.system.runstore import json_text


def test_equations_stand_in_the_report_and_their_latex_is_folded(tmp_path):
    ageing = catalogue.make("contact-ageing", rate=0.0123)
    words = equations([ageing], block=Block(), weakening=Weakening())
    result = {"schema": 1, "title": "a rig", "equations": [{"text": words.text(), "latex": words.latex()}]}
    (tmp_path / "result.json").write_text(json_text(result))
    html = write_report(tmp_path).read_text(encoding="utf-8")
    section = html[html.index('id="equations"') : html.index('id="origin"')]
    shown, _, folded = section.partition("<details>")
    assert words.text().strip() in unescape(shown)
    assert "0.0123" in shown
    assert r"\begin{align*}" not in shown
    assert words.latex().strip() in unescape(folded)
    assert "<details open" not in html


def test_equations_without_latex_have_nothing_to_unfold(tmp_path):
    (tmp_path / "result.json").write_text(json_text({"schema": 1, "title": "a rig", "equations": ["m x'' = F"]}))
    html = write_report(tmp_path).read_text(encoding="utf-8")
    assert "m x&#39;&#39; = F" in html
    assert "<details>" not in html[html.index('id="equations"') : html.index('id="origin"')]
