"""Options that several commands share, each declared once: alone, or in a group that refuses invalid values."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, get_args

from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.variation import vary
from cellwright.cli import options
from cellwright.cli.main import ros_arguments
from cellwright.cli.options import in_range, one_of, refuse
from cellwright.cli.parameters import argument, flag, option
from cellwright.config.arm import ServoProfile
from cellwright.config.trial.trial import Trial
from cellwright.middleware.ros2.host.ros2 import NAMES, RANGES, Ros2Options
from cellwright.recording.format.files import KINDS, RecordingFiles
from cellwright.rendering.backend import requested_backend
from cellwright.rendering.video_options import HEIGHT, WIDTH, VideoOptions, check_video_size, period_of
from cellwright.rendering.views import Viewpoint, camera_of, viewpoint
from cellwright.running.run import CellTarget, PageOptions, RecordOptions, ServerOptions
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

if TYPE_CHECKING:
    from cellwright.rendering.camera import Camera
    from cellwright.rendering.video import VideoFigures

SIMULATION, END, OUTPUT, NETWORK, VIEWING, VIDEO = "Simulation", "End", "Output", "Network", "Viewing", "Video"
"""Headings for options in the help."""

_NO_VIEWPOINTS: Mapping[str, Viewpoint | None] = MappingProxyType({})

TRIAL = argument(
    "TRIAL",
    "A bundled trial, such as `lesson`, or a YAML file; files that are joined, as by the 2017 launcher: "
    "`final01+kitter_sensors`.",
)

AGENT_HELP = (
    "Agent: `kitter`, `lesson`, your own as `path.py:Class` or `module:Class`, or the commands of a recording as "
    "`replay:run.mcap`"
)
LOCKSTEP_HELP = "Advance simulation time only on a client's request"
VIEW_HELP = "Show it on a page in a browser; the page's address is printed."
ROBOT_HELP = (
    "A bundled robot such as `qinglong`, a robot configuration (`vr_configs.yml`) or its folder, or a URDF, xacro or "
    "MJCF file."
)
SPEED_HELP = "Simulated seconds per second: `1` is real time, `max` is as fast as possible."
"""Help of options that several commands have, with notes of their own; the first two lack the full stop."""

DEFAULT_VIDEO_SIZE = f"{WIDTH}x{HEIGHT}"

Files = Annotated[list[str], TRIAL]
XacroArguments = Annotated[
    list[str] | None, argument("NAME:=VALUE", "Arguments of a xacro file, such as `prefix:=left_`.")
]
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
Ros2Range = Annotated[
    str | None,
    option(
        "RANGE",
        f"Where ROS 2 looks for other nodes: {' or '.join(f'`{each}`' for each in RANGES)}. "
        f"Default: `{RANGES[0]}`, this machine alone.",
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
PictureCamera = Annotated[
    str,
    option(
        "NAME",
        "View of pictures: overview, bins, a belt, AGV or tray of the cell by its name, or `x,y,z:x,y,z` [m].",
        VIEWING,
        name="--camera",
    ),
]


@dataclass(frozen=True)
class CellArguments:
    """Options of the cell of a trial."""

    servo: Annotated[
        str | None,
        option(
            "PROFILE",
            "Servo profile of the arm: `original` (soft, as in 2017) or `precise`. Default: the file's.",
            SIMULATION,
        ),
    ] = None
    seed: Annotated[int | None, option("N", "Seed of all random streams. Default: the file's, else 0.", SIMULATION)] = (
        None
    )
    vary: Vary = False
    overrides: Overrides = None

    def target(
        self,
        files: Sequence[str],
        console: Console,
        *,
        competition: bool = True,
        viewpoints: Mapping[str, Viewpoint | None] = _NO_VIEWPOINTS,
        **about: str,
    ) -> CellTarget:
        """Return the cell of the trial in these files, made when its session opens; warnings go to stderr.

        Args:
            files: the files, as they were named.
            console: receives refusals of the cell.
            competition: True if it is a competition.
            viewpoints: cameras by their options; the cell must have the views that they name.
            about: further facts about the run for a panel.
        """
        in_range("--seed", self.seed, 0, options.MAX_SEED, "a whole number from 0 to 2**63 - 1")
        overrides = options.overrides(self.overrides)

        def make() -> Cell:
            trial = options.load(files, overrides)
            options.check_views(trial, viewpoints)
            if self.vary:
                trial = vary(trial, trial.settings.seed if self.seed is None else self.seed)
            return self.cell(trial, console, competition=competition)

        return CellTarget(make, lambda: options.paths(files), about=about, is_varied=self.vary)

    def cell(self, trial: Trial, console: Console, *, competition: bool) -> Cell:
        """Return the cell of a trial; its refusals go to a console."""
        profiles: tuple[ServoProfile, ...] = get_args(ServoProfile)
        return Cell(
            trial,
            seed=self.seed,
            servo=None if self.servo is None else one_of("--servo", "servo profile", self.servo, profiles),
            competition=competition,
            report=partial(console.print, markup=False, soft_wrap=True, style="yellow"),
        )


@dataclass(frozen=True)
class ServerArguments:
    """Options of a server for clients."""

    host: Annotated[str, option("HOST", "Address to listen on.", NETWORK)] = LOOPBACK
    port: Annotated[
        int | None,
        option(
            "N", "Port to listen on; 0 takes a free one. Default: 11399, or one of the next if it is in use.", NETWORK
        ),
    ] = None


@dataclass(frozen=True)
class NetworkArguments(ServerArguments):
    """Options of a server for clients, also in ROS 1 and ROS 2."""

    ros1: Annotated[bool, flag("--ros1", "Connect to ROS 1 as well, at the master in ROS_MASTER_URI.", NETWORK)] = False
    ros2: Annotated[
        bool,
        flag(
            "--ros2",
            "Connect to ROS 2 as well, in the domain ROS_DOMAIN_ID. Arguments behind `--ros-args` are the node's own.",
            NETWORK,
        ),
    ] = False
    ros2_range: Ros2Range = None
    ros2_names: Annotated[
        str | None,
        option(
            "NAMES",
            "Names of joint states and of the arm's controller in ROS 2: `2017`, `ros2_control` or `both` (default).",
            NETWORK,
        ),
    ] = None

    def options(self, *, lockstep: bool) -> ServerOptions:
        """Return the options of the server."""
        ros2 = ros2_options(ros2=self.ros2, discovery=self.ros2_range, names=self.ros2_names)
        return ServerOptions(self.host, self.port, lockstep=lockstep, ros1=self.ros1, ros2=ros2)


@dataclass(frozen=True)
class PageAddress:
    """Options of a page's address."""

    view_host: Annotated[
        str | None,
        option(
            "HOST", f"Address of the page. Default: {LOOPBACK}; any other requires the token that is printed.", VIEWING
        ),
    ] = None
    view_port: Annotated[
        int | None,
        option(
            "N",
            f"Port of the page; 0 takes a free one. Default: {DEFAULT_PORT}, or one of the next if it is in use.",
            VIEWING,
        ),
    ] = None
    open_page: Annotated[bool, flag("--open", "Open the page in this desktop's browser.", VIEWING)] = False

    def options(self) -> PageOptions:
        """Return the options of the page."""
        host = LOOPBACK if self.view_host is None else self.view_host
        port = DEFAULT_PORT if self.view_port is None else self.view_port
        in_range("--view-port", port, 0, 65535, "a port from 0 to 65535")
        return PageOptions(host, port, "" if _is_local(host) else secrets.token_urlsafe(16), self.open_page)


@dataclass(frozen=True)
class PageArguments:
    """Options of a page."""

    view: Annotated[bool, flag("--view", VIEW_HELP, VIEWING)] = False
    address: PageAddress = PageAddress()

    def options(self) -> PageOptions | None:
        """Return the options of the page; None for no page."""
        if self.view:
            return self.address.options()
        given = (self.address.view_host is not None, self.address.view_port is not None, self.address.open_page)
        for name, is_given in zip(("--view-host", "--view-port", "--open"), given, strict=True):
            if is_given:
                refuse(f"{name} requires --view")
        return None


@dataclass(frozen=True)
class VideoArguments:
    """Options of a video."""

    video: Annotated[
        Path | None,
        option(
            "FILE.mp4",
            "Write a video, 25 pictures per simulated second; it stays playable if the process is killed.",
            VIDEO,
        ),
    ] = None
    video_camera: Annotated[
        str | None,
        option("VIEW", "View of the video: a name as for pictures, or `x,y,z:x,y,z` for camera and target [m].", VIDEO),
    ] = None
    video_speed: Annotated[
        float, option("FACTOR", "Simulated seconds per second of video; 10 shortens 10 minutes to one.", VIDEO)
    ] = 1.0
    video_size: Annotated[
        str | None,
        option(
            "WxH",
            f"Size in pixels, such as 1920x1080. Default: {DEFAULT_VIDEO_SIZE}, or less where that is slow to draw.",
            VIDEO,
        ),
    ] = None
    video_fine: Annotated[
        bool, flag("--video-fine", "Smoother edges; without a GPU drawing takes half as long again.", VIDEO)
    ] = False

    def viewpoints(self) -> Mapping[str, Viewpoint | None]:
        """Return the camera of the video by its option; None if there is none."""
        with options.errors_of("--video-camera"):
            return {"--video-camera": None if self.video_camera is None else viewpoint(self.video_camera)}

    def options(self, views: Mapping[str, Camera] | None) -> VideoOptions | None:
        """Return the options of the video; None for no video.

        Args:
            views: the views that the option may name; None if they are known once the cell is.
        """
        file = options.output_file("--video", self.video, ".mp4")
        (camera,) = self.viewpoints().values()
        if camera is not None and views is not None:
            with options.errors_of("--video-camera"):
                camera = camera_of(camera, views)
        with options.errors_of("--video-speed:"):
            period_of(self.video_speed)
        size = None if self.video_size is None else _video_size(self.video_size)
        if file is None:
            if self != VideoArguments():
                refuse("--video-camera, --video-speed, --video-size and --video-fine require --video FILE.mp4")
            return None
        requested_backend()
        return VideoOptions(file, camera, self.video_speed, size, self.video_fine)


def video_sentence(video: VideoFigures) -> str:
    """Return the sentence about a video that was written."""
    return f"{video['file']}, {video['length']:.1f} s"


def ros2_options(*, ros2: bool, discovery: str | None, names: str | None = None) -> Ros2Options | bool:
    """Return the options of the node in ROS 2, with the command line's arguments for it; False for no node."""
    if not ros2:
        for name, value in {"--ros2-range": discovery, "--ros2-names": names}.items():
            if value is not None:
                refuse(f"{name} requires --ros2")
        return False
    if discovery not in (None, *RANGES):
        refuse(f"--ros2-range {discovery}: give {' or '.join(RANGES)}")
    if names not in (None, *NAMES):
        refuse(f"--ros2-names {names}: give {', '.join(NAMES[:-1])} or {NAMES[-1]}")
    return Ros2Options(discovery or RANGES[0], names or NAMES[0], tuple(ros_arguments))


def record_options(
    paths: Sequence[Path] | None, video: VideoOptions | None, log: Path | None = None, **about: Any
) -> RecordOptions:
    """Return the files that a run writes, with further facts about the run."""
    for path in paths or ():
        kind = path.suffix.lower()
        if kind not in KINDS:
            refuse(f"--record {path}: give a file such as run.mcap, or run.bag for ROS 1 tools")
        options.output_file("--record", path, kind)
    if paths:
        RecordingFiles(paths)
    return RecordOptions(paths or (), about, options.output_file("--log", log, ".jsonl"), video)


def _is_local(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _video_size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and len(text) < 20):
        refuse(f"--video-size {text}: give width and height in pixels, such as {DEFAULT_VIDEO_SIZE}")
    size = int(width), int(height)
    with options.errors_of(f"--video-size {text}:"):
        check_video_size(*size)
    return size
