"""Arguments that several commands share: trial, seed, recording, page and video, as declarations and as readers."""

from __future__ import annotations

import os
import secrets
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cellwright.cli import options, output
from cellwright.cli.main import argument, flag, option, ros_arguments
from cellwright.cli.options import in_range, refuse
from cellwright.middleware.ros2.host.ros2 import NAMES, RANGES, Ros2Options
from cellwright.recording.format.files import KINDS, RecordingFiles
from cellwright.rendering.backend import requested_backend
from cellwright.rendering.camera import VIEWS, camera_of
from cellwright.rendering.video_options import HEIGHT, WIDTH, VideoOptions, check_video_size, period_of
from cellwright.running.run import PageOptions, RecordOptions
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

if TYPE_CHECKING:
    from cellwright.rendering.video import VideoFigures

SIMULATION, END, OUTPUT, NETWORK = "Simulation", "End", "Output", "Network"
"""Headings for options in the help."""

TRIAL = argument(
    "TRIAL",
    "A bundled trial, such as `lesson`, or a YAML file; files that are joined, as by the 2017 launcher: "
    "`final01+kitter_sensors`.",
)

AGENT_HELP = "Agent: `kitter`, `lesson`, or your own as `path.py:Class` or `module:Class`"
LOCKSTEP_HELP = "Advance simulation time only on a client's request"
ROBOT_HELP = (
    "A bundled robot such as `qinglong`, a robot configuration (`vr_configs.yml`) or its folder, or a URDF or xacro "
    "file."
)
SPEED_HELP = "Simulated seconds per second: `1` is real time, `max` is as fast as possible."
"""Help of options that several commands have, with notes of their own; the first two lack the full stop."""

Files = Annotated[list[str], TRIAL]
XacroArguments = Annotated[
    list[str] | None, argument("NAME:=VALUE", "Arguments of a xacro file, such as `prefix:=left_`.")
]

Servo = Annotated[
    str | None,
    option(
        "PROFILE",
        "Servo profile of the arm: `original` (soft, as in 2017) or `precise`. Default: the file's.",
        SIMULATION,
    ),
]
Seed = Annotated[int | None, option("N", "Seed of all random streams. Default: the file's, else 0.", SIMULATION)]
Vary = Annotated[
    bool,
    flag(
        "--vary", "Slightly vary parts in bins, friction, and the phases of belt and gripper, by the seed.", SIMULATION
    ),
]
Overrides = Annotated[
    list[str] | None,
    option(
        "KEY=VALUE",
        "Replace a value of the files, such as `time_limit=60`; KEY is a path as warnings print it, VALUE is YAML; "
        "repeatable.",
        SIMULATION,
        name="--set",
    ),
]
Development = Annotated[
    bool,
    flag("--development-mode -d", "Allow what a competition refuses, such as setting the belt's power.", SIMULATION),
]
Until = Annotated[float | None, option("T", "Stop at this simulation time [s].", END)]
Record = Annotated[
    list[Path] | None,
    option(
        "FILE.mcap",
        "Record the run to this file, for `replay`, `plot` and `view`; FILE.bag for ROS 1 tools; repeatable.",
        OUTPUT,
    ),
]
Recorded = Annotated[Path, argument("FILE.mcap", "Recording from `--record`, complete or cut short.")]
Host = Annotated[str, option("HOST", "Address to listen on.", NETWORK)]
Port = Annotated[
    int | None,
    option("N", "Port to listen on; 0 takes a free one. Default: 11399, or one of the next if it is in use.", NETWORK),
]
Ros1 = Annotated[bool, flag("--ros1", "Connect to ROS 1 as well, at the master in ROS_MASTER_URI.", NETWORK)]
Ros2 = Annotated[
    bool,
    flag(
        "--ros2",
        "Connect to ROS 2 as well, in the domain ROS_DOMAIN_ID. Arguments behind `--ros-args` are the node's own.",
        NETWORK,
    ),
]
Ros2Range = Annotated[
    str | None,
    option(
        "RANGE",
        f"Where ROS 2 looks for other nodes: {' or '.join(f'`{each}`' for each in RANGES)}. "
        f"Default: `{RANGES[0]}`, this machine alone.",
        NETWORK,
    ),
]
Ros2Names = Annotated[
    str | None,
    option(
        "NAMES",
        "Names of joint states and of the arm's controller in ROS 2: `2017`, `ros2_control` or `both` (default).",
        NETWORK,
    ),
]
AsJson = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else on stdout.", OUTPUT)]
Log = Annotated[
    Path | None,
    option(
        "FILE.jsonl",
        "Write events to this file as they happen, with the evidence of each kit; one line of JSON each.",
        OUTPUT,
    ),
]


VIEWING = "Viewing"
"""Heading in the help."""

_VIEW = "Show it on a page in a browser; the page's address is printed."

View = Annotated[bool, flag("--view", _VIEW, VIEWING)]
RunView = Annotated[
    bool,
    flag("--view", f"{_VIEW} The page stays after the run, until Ctrl-C; with --json it ends with the run.", VIEWING),
]
EvaluationView = Annotated[
    bool, flag("--view", f"{_VIEW} The page stays at the end, until Ctrl-C; with --json it ends as well.", VIEWING)
]
ViewHost = Annotated[
    str | None,
    option("HOST", f"Address of the page. Default: {LOOPBACK}; any other requires the token that is printed.", VIEWING),
]
ViewPort = Annotated[
    int | None,
    option(
        "N",
        f"Port of the page; 0 takes a free one. Default: {DEFAULT_PORT}, or one of the next if it is in use.",
        VIEWING,
    ),
]
PictureCamera = Annotated[
    str,
    option(
        "NAME", "View of pictures: overview, bins, belt, agv1, agv2, or `x,y,z:x,y,z` [m].", VIEWING, name="--camera"
    ),
]
OpenPage = Annotated[bool, flag("--open", "Open the page in this desktop's browser.", VIEWING)]

VIDEO = "Video"
DEFAULT_VIDEO_SIZE = f"{WIDTH}x{HEIGHT}"


def page_options(*, view: bool, host: str | None, port: int | None, opens: bool) -> PageOptions | None:
    """Return the options of the page; None for no page."""
    if not view:
        page_flags = {"--view-host": host is not None, "--view-port": port is not None, "--open": opens}
        if given := [option for option, is_given in page_flags.items() if is_given]:
            refuse(f"{given[0]} requires --view")
        return None
    host, port = LOOPBACK if host is None else host, DEFAULT_PORT if port is None else port
    in_range("--view-port", port, 0, 65535, "a port from 0 to 65535")
    return PageOptions(host, port, "" if _is_local(host) else secrets.token_urlsafe(16), opens)


def refuse_camera_name(words: Sequence[str], *, view: bool) -> None:
    """Refuse a camera name behind `--view`, which took one in an earlier version."""
    for word in words if view else ():
        if word in VIEWS and not os.path.exists(word):
            refuse(f"--view {word}: --view opens a page and takes no name; for pictures use --camera {word}")


def _is_local(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


VideoFile = Annotated[
    Path | None,
    option(
        "FILE.mp4",
        "Write a video, 25 pictures per simulated second; it stays playable if the process is killed.",
        VIDEO,
        name="--video",
    ),
]
VideoCamera = Annotated[
    str | None,
    option(
        "VIEW",
        "View of the video: a name as for pictures, or `x,y,z:x,y,z` for camera and target [m].",
        VIDEO,
        name="--video-camera",
    ),
]
VideoSpeed = Annotated[
    float,
    option(
        "FACTOR", "Simulated seconds per second of video; 10 shortens 10 minutes to one.", VIDEO, name="--video-speed"
    ),
]
VideoSize = Annotated[str, option("WxH", "Size in pixels, such as 1920x1080.", VIDEO, name="--video-size")]
VideoFine = Annotated[
    bool, flag("--video-fine", "Smoother edges; without a GPU drawing takes half as long again.", VIDEO)
]


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
            options.refuse("--video-camera, --video-speed, --video-size and --video-fine require --video FILE.mp4")
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


def ros2_options(*, ros2: bool, discovery: str | None, names: str | None = None) -> Ros2Options | bool:
    """Return the options of the node in ROS 2, with the command line's arguments for it; False for no node."""
    if not ros2:
        given = {"--ros2-range": discovery, "--ros2-names": names}
        for name, value in given.items():
            if value is not None:
                options.refuse(f"{name} requires --ros2")
        return False
    if discovery not in (None, *RANGES):
        options.refuse(f"--ros2-range {discovery}: give {' or '.join(RANGES)}")
    if names not in (None, *NAMES):
        options.refuse(f"--ros2-names {names}: give {', '.join(NAMES[:-1])} or {NAMES[-1]}")
    return Ros2Options(discovery or RANGES[0], names or NAMES[0], tuple(ros_arguments))


def record_options(paths: Sequence[Path] | None, **about: Any) -> RecordOptions | None:
    """Return the options of the recording, with further facts about the run; None for no recording."""
    if not paths:
        return None
    for path in paths:
        kind = path.suffix.lower()
        if kind not in KINDS:
            options.refuse(f"--record {path}: give a file such as run.mcap, or run.bag for ROS 1 tools")
        options.output_file("--record", path, kind)
    RecordingFiles(paths)
    return RecordOptions(paths, about, report=output.warn)
