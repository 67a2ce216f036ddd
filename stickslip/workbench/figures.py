"""Figures of the workbench: one look, light and dark, with units on every axis and colours that all can distinguish."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from typing import Any

from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    CrosshairTool,
    CustomAction,
    CustomJS,
    PanTool,
    ResetTool,
    SaveTool,
    WheelZoomTool,
)
from bokeh.models.annotations import Span
from bokeh.plotting import figure as bokeh_figure

from ..show.plots.style import RUNS
from ..show.plots.style import label as label
from ..show.plots.style import scaled as unit_of  # noqa: F401
from .widgets import static

FEW = "canvas"  # what draws some hundred points quickest
DASHES = ("solid", "dashed", "dotdash", "dotted")  # as many as have no factor in common with the number of colours
CSV = "Save the curves as CSV, as they are drawn"
SAVING = static("curves_csv.js")
SHEET = (
    "data:image/svg+xml;base64,"
    + b64encode(
        b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke="#7b8596" stroke-width="2">'
        b'<path d="M4 4h16v16H4zM4 10h16M4 15h16M10 4v16"/></svg>'
    ).decode()
)  # a sheet with rows and columns


@dataclass(frozen=True)
class Look:
    """Colours of a theme.

    Attributes:
        text, soft, line, surface, page: of the page: text, its softer form, lines, cards, what is behind them.
        measured, model, band: of the two curves and of what noise and scatter allow.
        runs: of the runs: the colour-blind can distinguish them.
        accent: of what can be pressed.
        low, middle, high: of the heat map: better than the data can resolve, as good, worse.
    """

    text: str
    soft: str
    line: str
    surface: str
    page: str
    measured: str
    model: str
    band: str
    runs: tuple[str, ...]
    accent: str
    low: str
    middle: str
    high: str


LIGHT = Look(
    "#14213d", "#5b6577", "#dfe3e8", "#ffffff", "#f4f5f7", "#14213d", "#c8553d", "#8d99ae",
    RUNS, "#1d5fa8",
    "#5e3c99", "#f7f7f7", "#b35806",
)  # fmt: skip
DARK = Look(
    "#e6e9ef", "#a3adbd", "#39424f", "#1d232c", "#14181f", "#e6e9ef", "#ff8f70", "#6c7a92",
    ("#56b4e9", "#ff9a3c", "#b0ffa9", "#9e59f9", "#aa806b", "#b70e82", "#934d01"), "#6db3f2",
    "#9a7fd1", "#2b323c", "#e08214",
)  # fmt: skip


def dark() -> bool:
    """Whether this window asked for the dark theme."""
    import panel as pn

    return pn.config.theme == "dark"


def look() -> Look:
    """Colours of this window."""
    return DARK if dark() else LIGHT


def of_run(number: int) -> dict[str, Any]:
    """Colour and dash of a curve, by the number of its run or model; those of the first 28 differ."""
    runs = look().runs
    return {"color": runs[number % len(runs)], "line_dash": DASHES[number % len(DASHES)]}


def figure(title: str = "", x: str = "", y: str = "", height: int = 260, **more: Any) -> Any:
    """A figure of this window's look, as wide as its place.

    Args:
        title: above it.
        x, y: texts of the axes, with units (see :func:`label`).
        height: in pixels.
        more: arguments of ``bokeh.plotting.figure``, such as ``x_range`` to link it with another. For some hundred
            points ``output_backend="canvas"`` is quicker than WebGL, which has to be copied into the page. The first of
            ``tags`` is the text of a horizontal axis that another figure shows.

    Its curves can be saved as CSV. A column ``NAME_value`` of a source has what is saved of a column NAME that is
    drawn otherwise, such as on a bent scale.
    """
    theme = look()
    more.setdefault("sizing_mode", "stretch_width")
    more.setdefault("output_backend", "webgl")
    made: Any = bokeh_figure(
        title=title, x_axis_label=x, y_axis_label=y, height=height, toolbar_location="above",
        tools=[PanTool(), WheelZoomTool(), BoxZoomTool(), ResetTool(), SaveTool()], active_drag=None, **more,
    )  # fmt: skip
    made.add_tools(CustomAction(icon=SHEET, description=CSV, callback=CustomJS(args={"figure": made}, code=SAVING)))
    made.toolbar.update(logo=None, autohide=True)
    made.update(
        toolbar_inner=True, background_fill_color=theme.surface, border_fill_color=theme.surface,
        outline_line_color=None, min_border_right=14,
    )  # fmt: skip
    for axis in made.axis:
        axis.update(
            axis_label_text_font_style="normal", axis_label_text_color=theme.text, axis_label_text_font_size="13px",
            major_label_text_color=theme.text, major_label_text_font_size="12px", axis_line_color=theme.soft,
            major_tick_line_color=theme.soft, minor_tick_line_color=None,
        )  # fmt: skip
    made.grid.grid_line_color = theme.line
    made.title.update(text_color=theme.text, text_font_size="13px")
    return made


def compared(made: Any, measured: Any, model: Any, columns: tuple[str, str], name: str, width: float = 2.5) -> None:
    """Two curves over ``t``, ``columns`` of two sources: what was measured, and dashed the model's, by its ``name``."""
    theme, (own, other) = look(), columns
    made.line("t", own, source=measured, color=theme.measured, line_width=width, legend_label="measured")
    made.line("t", other, source=model, color=theme.model, line_width=2, line_dash="dashed", legend_label=name)


def crosshair(*figures: Any) -> None:
    """One vertical line under the pointer in figures that share an axis."""
    line = Span(dimension="height", line_color=look().soft, line_width=1, line_dash="dotted")
    for each in figures:
        each.add_tools(CrosshairTool(overlay=line))


def legend(made: Any, place: str = "above", steady: bool = False, **more: Any) -> None:
    """The legend of a figure, which lies beside it, so that it hides nothing; a click on an entry hides a curve.

    Args:
        made: the figure.
        place: of the legend.
        steady: whether entries stay without data: where curves come and go with a hand, the page is else laid out anew.
        more: properties of the legend.
    """
    theme = look()
    for found in list(made.legend):
        found.update(
            orientation="horizontal", click_policy="hide", background_fill_color=theme.surface,
            border_line_color=None, label_text_color=theme.text, inactive_fill_color=theme.surface,
            label_text_font_size="12px", padding=2, margin=2, spacing=12, **more,
        )  # fmt: skip
        for each in () if steady else found.items:
            _while_drawn(each)
        made.add_layout(found, place)


def _while_drawn(item: Any) -> None:
    """An entry is there while its curves have data: without, its sign would be missing.

    In a window the browser sees to it: of changes that are sent together, a document tells its own callbacks nothing.
    """
    sources = [each.data_source for each in item.renderers]

    def update(attr: str, old: Any, new: Any) -> None:
        item.visible = any(len(column) for s in sources for column in s.data.values())

    for each in sources:  # until the window has the page
        each.on_change("data", update)
    update("data", None, None)
    code = "item.visible = sources.some((s) => Object.values(s.data).some((column) => column.length > 0))"
    for each in sources:
        each.js_on_change("data", CustomJS(args={"item": item, "sources": sources}, code=code))


def source(**columns: Any) -> ColumnDataSource:
    """A source of columns, empty unless given."""
    return ColumnDataSource({name: list(values) for name, values in columns.items()})
