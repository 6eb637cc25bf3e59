"""Options of a session: the run itself, its server, its page, its files, and the lines it prints."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from cellwright.cell.cell import Cell
from cellwright.config.trial.trial import Trial
from cellwright.rendering.video_options import VideoOptions
from cellwright.util.errors import UsageError
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

if TYPE_CHECKING:
    from cellwright.middleware.ros2.host import Ros2, Ros2Options
    from cellwright.recording.format.run_log import RunLog

GRACE = 2.0
"""Simulation time [s] that an agent may go on after the competition is done, to notice it."""


def warn_at_runtime(line: str) -> None:
    """Issue a line as a `RuntimeWarning`."""
    warnings.warn(line, RuntimeWarning, stacklevel=2)


@dataclass(frozen=True)
class RecordOptions:
    """Files that a session writes of each run. A second run has files of its own: `run_2.mcap`.

    Example:
        >>> options = RecordOptions.of(["run.mcap", "run.jsonl"])
        >>> options.paths, options.log
        ((PosixPath('run.mcap'),), PosixPath('run.jsonl'))

    Attributes:
        paths: recordings: `.mcap`, or `.bag` for the tools of ROS 1.
        about: further facts of the caller about the run, such as the agent's name: for recordings and log.
        log: a file for the events of each run of a cell (`run.jsonl`), or a log that is open already.
        video: a video.
    """

    paths: Sequence[Path] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    log: Path | RunLog | None = None
    video: VideoOptions | None = None

    @classmethod
    def of(cls, files: str | Path | Sequence[str | Path]) -> Self:
        """Return the options for files, by their suffixes: `.jsonl` a log, `.mp4` a video, any other a recording.

        Raises:
            UsageError: two logs or two videos, or the extra `video` is not installed.
        """
        by_suffix: dict[str, list[Path]] = {".jsonl": [], ".mp4": [], "": []}
        for path in map(Path, [files] if isinstance(files, str | Path) else files):
            suffix = path.suffix.lower()
            by_suffix[suffix if suffix in by_suffix else ""].append(path)
        logs, videos, paths = by_suffix.values()
        for kind in (logs, videos):
            if len(kind) > 1:
                raise UsageError(f"record: {kind[1]}: {kind[0]} is of this kind already; leave one out")
        return cls(tuple(paths), log=logs[0] if logs else None, video=VideoOptions(videos[0]) if videos else None)

    @property
    def has_files(self) -> bool:
        """True if a run writes any file."""
        return bool(self.paths) or self.log is not None or self.video is not None


@dataclass(frozen=True)
class RunOptions:
    """Options of a run besides its target and its agent; most are for cells.

    Example:
        >>> import cellwright
        >>> options = cellwright.RunOptions(until=0.1, listen=["/clock"])
        >>> cellwright.run_trial("lesson", None, options=options).heard
        {'/clock': 50}

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        until: stop at this simulation time [s]; None: when the run is over.
        ends_when_done: True if the run ends soon after the competition does; else it goes on.
        listen: further topics to listen to; "all" stands for every topic.
        at: actions at given simulation times [s], such as taking a picture.
        on_progress: called ten times a simulated second.
        checkpoints: files to save the simulation to, at given simulation times [s]; the times are part of the run.
        observers: called with the session when a run starts; each returns a context manager, left when it is over.
        start: a checkpoint to start from, instead of time 0. The agent starts from its beginning all the same.
    """

    speed: float | None = None
    until: float | None = None
    ends_when_done: bool = True
    listen: Sequence[str] = ()
    at: Sequence[tuple[Fraction, Callable[[Cell], None]]] = ()
    on_progress: Callable[[Cell], None] | None = None
    checkpoints: Sequence[tuple[Fraction, Path]] = ()
    start: Path | None = None
    observers: Sequence[Callable[[Any], AbstractContextManager[Any]]] = ()


@dataclass(frozen=True)
class WorldOptions:
    """Options of a session that another one with another trial may follow.

    Attributes:
        load: called with the session and the trial; ends the session soon.
        kept: keeps the node of ROS 2 beyond the session.
        ros2: the node that the session before has left there.
    """

    load: Callable[[Any, Trial], None]
    kept: ExitStack
    ros2: Ros2 | None = None


@dataclass(frozen=True)
class ServerOptions:
    """Options of the server of a session, for clients in other processes, in ROS too.

    Example:
        >>> import cellwright
        >>> from cellwright.running.run import ServerOptions
        >>> with cellwright.Session("lesson", serve=ServerOptions(port=0)) as session:
        ...     session.address[0]
        '127.0.0.1'

    Attributes:
        host: address to listen at.
        port: port to listen at; 0: any that is free; None: 11399, or one of the next where it is in use.
        lockstep: advance simulation time only on a client's request.
        ros1: also be a node of ROS 1.
        ros2: also be a node of ROS 2; the options hold its range, and arguments for rclpy.
        on_ready: called with the session when clients can connect and time is about to pass.
        restart_refusal: reason why clients may not start the run again; empty if they may.
        worlds: loader of other trials; None if that is not possible.
    """

    host: str = LOOPBACK
    port: int | None = None
    lockstep: bool = False
    ros1: bool = False
    ros2: bool | Ros2Options = False
    on_ready: Callable[[Any], object] = lambda _session: None
    restart_refusal: str = ""
    worlds: WorldOptions | None = None


@dataclass(frozen=True)
class Outputs:
    """Receivers of the lines for people.

    Example:
        >>> import cellwright
        >>> lines = []
        >>> outputs = cellwright.Outputs(on_message=lines.append)
        >>> with cellwright.Session("lesson", view=cellwright.PageOptions(port=0), outputs=outputs) as session:
        ...     lines == [f"page: {session.url}"]
        True

    Attributes:
        report: receives a line about a file or an address that is not as it should be.
        notice: receives a line about clients and ROS meanwhile; None: as `report`.
        on_message: receives a line such as the address of the page.
    """

    report: Callable[[str], None] = warn_at_runtime
    notice: Callable[[str], None] | None = None
    on_message: Callable[[str], None] = print

    def note(self, line: str) -> None:
        """Pass on a line about clients and ROS."""
        (self.notice or self.report)(line)


@dataclass(frozen=True)
class PageOptions:
    """Options of a session's page in a browser.

    Example:
        >>> from cellwright.running.run import PageOptions
        >>> options = PageOptions(port=8090)
        >>> (options.host, options.port, options.opens)
        ('127.0.0.1', 8090, False)

    Attributes:
        host: address to listen at for browsers.
        port: port to listen at, or one of the next ones.
        token: token that its address must hold; empty if only this machine can reach it.
        opens: open it in a browser here.
    """

    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    token: str = ""
    opens: bool = False


def reachable_address(address: tuple[str, int]) -> tuple[str, int]:
    """Return host and port at which a program on this machine reaches a server that listens at `address`."""
    host, port = address
    return (LOOPBACK if ip_address(host).is_unspecified else host, port)
