"""What lay on the trays: a bar for each part, and a line where a kit was judged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cellwright.recording.plots.style import FAINT, INK, VERDICTS
from cellwright.recording.plots.tracks import Story, TrayPart

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 40
"""So many bars are drawn; the first ones of each tray."""


def rows(story: Story) -> int:
    """How many rows the drawing has: one for each part, and at least one for each tray."""
    counts = [sum(part.tray == tray for part in story.tray_parts) for tray in story.trays]
    return sum(min(max(count, 1), MOST) for count in counts)


def draw(axes: Axes, story: Story) -> None:
    """Draw the trays one below another; the first at the top."""
    row, ticks = 0, []
    for tray in story.trays:
        parts = sorted((part for part in story.tray_parts if part.tray == tray), key=lambda part: part.begin)
        first = row
        for part in parts[:MOST]:
            colour, hatch = VERDICTS.get(part.verdict, VERDICTS[""])
            axes.barh(
                row, part.end - part.begin, left=part.begin, height=0.78, color=colour, hatch=hatch, edgecolor="white"
            )
            _name(axes, row, part, colour, story)
            row += 1
        row += not parts
        words = tray if len(parts) <= MOST else f"{tray}: the first {MOST} of {len(parts)}"
        ticks.append(((first + row - 1) / 2, words))
        for mark in story.marks:
            if mark.tray == tray:
                axes.plot([mark.time] * 2, [first - 0.5, row - 0.5], color=INK, linewidth=1.2)
        axes.axhline(row - 0.5, color=FAINT, linewidth=0.6)
    axes.set_ylim(max(row, 1) - 0.5, -0.5)
    axes.set_yticks([place for place, _ in ticks], [words for _, words in ticks])
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title("On the trays")
    said = {part.verdict for part in story.tray_parts}
    handles: list[Any] = [
        axes.barh(-9, 0, color=colour, hatch=hatch, edgecolor="white", label=verdict or "not judged")
        for verdict, (colour, hatch) in VERDICTS.items()
        if verdict in said
    ]
    if any(mark.tray for mark in story.marks):
        handles += axes.plot([], [], color=INK, linewidth=1.2, label="kit judged")
    if handles:
        axes.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, borderpad=0, handlelength=1.4
        )


def _name(axes: Axes, row: int, part: TrayPart, behind: str, story: Story) -> None:
    """Write a part's name in its bar where it fits, else beside it, where there is room."""
    from matplotlib.patheffects import withStroke

    width = max(story.end - story.begin, 1e-9)
    needed, space = 0.0105 * len(part.name) * width, 0.005 * width  # of text of this size, on a page of this width
    if part.end - part.begin >= needed:
        text = axes.text(part.begin + space, row, part.name, va="center", fontsize=6.5, color="white")
        text.set_path_effects([withStroke(linewidth=2.0, foreground=behind)])  # it may be hatched
    elif part.begin - story.begin >= needed:
        axes.text(part.begin - space, row, part.name, ha="right", va="center", fontsize=6.5)
    else:
        axes.text(part.end + space, row, part.name, va="center", fontsize=6.5)
