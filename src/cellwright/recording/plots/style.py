"""How figures look: colours that those who see few can tell apart, and that differ in grey too where it matters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555")
"""Of curves, in this order (Okabe and Ito's, without their yellow, which does not print)."""

INK, FAINT, GRID = "#222222", "#888888", "#DDDDDD"

VERDICTS = {
    "": ("#9AA5AE", ""),
    "right": ("#009E73", ""),
    "faulty": ("#D55E00", "////"),
    "not ordered": ("#E69F00", "...."),
}
"""Colour and hatching of a part on a tray, by what was said of it: told apart in grey by the hatching."""

SETTINGS: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "text.parse_math": False,  # names are names, also with two dollars in them
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.1,
    "hatch.linewidth": 0.6,
    "hatch.color": "#FFFFFF",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}


def name_at_the_end(axes: Axes, named: list[tuple[str, float, str]]) -> None:
    """Write names of curves at their right ends, where they do not lie on each other.

    Args:
        axes: where the curves are; their limits are final.
        named: name, value at the end, and colour of each.
    """
    low, high = axes.get_ylim()
    box = axes.get_window_extent()
    least = 1.35 * SIZE_OF_NAMES * axes.figure.dpi / 72.0 / max(box.height, 1.0) * (high - low)
    ordered = sorted(named, key=lambda each: each[1])
    heights = [value for _, value, _ in ordered]
    for _ in range(200):  # each pushes its neighbours away until all have room
        worst = 0.0
        for lower in range(len(heights) - 1):
            short = least - (heights[lower + 1] - heights[lower])
            if short > 1e-6 * least:
                heights[lower] -= short / 2
                heights[lower + 1] += short / 2
                worst = max(worst, short)
        if worst < 1e-3 * least:
            break
    for (name, _, colour), height in zip(ordered, heights, strict=True):
        axes.annotate(
            name,
            (1.0, height),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            color=colour,
            fontsize=SIZE_OF_NAMES,
            va="center",
            annotation_clip=False,
        )


SIZE_OF_NAMES = 7.0
"""Of names beside curves [pt]."""
