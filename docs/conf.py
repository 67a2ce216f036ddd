"""Sphinx settings: ``make docs``. Pages of the effects are written before the build (see effect_pages.py)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import stickslip

project = "stickslip"
author = "the stickslip developers"
version = release = stickslip.__version__
copyright = author

# equations are drawn by files that lie beside the pages, so that these are readable without network
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
exclude_patterns = ["_build", "jupyter_execute", "Thumbs.db", ".DS_Store"]
default_role = "literal"
html_theme = "furo"
html_title = "stickslip"
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_show_tb = True
nb_execution_timeout = 600
nb_merge_streams = True
nb_render_markdown_format = "myst"

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
napoleon_custom_sections = [("Fields", "params_style")]
napoleon_use_rtype = False


def write_effect_pages(app: Any) -> None:
    """A page for every effect of the catalogue."""
    import effect_pages

    effect_pages.write_all(HERE / "effects")


def drawn_anew(app: Any, env: Any, added: set[str], changed: set[str], removed: set[str]) -> list[str]:
    """Pages with tables from files of results that are newer than the page was read."""
    sources = [
        HERE / "tables.py",
        HERE / "pictures.py",
        HERE / "results",
        *HERE.glob("results/*.json"),
        *HERE.glob("paper/*.json"),
    ]
    newest = max(path.stat().st_mtime_ns for path in sources) // 1000
    old = [page for page, read in env.all_docs.items() if read < newest and Path(env.doc2path(page)).is_file()]
    texts = {page: Path(env.doc2path(page)).read_text(encoding="utf-8") for page in old}
    return [page for page, text in texts.items() if "import tables" in text or ".json" in text]


def setup(app: Any) -> None:
    app.connect("config-inited", lambda app, config: write_effect_pages(app))
    app.connect("env-get-outdated", drawn_anew)
