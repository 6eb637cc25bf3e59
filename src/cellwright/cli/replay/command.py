"""Command `cellwright replay`: a recording, listed, played, or run again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from cellwright.cli import options, output
from cellwright.cli.arguments import (
    OUTPUT,
    SPEED_HELP,
    AsJson,
    PageArguments,
    Recorded,
    Ros2Range,
    ServerArguments,
    VideoArguments,
    ros2_options,
    video_sentence,
)
from cellwright.cli.main import DONE
from cellwright.cli.output import progress_bar
from cellwright.cli.parameters import flag, option, with_groups
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.engine.rate_control import RateControl

if TYPE_CHECKING:
    from cellwright.recording.format.reader import RecordingFile
    from cellwright.rendering.video import VideoFigures
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.running.run import PageOptions

_PLAY, _VERIFY = "Playback", "Verification"


@dataclass(frozen=True, kw_only=True)
class PlaybackArguments:
    """Options of playback; the times are also those of written files."""

    serve: Annotated[bool, flag("--serve", "Play to clients on a socket.", _PLAY)] = False
    ros1: Annotated[
        bool, flag("--ros1", "Play to ROS 1 programs in simulation time, at the master in ROS_MASTER_URI.", _PLAY)
    ] = False
    ros2: Annotated[bool, flag("--ros2", "Play to ROS 2 programs in simulation time.", _PLAY)] = False
    ros2_range: Ros2Range = None
    page: PageArguments
    speed: Annotated[str, option("FACTOR", SPEED_HELP, _PLAY)] = "1"
    start: Annotated[
        float | None, option("T", "Begin at this simulation time [s]; written files begin there too.", _PLAY)
    ] = None
    until: Annotated[
        float | None, option("T", "End at this simulation time [s]; written files end there too.", _PLAY)
    ] = None
    loop: Annotated[bool, flag("--loop", "Restart at the end.", _PLAY)] = False
    hold: Annotated[bool, flag("--hold", "Hold time at the end, until Ctrl-C.", _PLAY)] = False

    @property
    def has_clients(self) -> bool:
        """True if it is played to programs."""
        return self.serve or self.ros1 or self.ros2

    @property
    def is_played(self) -> bool:
        """True if it is played at all."""
        return self.has_clients or self.page.view

    @property
    def part(self) -> dict[str, int | None]:
        """The first and the last time [ns], None for those of the recording."""
        return {
            name: None if time is None else nanoseconds(time)
            for name, time in (("start", self.start), ("until", self.until))
        }

    def refuse(self, *, is_written: bool) -> None:
        """Refuse what does not go together; times may be given for playback and for written files alone."""
        if self.loop and self.hold:
            options.refuse("--loop and --hold: give one of them")
        played = {"--loop": self.loop, "--hold": self.hold, "--speed": self.speed != "1"}
        times = {"--start": self.start is not None, "--until": self.until is not None}
        for name, is_given in {**played, **({} if is_written else times)}.items():
            if is_given and not self.is_played:
                others = "" if name in played else ", or --bag, --mcap or --video for a file"
                options.refuse(f"{name} requires --view, --serve, --ros1 or --ros2{others}")
        for name, time in (("--start", self.start), ("--until", self.until)):
            options.in_range(name, time, 0.0, options.LATEST, f"a time from 0 s to {options.LATEST:g} s")

    def check_times(self, recording: RecordingFile) -> None:
        """Refuse a time range outside the recording: it would be over at once."""
        start, until = self.start, self.until
        begin, end = seconds(recording.begin), seconds(recording.end_time)
        if start is not None and start > end:
            options.refuse(f"--start {start:g}: {recording.path} ends at {end:.3f} s")
        if until is not None and until < begin:
            options.refuse(f"--until {until:g}: {recording.path} begins at {begin:.3f} s")
        if start is not None and until is not None and until < start:
            options.refuse(f"--until {until:g}: is before --start {start:g}")


@dataclass(frozen=True, kw_only=True)
class ReplayArguments:
    """Arguments and options of `cellwright replay`, in the order of its help."""

    file: Recorded
    playback: PlaybackArguments
    verify: Annotated[
        bool, flag("--verify", "Build the cell or robot again, repeat its inputs, and compare state hashes.", _VERIFY)
    ] = False
    server: ServerArguments
    bag: Annotated[Path | None, option("OUT.bag", "Write the topics as a bag for ROS 1 tools.", OUTPUT)] = None
    mcap: Annotated[
        Path | None,
        option("OUT.mcap", "Write topics, and the scene as markers in frames, for Foxglove and similar tools.", OUTPUT),
    ] = None
    video: VideoArguments
    as_json: AsJson = False


@with_groups
def replay(given: ReplayArguments) -> None:
    """List the content of a recording, play it to programs, or verify that it repeats.

    A file that was cut short, for example by a killed process, is used as far as it goes.

        # list its content
        cellwright replay run.mcap

        # play it on a page in your browser, with a time slider
        cellwright replay run.mcap --view

        # play it to ROS 1, twice as fast, from 20 s on
        cellwright replay run.mcap --ros1 --speed 2 --start 20

        # play it to clients on a socket, in a loop
        cellwright replay run.mcap --serve --loop

        # convert it for rosbag and similar tools
        cellwright replay run.mcap --bag run.bag

        # convert it for Foxglove and similar tools, with the whole cell in 3D
        cellwright replay run.mcap --mcap foxglove.mcap

        # check that the same inputs give the same states
        cellwright replay run.mcap --verify

        # make a video, a minute in 6 s
        cellwright replay run.mcap --video run.mp4 --video-speed 10

    Exit status: 0 done, or equal; 1 --verify found a difference; 2 the file cannot be used, holds nothing to compare or
    to draw, or the video cannot be written.
    """
    # slow to load, and the other commands do without it
    from cellwright.cli.replay import actions
    from cellwright.recording.format.reader import RecordingFile

    console, playback = Console(stderr=given.as_json, highlight=False), given.playback
    page = playback.page.options()
    if given.verify and playback.is_played:
        options.refuse("--verify plays nothing; leave out --serve, --ros1, --ros2 and --view")
    video = given.video.options(None)
    if video and (playback.is_played or given.verify):
        options.refuse("--video excludes playback and --verify; leave out --view, --serve, --ros1, --ros2 and --verify")
    playback.refuse(is_written=bool(video or given.bag or given.mcap))
    rate = options.speed(playback.speed)
    options.output_file("--bag", given.bag, ".bag")
    options.output_file("--mcap", given.mcap, ".mcap")
    with RecordingFile(given.file) as recording:
        playback.check_times(recording)
        if not recording.is_complete:
            output.warn(f"{given.file}: cut short; ends at {recording.end_time / 1e9:.3f} s")
        _convert(given, recording, console)
        if given.verify:
            raise typer.Exit(actions.verify_recording(recording, console, as_json=given.as_json))
        if playback.is_played:
            _play(given, recording, rate, page, console)
        contents = actions.contents_document(recording)
        if video is not None:
            contents["videos"] = [_film(playback, recording, video, console)]
    if given.as_json:
        typer.echo(json.dumps(contents, indent=2))
    elif video is not None or given.bag is not None or given.mcap is not None:
        output.print_files(console, "video", map(video_sentence, contents.get("videos", ())))
        output.print_files(console, "bag", [given.bag] if given.bag else ())
        output.print_files(console, "mcap", [given.mcap] if given.mcap else ())
    elif not playback.is_played:
        actions.show_contents(console, contents)
    raise typer.Exit(DONE)


def _convert(given: ReplayArguments, recording: RecordingFile, console: Console) -> None:
    """Write the recording for other tools."""
    from cellwright.recording.format.bag import write_bag
    from cellwright.recording.replay.exported import write_mcap

    part = given.playback.part
    if given.bag is not None:
        with progress_bar(console, f"writing {given.bag}", 1.0) as show:
            left_out = write_bag(given.file, given.bag, **part, on_progress=show)
        for topic in left_out:
            output.warn(f"{topic}: not in the bag, since its type differs in ROS 1")
    if given.mcap is not None:
        with progress_bar(console, f"writing {given.mcap}", 1.0) as show:
            missing = write_mcap(recording, given.mcap, **part, on_progress=show)
        for line in missing:
            output.warn(f"{given.mcap}: {line}")


def _play(
    given: ReplayArguments, recording: RecordingFile, rate: float | None, page: PageOptions | None, console: Console
) -> None:
    """Play the recording to programs and on a page."""
    from cellwright.cli.replay.actions import play_recording
    from cellwright.recording.replay.playback import AtEnd
    from cellwright.running.run.options import ServerOptions
    from cellwright.running.run.playback import PlaybackTarget

    playback, part = given.playback, given.playback.part
    at_end = AtEnd.LOOP if playback.loop else AtEnd.HOLD if playback.hold or playback.page.view else AtEnd.STOP
    play_recording(
        PlaybackTarget(recording, first=part["start"], last=part["until"], at_end=at_end),
        console,
        rate=RateControl(rate),
        serve=ServerOptions(
            given.server.host,
            given.server.port if playback.has_clients else 0,  # a page finds any port
            ros1=playback.ros1,
            ros2=ros2_options(ros2=playback.ros2, discovery=playback.ros2_range),
        ),
        view=page,
    )


def _film(playback: PlaybackArguments, recording: RecordingFile, video: VideoOptions, console: Console) -> VideoFigures:
    """Draw the video of the recording."""
    from cellwright.cli.replay.actions import film_recording

    with progress_bar(console, f"drawing {video.file}", 1.0) as show:
        return film_recording(
            recording, video, start=playback.start, until=playback.until, warn=output.warn, on_progress=show
        )
