"""Pictures of the pages that are drawn from the files in docs/results, in a code cell of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, label, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# of what is not noticed there, because a fit is needed for it
NEEDS_A_FIT = ("mass", "spring")
LOOK = {
    "velocity": {"color": DARK, "marker": "o", "ls": "-"},
    "scale": {"color": MIDDLE, "marker": "s", "ls": "--"},
    "clock": {"color": LIGHT, "marker": "^", "ls": "-."},
}


@styled
def noticed(found: dict[str, Any]) -> Figure:
    """Share of wrong entries that are named, against the size of the error (``rig_checks.json``)."""
    made, axes = figure(width=7.0, height=3.0)
    ax = axes[0, 0]
    for kind, sizes in found["wrong"].items():
        if len(sizes) > 1 and kind not in NEEDS_A_FIT:
            sizes_of = [float(size.split()[0]) for size in sizes]
            ax.plot(sizes_of, [100 * n["right"] / n["tried"] for n in sizes.values()], label=kind, **LOOK[kind])
    ax.axhline(95.0, color="0.5", lw=0.8, ls=":")
    ax.annotate("target, from 5 % on", (30.0, 95.0), xytext=(0, -3), textcoords="offset points", ha="right", va="top")
    ax.set(xlabel=label("error of the entry", "%"), ylabel=label("files in which it is named", "%"), ylim=(80, 101))
    ax.legend(title="wrong entry of one run", loc="lower center")
    return made


@styled
def damaged(found: dict[str, Any]) -> Figure:
    """What became of damaged files (part ``damaged files`` of ``robustness.json``)."""
    count = {what: int(number.replace(" ", "")) for what, number in found["rows"]}
    parts = [("refused", DARK), ("read", MIDDLE), (next(k for k in count if k.startswith("crashed")), LIGHT)]
    lost = next(k for k in count if k.startswith("neither"))
    made, axes = figure(width=7.0, height=2.0)
    ax, left = axes[0, 0], 0
    for what, color in parts:
        name = f"{what} ({f'{count[what]:,}'.replace(',', ' ')})"
        ax.barh(0, count[what], left=left, color=color, label=name)
        left += count[what]
    ax.plot([], [], " ", label=f"{lost} ({count[lost]})")
    ax.set(xlabel="damaged files", yticks=[], xlim=(0, left))
    made.legend(loc="outside upper center", ncols=2)
    return made


@styled
def challenged(found: dict[str, Any]) -> Figure:
    """What a sealed run said, by what was hidden (``sealed.json``)."""
    kinds = {"nothing": "nothing", "one": "one effect", "two": "two effects", "outside": "outside the catalogue"}
    rows = [k for k in kinds if found["by_kind"].get(k, {}).get("exact", {}).get("of")]
    made, axes = figure(width=7.0, height=0.8 + 0.45 * len(rows))
    ax = axes[0, 0]
    for y, kind in enumerate(reversed(rows)):
        row, left = found["by_kind"][kind], 0.0
        total = row["exact"]["of"]
        exact, right = row["exact"]["count"], row["right"]["count"]
        for width, color in ((exact, DARK), (right - exact, MIDDLE), (total - right, LIGHT)):
            ax.barh(y, width, left=left, color=color)
            left += width
    for color, name in ((DARK, "exact"), (MIDDLE, "right: with others in a set"), (LIGHT, "missed")):
        ax.barh(0, 0, color=color, label=name)
    ax.set(xlabel="campaigns", yticks=range(len(rows)), yticklabels=[kinds[k] for k in reversed(rows)])
    ax.xaxis.get_major_locator().set_params(integer=True)
    made.legend(loc="outside upper center", ncols=3)
    return made
