"""Joints over time: where they are, and dashed where they were told to be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cellwright.recording.plots.style import COLOURS, FAINT, name_at_the_end
from cellwright.recording.plots.thinning import thinned
from cellwright.recording.plots.tracks import JointTrack

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = len(COLOURS)
"""So many curves can be told apart; of more joints those that move most are drawn."""

STILL = 1e-3
"""A joint that moves less than this [rad; m] stands still."""

_UNITS = {"rad": "position [rad]", "m": "position [m]"}


def chosen(tracks: Sequence[JointTrack]) -> list[JointTrack]:
    """The joints to draw: those that move, no more than can be told apart, in their own order."""
    moving = [track for track in tracks if track.travel >= STILL] or list(tracks[:1])
    most = sorted(moving, key=lambda track: -track.travel)[:MOST]
    return [track for track in moving if any(track is each for each in most)]


def draw(axes: Axes, group: str, tracks: Sequence[JointTrack]) -> None:
    """Draw a group of joints of the same unit.

    Args:
        axes: where; its limits along time are set.
        group: what they are called together.
        tracks: the joints.
    """
    drawn = chosen(tracks)
    for track, colour in zip(drawn, COLOURS, strict=False):
        if len(track.targets):
            axes.plot(*thinned(track.told_at, track.targets), color=colour, linewidth=0.8, linestyle=(0, (3, 2)))
        axes.plot(*thinned(track.times, track.positions), color=colour)
    left_out = len(tracks) - len(drawn)
    still = sum(track.travel < STILL for track in tracks)
    words = [f"{left_out} more"] if left_out else []
    if left_out and still:
        words = [f"{left_out} more, of which {still} stand still" if still < left_out else f"{left_out} stand still"]
    axes.set_title(" ".join([group, *(f"({word})" for word in words)]))
    axes.set_ylabel(_UNITS.get(drawn[0].unit, drawn[0].unit))
    axes.margins(y=0.08)
    named = [(track.name, float(track.positions[-1]), colour) for track, colour in zip(drawn, COLOURS, strict=False)]
    name_at_the_end(axes, named)
    if any(len(track.targets) for track in drawn):
        axes.text(1.0, 1.03, "dashed: target", transform=axes.transAxes, ha="right", fontsize=7, color=FAINT)
