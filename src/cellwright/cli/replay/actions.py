"""Actions on a recording: list its content, verify it, play it, and film it."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import typer
from rich.console import Console
from rich.text import Text

from cellwright.cli import output
from cellwright.cli.main import BAD_INPUT, DONE, NOT_DONE
from cellwright.cli.options import errors_of
from cellwright.cli.output import echo, print_entry, print_line, progress_bar
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.engine.clock import NANOSECONDS, nanoseconds, seconds
from cellwright.engine.rate_control import RateControl
from cellwright.recording.format.format import COMMAND, FRAME, PANEL, STATE_HASH
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay import verify
from cellwright.recording.replay.frame_cursor import FrameCursor
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, TickTime, VerificationResult
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.scene.scene import decode_scene
from cellwright.rendering.video import Video, VideoFigures
from cellwright.rendering.video_options import SIZE, VideoOptions, period_of
from cellwright.rendering.video_pace import VideoPace
from cellwright.rendering.views import OVERVIEW, camera_of, gear2017_views
from cellwright.robot.pictures import TILT, TURN, camera_on, robot_lamp
from cellwright.running.run import PageOptions, RunOptions, ServerOptions, Session, versions
from cellwright.running.run.playback import PlaybackTarget
from cellwright.util.errors import MessageError, UsageError

_MAX_WIDTH = 1000  # columns
_MAX_FACT = 200  # characters of a value of the header in the table
_STATUS = {Answer.EQUAL: DONE, Answer.DIFFERENT: NOT_DONE, Answer.UNKNOWN: BAD_INPUT}


def contents_document(recording: RecordingFile) -> dict[str, Any]:
    """Return its content as JSON values; times in s, rates in Hz of simulation time."""
    length = seconds(recording.end_time - recording.begin)
    counts = recording.counts
    return {
        "file": str(recording.path),
        "bytes": recording.path.stat().st_size,
        "kind": recording.header.kind,
        "name": recording.header.name,
        "complete": recording.is_complete,
        "begin": seconds(recording.begin),
        "end": seconds(recording.end_time),
        "duration": length,
        "commands": counts[COMMAND],
        "state_hashes": counts[STATE_HASH],
        "result": recording.end,
        "header": dict(recording.header.facts),
        "attachments": recording.attachments,
        "topics": [
            {
                "name": topic.name,
                "type": topic.type,
                "direction": topic.direction,
                "own": topic.is_own,
                "latch": topic.latch,
                "rate": topic.rate,
                "messages": counts[topic.name],
                "measured": counts[topic.name] / length if length > 0.0 else None,
            }
            for topic in sorted(recording.topics.values(), key=lambda each: each.name)
        ],
    }


def show_contents(console: Console, contents: dict[str, Any]) -> None:
    """Print the content document."""
    print_line(console, f"{contents['kind']} {contents['name']}, recorded in {contents['file']}")
    console.print()
    whole = _topics(contents)
    needed = console.measure(whole, options=console.options.update(width=_MAX_WIDTH)).maximum
    if not console.is_terminal:
        console.width = max(console.width, needed)  # nothing is folded in a file or through a pipe
    print_table(console, _topics(contents, is_narrow=needed > console.width))
    console.print()
    for name, text in _notes(contents):
        if text:
            print_entry(console, name, " ".join(text.split()))


def _topics(contents: dict[str, Any], *, is_narrow: bool = False) -> FittedTable:
    """Return a table with a row for each topic with messages; a narrow table leaves out the packages of types."""
    rows: list[list[str | Text]] = []
    for topic in contents["topics"]:
        if topic["own"] or not topic["messages"]:
            continue
        often = topic["measured"] if topic["rate"] not in ("", "on event") else None
        figures = [str(topic["messages"]), "" if often is None else f"{often:.3g}"]
        kind = topic["type"].rpartition("/")[2] if is_narrow else topic["type"]
        rows.append([Text(topic["name"]), topic["direction"], *figures, Text(kind)])
    columns = {"topic": FOLD, "": WHOLE, "messages": RIGHT, "Hz": RIGHT, "type": FOLD}
    return table(columns, rows, padding=(0, 1, 0, 0), collapse_padding=True)


def _notes(contents: dict[str, Any]) -> list[tuple[str, str]]:
    header, result = contents["header"], contents["result"] or {}
    known = _versions(header)
    silent = sum(not topic["messages"] and not topic["own"] for topic in contents["topics"])
    return [
        ("silent", f"{silent} topics" if silent else ""),
        ("time", f"{contents['begin']:.3f} to {contents['end']:.3f} s: {contents['duration']:.1f} s"),
        ("ended", _ended(contents)),
        ("score", _score(result)),
        ("commands", f"{contents['commands']} from outside"),
        ("verify", f"{contents['state_hashes']} state hashes" if contents["state_hashes"] else "no state hash"),
        *((name, _fact(header[name])) for name in ("agent", "seed", "servo") if name in header),
        ("versions", ", ".join(f"{name} {each}" for name, each in known.items())),
        ("size", f"{contents['bytes'] / 1e6:.1f} MB"),
    ]


def _ended(contents: dict[str, Any]) -> str:
    outcome = (contents["result"] or {}).get("outcome")
    if contents["complete"]:
        return f"complete: {outcome}" if outcome else "complete"
    return "cut short; holds everything written until then"


def _score(result: dict[str, Any]) -> str:
    score = result.get("score")
    total = score.get("total") if isinstance(score, dict) else score
    return f"{total:g} points" if isinstance(total, int | float) else ""


def _fact(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text[:_MAX_FACT]


def verify_recording(recording: RecordingFile, console: Console, *, as_json: bool) -> int:
    """Run it again, and print the verdict; return the exit status."""
    recording.check_bytes()
    with rebuild(recording) as rebuilt, progress_bar(console, "verifying", seconds(recording.end_time)) as show:

        def progress(time: int) -> None:
            if show is not None:
                show(seconds(time), f"{seconds(time):.0f} of {seconds(recording.end_time):.0f} s")

        verdict = verify.verify(rebuilt, verify.recorded_steps(recording), progress, recording.end)
    others = verify.versions_that_differ(_versions(recording.header.facts), versions())
    if as_json:
        typer.echo(json.dumps(verdict_document(verdict, others) | {"complete": recording.is_complete}, indent=2))
    else:
        show_verdict(console, verdict, others)
    return _STATUS[verdict.answer]


def verdict_document(verdict: VerificationResult, others: list[str]) -> dict[str, Any]:
    """Return the verdict as JSON values; times in s."""
    return {
        "answer": verdict.answer.value,
        "state_hashes": verdict.hashes,
        "frames": verdict.frames,
        "commands": verdict.commands,
        "policy_requests": verdict.requests,
        "policy": verdict.policy,
        "equal_until": _moment(verdict.equal_until),
        "different_at": _moment(verdict.first_difference),
        "bodies": list(verdict.bodies),
        "points": verdict.points,
        "recorded_points": None if verdict.points is None else verdict.recorded_points,
        "success": verdict.success,
        "recorded_success": None if verdict.success is None else verdict.recorded_success,
        "error": verdict.fault,
        "begun": _moment(verdict.begun),
        "reached": _moment(verdict.reached),
        "wall": verdict.wall,
        "versions": others,
    }


def show_verdict(console: Console, verdict: VerificationResult, others: list[str]) -> None:
    """Print the verdict."""
    for name, text in _lines(verdict):
        print_entry(console, name, text)
    for line in others:
        print_entry(console, "version", line)


def _lines(verdict: VerificationResult) -> list[tuple[str, str]]:
    hashes = f"{verdict.hashes} state hash{'' if verdict.hashes == 1 else 'es'}"
    compared = f"{hashes} and {verdict.frames} frames equal, {verdict.commands} commands"
    lines = [("compared", compared)]
    match verdict.answer:
        case Answer.EQUAL:
            lines.append(("equal", f"up to {verdict.equal_until}"))
        case Answer.UNKNOWN:
            lines.append(("unknown", "cut short before the first state hash; nothing to compare"))
        case Answer.DIFFERENT:
            until = "" if verdict.equal_until is None else f"; equal up to {verdict.equal_until}"
            if verdict.first_difference or verdict.fault:
                lines.append(("different", f"at {verdict.first_difference or verdict.reached}{until}"))
            if verdict.bodies:
                lines.append(("bodies", ", ".join(verdict.bodies)))
            if verdict.has_other_points:
                recorded = f"{verdict.recorded_points:g} in the recording"
                lines.append(("points", f"{verdict.points:g} by the commands, but {recorded}"))
            if verdict.policy:
                lines.append(("policy", verdict.policy))
            if verdict.has_other_success:
                words = "succeeded", "not done"
                here, there = words if verdict.success else words[::-1]
                lines.append(("task", f"{here} by the commands, but {there} in the recording"))
            if verdict.fault:
                lines.append(("error", verdict.fault))
    length = seconds(verdict.reached.time - verdict.begun.time)
    lines.append(("ran", f"{length:.1f} s in {verdict.wall:.1f} s: {verdict.factor:.1f} x real time"))
    return lines


def _moment(moment: TickTime | None) -> dict[str, Any] | None:
    return None if moment is None else {"tick": moment.tick, "time": seconds(moment.time)}


def _versions(facts: Mapping[str, Any]) -> dict[str, str]:
    versions = facts.get("versions")
    return {str(name): str(each) for name, each in versions.items()} if isinstance(versions, dict) else {}


def play_recording(
    target: PlaybackTarget,
    console: Console,
    *,
    rate: RateControl,
    serve: ServerOptions,
    view: PageOptions | None = None,
) -> None:
    """Play a recording until it is over, or a signal stops it."""

    def status(session: Session) -> str:
        now, last = session.node.simulation.time, seconds(target.playing.last)
        return f"{now:.1f} of {last:.1f} s{', paused' if rate.is_paused else ''}"

    session = Session(
        target,
        rate=rate,
        serve=replace(serve, on_ready=output.report_ready),
        view=view or False,
        options=RunOptions(observers=[RunProgress(console, status=status)]),
        outputs=output.session_outputs(console, partial(print_line, console, style="yellow")),
    )
    with stopped_by_signals(session.stop.request), session:
        session.run()
    if session.node.unreadable:
        output.print_entry(console, "unreadable", f"{session.node.unreadable} messages")


def film_recording(
    recording: RecordingFile,
    options: VideoOptions,
    *,
    start: float | None,
    until: float | None,
    warn: Callable[[str], None],
    on_progress: Callable[[float], None] | None,
) -> VideoFigures:
    """Make a video of a recording between two times [s], its last frame at the end.

    `on_progress` receives the progress, 0..1.
    """
    begin = recording.begin if start is None else max(recording.begin, nanoseconds(start))
    end = recording.end_time if until is None else min(recording.end_time, nanoseconds(until))
    scene = _scene(recording)
    sight = FrameCursor(recording)
    sight.seek(begin)
    coming = recording.messages((FRAME, PANEL), start=begin + 1, until=end + 1)
    newest = next(coming, None)
    while sight.frame() is None and newest is not None:
        sight.take(newest)
        newest = next(coming, None)
    frame = sight.frame()
    if frame is None or begin > end:
        raise UsageError(f"{recording.path}: no frame between these times; choose others with --start and --until")
    camera = _camera(recording, scene, frame, options)
    lamp = LAMP if recording.header.kind == "cell" else robot_lamp(camera)
    video = Video(options, scene, frame, camera, lamp=lamp, warn=warn)
    report = partial(echo, err=True)
    if video.choice:
        report(video.choice)
    period, number = period_of(options.speed) * NANOSECONDS, 0
    video.pace = VideoPace(video.options, math.ceil((end - begin) / period) + 1, report)
    try:
        time = begin - 1
        while time < end and not video.error:
            time = min(begin + round(number * period), end)
            while newest is not None and newest.time <= time:
                sight.take(newest)
                newest = next(coming, None)
            frame = sight.frame() or frame
            video.take(frame, camera, _caption(time, sight.panel()))
            number += 1
            if on_progress is not None:
                on_progress(min(1.0, (time - begin) / max(1, end - begin)))
    finally:
        video.close()
    return video.made


def _scene(recording: RecordingFile) -> Scene:
    data = recording.scene
    try:
        if data is not None:
            return decode_scene(data)
    except MessageError as error:
        raise UsageError(f"{recording.path}: scene cannot be read: {error}") from None
    raise UsageError(f"{recording.path}: has no scene to draw")


def _camera(recording: RecordingFile, scene: Scene, frame: SceneFrame, options: VideoOptions) -> Camera:
    """Return the requested camera, else the overview of a cell, or for a robot one that shows the whole robot."""
    if options.camera is not None or recording.header.kind == "cell":
        with errors_of("--video-camera"):
            return camera_of(options.camera or OVERVIEW, scene.views or gear2017_views())
    shown = EngineScene(scene)
    shown.show(frame)
    return camera_on(shown.model, shown.data, TURN, TILT, *(options.size or SIZE))


def _caption(time: int, panel: dict[str, Any]) -> str:
    """Return the time, and a line of the cell's panel content, which may come from any file."""
    words = [f"{float(Fraction(time, NANOSECONDS)):.1f} s"]
    score, intention = panel.get("score"), panel.get("intention")
    points = score.get("total") if isinstance(score, dict) else None
    if isinstance(points, int | float) and math.isfinite(points):
        words.append(f"{points:g} {'point' if points == 1 else 'points'}")
    if isinstance(intention, dict):
        words.append(str(intention.get("text", ""))[:300])
    return "   ".join(word for word in words if word)
