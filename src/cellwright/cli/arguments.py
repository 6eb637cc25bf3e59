"""Arguments that several commands share: trial, seed, recording, page and video, as declarations and as readers."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cellwright.cli import options, output
from cellwright.cli.main import argument, flag, option
from cellwright.cli.options import in_range, refuse
from cellwright.recording.format.files import KINDS, RecordingFiles
from cellwright.rendering.backend import requested_backend
from cellwright.rendering.camera import VIEWS, camera_of
from cellwright.rendering.video_options import HEIGHT, WIDTH, VideoOptions, check_video_size, period_of
from cellwright.running.run import PageOptions, RecordOptions
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

if TYPE_CHECKING:
    from cellwright.rendering.video import VideoFigures

WORK, END, OUTPUT, REACH = "What runs", "When it ends", "Output", "Where it is reached"
"""Headings for options in the help."""

TRIAL = argument(
    "TRIAL",
    "A trial that comes with Cellwright, such as `lesson`, or a YAML file; several are joined, as by the "
    "original's launcher: `final01 kitter_sensors`.",
)

Files = Annotated[list[str], TRIAL]

Servo = Annotated[
    str | None,
    option(
        "PROFILE",
        "Servos of the arm: `original` (soft, as in 2017) or `precise`; as the file says when left out.",
        WORK,
    ),
]
Seed = Annotated[int | None, option("N", "Root of all chance; the file's own, else 0.", WORK)]
Vary = Annotated[
    bool,
    flag(
        "--vary", "Move parts in bins, change friction and the phases of belt and gripper a little, by the seed.", WORK
    ),
]
Development = Annotated[
    bool, flag("--development-mode -d", "Allow what a competition refuses, such as setting the belt's power.", WORK)
]
Until = Annotated[float | None, option("T", "Stop at this simulation time [s].", END)]
Record = Annotated[
    list[Path] | None,
    option(
        "FILE.mcap",
        "Record everything to this file, to be replayed and looked at; FILE.bag for the tools of ROS 1; repeatable.",
        OUTPUT,
    ),
]
Recorded = Annotated[Path, argument("FILE.mcap", "What `--record` wrote, whole or cut short.")]
Host = Annotated[str, option("HOST", "Address to listen at.", REACH)]
Port = Annotated[
    int | None,
    option(
        "N", "Port to listen at; 0 takes a free one. 11399 when left out, or one of the next where it is in use.", REACH
    ),
]
Log = Annotated[
    Path | None,
    option(
        "FILE.jsonl",
        "Write what happens to this file as it happens, with the evidence of each kit; a line of JSON each.",
        OUTPUT,
    ),
]


LOOK = "Looking on"
"""Heading in the help."""

View = Annotated[bool, flag("--view", "Show it on a page, in a browser; the page's address is printed.", LOOK)]
ViewHost = Annotated[
    str | None,
    option(
        "HOST",
        f"Address at which the page is; {LOOPBACK} when left out. Any other needs the token that is printed.",
        LOOK,
    ),
]
ViewPort = Annotated[
    int | None,
    option(
        "N",
        f"Port of the page: {DEFAULT_PORT} when left out, and one of the next where it is in use. 0: a free one.",
        LOOK,
    ),
]
OpenPage = Annotated[bool, flag("--open", "Open the page in this desktop's browser.", LOOK)]


def page_options(*, view: bool, host: str | None, port: int | None, opens: bool) -> PageOptions | None:
    """Return the options of the page; None for no page."""
    if not view:
        said = {"--view-host": host is not None, "--view-port": port is not None, "--open": opens}
        if given := [option for option, is_given in said.items() if is_given]:
            refuse(f"{given[0]}: there is no page; say --view as well")
        return None
    host, port = LOOPBACK if host is None else host, DEFAULT_PORT if port is None else port
    in_range("--view-port", port, 0, 65535, "a port from 0 to 65535")
    return PageOptions(host, port, "" if _is_local(host) else secrets.token_urlsafe(16), opens)


def refuse_camera_name(words: Sequence[str], *, view: bool) -> None:
    """Refuse a camera name behind `--view`, which took one in an earlier version."""
    for word in words if view else ():
        if word in VIEWS and not Path(word).exists():
            refuse(f"--view {word}: --view opens a page now, and takes no name; for pictures say --camera {word}")


def _is_local(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


VIDEO = "Video"
VideoFile = Annotated[
    Path | None,
    option(
        "FILE.mp4",
        "Write a video of it, 25 pictures a simulated second; one that is killed leaves it playable.",
        VIDEO,
        name="--video",
    ),
]
VideoCamera = Annotated[
    str | None,
    option(
        "VIEW",
        "Where it is taken from: a view as for pictures, or `x,y,z:x,y,z`, place and target in m.",
        VIDEO,
        name="--video-camera",
    ),
]
VideoSpeed = Annotated[
    float,
    option("FACTOR", "Simulated seconds a second of video: 10 makes 10 minutes one.", VIDEO, name="--video-speed"),
]
VideoSize = Annotated[str, option("WxH", "In pixels, such as 1920x1080.", VIDEO, name="--video-size")]
VideoFine = Annotated[bool, flag("--video-fine", "Smoother edges; without a GPU that takes half as long again.", VIDEO)]

DEFAULT_VIDEO_SIZE = f"{WIDTH}x{HEIGHT}"


def video_options(file: Path | None, view: str | None, speed: float, size: str, *, fine: bool) -> VideoOptions | None:
    """Return the options of the video; None for no video."""
    checked = options.output_file("--video", file, ".mp4")
    with options.errors_of("--video-camera"):
        camera = None if view is None else camera_of(view)
    with options.errors_of("--video-speed:"):
        period_of(speed)
    width, height = _video_size(size)
    if checked is None:
        if view is not None or speed != 1.0 or size != DEFAULT_VIDEO_SIZE or fine:
            options.refuse("--video-camera, --video-speed, --video-size and --video-fine go with --video FILE.mp4")
        return None
    requested_backend()
    return VideoOptions(checked, camera, speed, width, height, fine)


def video_sentence(video: VideoFigures) -> str:
    """Return the sentence about a video that was written."""
    return f"{video['file']}, {video['length']:.1f} s"


def _video_size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and len(text) < 20):
        options.refuse(f"--video-size {text}: give width and height in pixels, such as {DEFAULT_VIDEO_SIZE}")
    size = int(width), int(height)
    with options.errors_of(f"--video-size {text}:"):
        check_video_size(*size)
    return size


def record_options(paths: Sequence[Path] | None, **about: Any) -> RecordOptions | None:
    """Return the options of the recording, with further facts about the run; None for no recording."""
    if not paths:
        return None
    for path in paths:
        kind = path.suffix.lower()
        if kind not in KINDS:
            options.refuse(f"--record {path}: give a file such as run.mcap, or run.bag for the tools of ROS 1")
        options.output_file("--record", path, kind)
    RecordingFiles(paths)
    return RecordOptions(paths, about, report=output.warn)
