"""`--video` and what goes with it: options of the commands in which time passes."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cellwright.cell.cell import Cell
from cellwright.cli import options
from cellwright.rendering.camera import Camera
from cellwright.rendering.video_wish import HEIGHT, WIDTH, VideoWish, check_video_size, period_of
from cellwright.rendering.views import VIEWS, camera_of
from cellwright.rendering.way import settled_way
from cellwright.util.errors import UnknownNameError, UsageError

if TYPE_CHECKING:
    from cellwright.viewer.filming import Filming, Made

PANEL = "Video"

File = Annotated[
    Path | None,
    typer.Option(
        "--video",
        metavar="FILE.mp4",
        help="Write a video of it, 25 pictures a simulated second; one that is killed leaves it playable.",
        rich_help_panel=PANEL,
    ),
]

From = Annotated[
    str | None,
    typer.Option(
        "--video-camera",
        metavar="VIEW",
        help="Where it is taken from: a view as for pictures, or `x,y,z:x,y,z`, place and target in m.",
        rich_help_panel=PANEL,
    ),
]

Speed = Annotated[
    float,
    typer.Option(
        "--video-speed",
        metavar="FACTOR",
        help="Simulated seconds a second of video: 10 makes 10 minutes one.",
        rich_help_panel=PANEL,
    ),
]

Size = Annotated[
    str,
    typer.Option("--video-size", metavar="WxH", help="In pixels, such as 1920x1080.", rich_help_panel=PANEL),
]

Fine = Annotated[
    bool,
    typer.Option(
        "--video-fine",
        metavar="",
        help="Smoother edges; without a GPU that takes three times as long.",
        rich_help_panel=PANEL,
    ),
]

USUAL_SIZE = f"{WIDTH}x{HEIGHT}"


def wish(file: Path | None, view: str | None, speed: float, size: str, *, fine: bool) -> VideoWish | None:
    """What was asked for; None for no video.

    Raises:
        UsageError: something that cannot be, or that goes with --video and stands without it.
    """
    checked = options.output_file("--video", file, ".mp4")
    camera = None if view is None else _camera(view)
    try:
        period_of(speed)
    except UsageError as error:
        options.refuse(f"--video-speed: {error}")
    width, height = _size(size)
    if checked is None:
        if view is not None or speed != 1.0 or size != USUAL_SIZE or fine:
            options.refuse("--video-camera, --video-speed, --video-size and --video-fine go with --video FILE.mp4")
        return None
    settled_way()
    return VideoWish(checked, camera, speed, width, height, fine)


def of_cell(cell: Cell, wanted: VideoWish, *, waits: bool, warn: Callable[[str], None]) -> Filming:
    """A video of a cell, with time, points and what the agent is about in its corner.

    Args:
        cell: the cell.
        wanted: what was asked for.
        waits: hold time until a frame can be drawn.
        warn: takes a line about what goes wrong.

    Raises:
        RenderingError: it cannot be written.
    """
    from cellwright.viewer.filming import Filming, still  # it takes a moment to load

    def caption() -> str:
        points = cell.competition.score().total
        words = (f"{cell.simulation.time:.1f} s", f"{points:g} {'point' if points == 1 else 'points'}")
        return "   ".join(word for word in (*words, cell.intention.text) if word)

    return Filming(
        cell, wanted, camera=still(wanted.camera or VIEWS["overview"]), caption=caption, waits=waits, warn=warn
    )


def actions(film: Filming | None) -> list[tuple[Fraction, Callable[[Cell], None]]]:
    """What a run is to do at which time [s], so that there is a video of it."""
    return [] if film is None else [(Fraction(0), lambda _cell: film.start())]


def numbered(file: Path, run: int) -> Path:
    """The file of the video of a run, by its number from 1: run.mp4, run_2.mp4."""
    return file if run == 1 else file.with_name(f"{file.stem}_{run}{file.suffix}")


def sentence(told: Made) -> str:
    """What is said of a video that was written."""
    return f"{told['file']}, {told['length']:.1f} s"


def _camera(text: str) -> Camera:
    try:
        return camera_of(text)
    except UnknownNameError as error:
        options.refuse(f"--video-camera: {error.sentence()}")
    except UsageError as error:
        options.refuse(f"--video-camera {error}")


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and len(text) < 20):
        options.refuse(f"--video-size {text}: give width and height in pixels, such as {USUAL_SIZE}")
    size = int(width), int(height)
    try:
        check_video_size(*size)
    except UsageError as error:
        options.refuse(f"--video-size {text}: {error}")
    return size
