"""Options of a session: the run itself, its server, its page and its recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.cell.cell import Cell
from cellwright.config.parsing.sources import Sources
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

if TYPE_CHECKING:
    from cellwright.recording.format.run_log import RunLog

GRACE = 2.0
"""Simulation time [s] that an agent may go on after the competition is done, to notice it."""


@dataclass(frozen=True)
class RecordOptions:
    """Options of a recording.

    Example:
        >>> options = RecordOptions([Path("run.mcap"), Path("run.bag")], {"agent": "my robot"})
        >>> [path.suffix for path in options.paths]
        ['.mcap', '.bag']

    Attributes:
        paths: files to write: `.mcap`, or `.bag` for the tools of ROS 1.
        about: further facts of the caller about the run, such as the agent's name.
        sources: the files that the trial was read from, so that the recording needs no other.
        files: those files that were named, in their order.
        is_varied: whether the seed varied the trial after it was read.
        report: receives a line about a file that can no longer be written.
    """

    paths: Sequence[Path]
    about: Mapping[str, Any] = field(default_factory=dict)
    sources: Sources | None = None
    files: Sequence[Path] = ()
    is_varied: bool = False
    report: Callable[[str], None] = lambda _line: None


@dataclass(frozen=True)
class RunOptions:
    """Options of a run besides its cell and its agent.

    Example:
        >>> import cellwright
        >>> options = cellwright.RunOptions(until=0.1, listen=["/clock"])
        >>> cellwright.run_trial("lesson", None, options=options).heard
        {'/clock': 50}

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        until: stop at this simulation time [s]; None: when the run is over.
        ends_when_done: whether the run ends soon after the competition does; else it goes on.
        listen: further topics to listen to; "all" stands for every topic.
        at: actions at given simulation times [s], such as taking a picture.
        on_progress: called ten times a simulated second.
        checkpoints: files to save the simulation to, at given simulation times [s]; the times are part of the run.
        log: receives events, to write them to disk as they happen.
        record: how the run is recorded, if it is.
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
    log: RunLog | None = None
    record: RecordOptions | None = None


@dataclass(frozen=True)
class ServerOptions:
    """Address at which a session serves clients.

    Example:
        >>> import cellwright
        >>> from cellwright.running.run import ServerOptions
        >>> with cellwright.Session("lesson", serve=ServerOptions(port=0)) as session:
        ...     session.address[0]
        '127.0.0.1'

    Attributes:
        host: address to listen at.
        port: port to listen at; 0: any that is free; None: 11399, or one of the next where it is in use.
    """

    host: str = LOOPBACK
    port: int | None = None


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
