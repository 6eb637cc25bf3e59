"""Command `cellwright replay`: a recording, listed, played, or run again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from cellwright.cli import arguments, options, output
from cellwright.cli.arguments import (
    OUTPUT,
    SPEED_HELP,
    AsJson,
    Host,
    OpenPage,
    Port,
    Recorded,
    View,
    ViewHost,
    ViewPort,
    page_options,
)
from cellwright.cli.main import DONE, flag, option
from cellwright.cli.output import progress_bar
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.engine.rate_control import RateControl
from cellwright.viewer.web.start import LOOPBACK

if TYPE_CHECKING:
    from cellwright.recording.format.reader import RecordingFile

_PLAY, _VERIFY = "Playback", "Verification"


def replay(
    file: Recorded,
    serve: Annotated[bool, flag("--serve", "Play to clients on a socket.", _PLAY)] = False,
    ros1: Annotated[
        bool, flag("--ros1", "Play to ROS 1 programs in simulation time, at the master in ROS_MASTER_URI.", _PLAY)
    ] = False,
    ros2: Annotated[bool, flag("--ros2", "Play to ROS 2 programs in simulation time.", _PLAY)] = False,
    ros2_range: arguments.Ros2Range = None,
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: OpenPage = False,
    speed: Annotated[str, option("FACTOR", SPEED_HELP, _PLAY)] = "1",
    start: Annotated[
        float | None, option("T", "Begin at this simulation time [s]; written files begin there too.", _PLAY)
    ] = None,
    until: Annotated[
        float | None, option("T", "End at this simulation time [s]; written files end there too.", _PLAY)
    ] = None,
    loop: Annotated[bool, flag("--loop", "Restart at the end.", _PLAY)] = False,
    hold: Annotated[bool, flag("--hold", "Hold time at the end, until Ctrl-C.", _PLAY)] = False,
    verify: Annotated[
        bool, flag("--verify", "Build the cell or robot again, repeat its inputs, and compare state hashes.", _VERIFY)
    ] = False,
    host: Host = LOOPBACK,
    port: Port = None,
    bag: Annotated[Path | None, option("OUT.bag", "Write the topics as a bag for ROS 1 tools.", OUTPUT)] = None,
    mcap: Annotated[
        Path | None,
        option("OUT.mcap", "Write topics, and the scene as markers in frames, for Foxglove and similar tools.", OUTPUT),
    ] = None,
    video: arguments.VideoFile = None,
    video_camera: arguments.VideoCamera = None,
    video_speed: arguments.VideoSpeed = 1.0,
    video_size: arguments.VideoSize = arguments.DEFAULT_VIDEO_SIZE,
    video_fine: arguments.VideoFine = False,
    as_json: AsJson = False,
) -> None:
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
    from cellwright.recording.format.bag import write_bag
    from cellwright.recording.format.reader import RecordingFile
    from cellwright.recording.replay.exported import write_mcap
    from cellwright.recording.replay.playback import AtEnd
    from cellwright.running.run.options import ServerOptions
    from cellwright.running.run.playback import PlaybackTarget

    console = Console(stderr=as_json, highlight=False)
    is_played = serve or ros1 or ros2 or view
    page = page_options(view=view, host=view_host, port=view_port, opens=open_page)
    if verify and is_played:
        options.refuse("--verify plays nothing; leave out --serve, --ros1, --ros2 and --view")
    if loop and hold:
        options.refuse("--loop and --hold: give one of them")
    filmed = arguments.video_options(video, video_camera, video_speed, video_size, fine=video_fine)
    if filmed and (is_played or verify):
        options.refuse("--video excludes playback and --verify; leave out --view, --serve, --ros1, --ros2 and --verify")
    times = {"--start": start is not None, "--until": until is not None}
    played = {"--loop": loop, "--hold": hold, "--speed": speed != "1"}
    for name, is_given in {**played, **({} if filmed or bag or mcap else times)}.items():
        if is_given and not is_played:
            others = "" if name in played else ", or --bag, --mcap or --video for a file"
            options.refuse(f"{name} requires --view, --serve, --ros1 or --ros2{others}")
    rate = options.speed(speed)
    for name, time in (("--start", start), ("--until", until)):
        options.in_range(name, time, 0.0, options.LATEST, f"a time from 0 s to {options.LATEST:g} s")
    part = {"start": _nanoseconds(start), "until": _nanoseconds(until)}
    bag_file, mcap_file = options.output_file("--bag", bag, ".bag"), options.output_file("--mcap", mcap, ".mcap")
    with RecordingFile(file) as recording:
        _check_times(recording, start, until)
        if not recording.is_complete:
            output.warn(f"{file}: cut short; ends at {recording.end_time / 1e9:.3f} s")
        if bag_file is not None:
            with progress_bar(console, f"writing {bag_file}", 1.0) as show:
                left_out = write_bag(file, bag_file, **part, on_progress=show)
            for topic in left_out:
                output.warn(f"{topic}: not in the bag, since its type differs in ROS 1")
        if mcap_file is not None:
            with progress_bar(console, f"writing {mcap_file}", 1.0) as show:
                missing = write_mcap(recording, mcap_file, **part, on_progress=show)
            for line in missing:
                output.warn(f"{mcap_file}: {line}")
        if verify:
            raise typer.Exit(actions.verify_recording(recording, console, as_json=as_json))
        if is_played:
            at_end = AtEnd.LOOP if loop else AtEnd.HOLD if hold or view else AtEnd.STOP
            actions.play_recording(
                PlaybackTarget(recording, first=part["start"], last=part["until"], at_end=at_end),
                console,
                rate=RateControl(rate),
                serve=ServerOptions(host, port if serve or ros1 or ros2 else 0),  # a page finds any port
                view=page,
                ros1=ros1,
                ros2=arguments.ros2_options(ros2=ros2, discovery=ros2_range),
            )
        contents = actions.contents_document(recording)
        if filmed is not None:
            with progress_bar(console, f"drawing {filmed.file}", 1.0) as show:
                contents["videos"] = [
                    actions.film_recording(
                        recording, filmed, start=start, until=until, warn=output.warn, on_progress=show
                    )
                ]
    if as_json:
        typer.echo(json.dumps(contents, indent=2))
    elif filmed is not None or bag_file is not None or mcap_file is not None:
        output.print_files(console, "video", map(arguments.video_sentence, contents.get("videos", ())))
        output.print_files(console, "bag", [bag_file] if bag_file else ())
        output.print_files(console, "mcap", [mcap_file] if mcap_file else ())
    elif not is_played:
        actions.show_contents(console, contents)
    raise typer.Exit(DONE)


def _check_times(recording: RecordingFile, start: float | None, until: float | None) -> None:
    """Refuse a time range outside the recording: it would be over at once."""
    begin, end = seconds(recording.begin), seconds(recording.end_time)
    if start is not None and start > end:
        options.refuse(f"--start {start:g}: {recording.path} ends at {end:.3f} s")
    if until is not None and until < begin:
        options.refuse(f"--until {until:g}: {recording.path} begins at {begin:.3f} s")
    if start is not None and until is not None and until < start:
        options.refuse(f"--until {until:g}: is before --start {start:g}")


def _nanoseconds(time: float | None) -> int | None:
    return None if time is None else nanoseconds(time)
