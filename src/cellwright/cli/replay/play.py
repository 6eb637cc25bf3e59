"""Playing a recording to programs from the command line."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial

from rich.console import Console

from cellwright.cli import lines
from cellwright.cli.bar import bar
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.cli.view.arguments import PageWish
from cellwright.cli.view.page import page_on
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.engine.tempo import Tempo
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.ros1.host.identity import Identity
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.recording.format.reader import Recording
from cellwright.recording.replay.playing import AtEnd, Playing
from cellwright.recording.replay.recorded import NODE, Recorded
from cellwright.recording.replay.services import RecordingServices

IN_ROS = Identity(NODE, "recording", makes_frames=False)
"""The node that a recording is in ROS. It tells the time; frames are those that were recorded."""


@dataclass(frozen=True)
class PlayOptions:
    """What playing may be told.

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        start: simulation time [s] from which to play; None: from the begin.
        until: simulation time [s] up to which to play; None: to the end.
        at_end: what becomes of time then.
        host: address to listen at.
        port: port to listen at, as `Server` takes it.
        ros1: be a node of ROS 1 too.
        page: a page on it; None for none.
        paused: let time stand until somebody on the page lets it pass.
    """

    speed: float | None = 1.0
    start: float | None = None
    until: float | None = None
    at_end: AtEnd = AtEnd.STOP
    host: str = LOOPBACK
    port: int | None = None
    ros1: bool = False
    page: PageWish | None = None
    paused: bool = False


def play(recording: Recording, wanted: PlayOptions, console: Console) -> None:
    """Play it until it is over, or a signal comes.

    Raises:
        UsageError: the address cannot be listened at, or there is no ROS 1.
        RecordingError: the file is damaged.
    """
    is_stopped = Stop()
    with stopped_by_signals(is_stopped.stop), ExitStack() as to_close:
        warn = partial(console.print, markup=False, soft_wrap=True, style="yellow")
        ros = to_close.enter_context(Ros1(warn, lambda: is_stopped.has_come, identity=IN_ROS)) if wanted.ros1 else None
        if ros is not None:
            ros.prepare()
        recorded = Recorded(recording, report=warn)
        server = Server(recorded, host=wanted.host, port=wanted.port, report=warn)
        to_close.callback(server.close, "the recording is over")
        if not server.is_local:
            lines.warn(f"{wanted.host}: anybody who reaches this machine can see the recording")
        tell = to_close.enter_context(bar(console, recorded.name, None))

        def poll() -> None:
            if ros is not None:
                ros.poll()
            if tell is not None:
                now, last = recorded.simulation.time, seconds(playing.last)
                tell(None, f"{now:.1f} of {last:.1f} s{', paused' if playing.tempo.is_paused else ''}")

        playing = Playing(
            recorded,
            server,
            tempo=Tempo(wanted.speed, paused=wanted.paused),
            first=_time(wanted.start),
            last=_time(wanted.until),
            at_end=wanted.at_end,
            on_poll=poll,
        )
        RecordingServices(playing).offer(server)
        say = partial(console.print, markup=False, soft_wrap=True)
        to_close.enter_context(page_on(server, wanted.page, f"{recorded.name} · Cellwright", say))
        is_stopped.follow(playing.stop)
        if ros is not None:
            ros.join(server.address, {"use_sim_time": True}, server.wait)
        if not is_stopped.has_come:
            where = "" if ros is None else f", ROS 1 at {ros.master.uri} as {IN_ROS.node}"
            console.print(lines.ready(recorded.name, server, wanted.speed) + where, markup=False, soft_wrap=True)
            playing.run()
    if recorded.player.unreadable:
        lines.note(console, "unreadable", f"{recorded.player.unreadable} messages")


def _time(value: float | None) -> int | None:
    return None if value is None else nanoseconds(value)
