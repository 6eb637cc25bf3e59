"""Playback of a recording, to programs and pages or as a video."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

from rich.console import Console

from cellwright.cli import output
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.engine.clock import NANOSECONDS, nanoseconds, seconds
from cellwright.engine.rate_control import RateControl
from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import Recording
from cellwright.recording.replay.frame_cursor import Sight
from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import VIEWS, Camera
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.scene.scene import decode_scene
from cellwright.rendering.video import Video
from cellwright.rendering.video_options import VideoOptions, period_of
from cellwright.robot.pictures import TILT, TURN, camera_on, robot_lamp
from cellwright.running.run import PageOptions, ServerOptions, Session
from cellwright.running.run.playback import PlaybackTarget
from cellwright.util.errors import MessageError, UsageError
from cellwright.viewer.filming import Made


def play_recording(
    target: PlaybackTarget,
    console: Console,
    *,
    rate: RateControl,
    serve: ServerOptions,
    view: PageOptions | None = None,
    ros1: bool = False,
) -> None:
    """Play a recording until it is over, or a signal comes."""

    def status(session: Session) -> str:
        now, last = session.node.simulation.time, seconds(target.playing.last)
        return f"{now:.1f} of {last:.1f} s{', paused' if rate.is_paused else ''}"

    session = Session(
        target,
        rate=rate,
        serve=serve,
        view=view or False,
        ros1=ros1,
        observers=[RunProgress(console, status=status)],
        on_ready=output.say_ready,
        **output.words_for(console, partial(console.print, markup=False, soft_wrap=True, style="yellow")),
    )
    with stopped_by_signals(session.stop.request), session:
        session.run()
    if session.node.player.unreadable:
        output.note(console, "unreadable", f"{session.node.player.unreadable} messages")


def film_recording(
    recording: Recording,
    wish: VideoOptions,
    *,
    start: float | None,
    until: float | None,
    warn: Callable[[str], None],
    tell: Callable[[float], None] | None,
) -> Made:
    """Make a video of a recording between two times [s]; `tell` is told how far it is, 0..1."""
    begin = recording.begin if start is None else max(recording.begin, nanoseconds(start))
    end = recording.end_time if until is None else min(recording.end_time, nanoseconds(until))
    scene = _scene(recording)
    sight = Sight(recording)
    sight.seek(begin)
    coming = recording.messages((FRAME, PANEL), start=begin + 1, until=end + 1)
    newest = next(coming, None)
    while sight.frame() is None and newest is not None:
        sight.take(newest)
        newest = next(coming, None)
    frame = sight.frame()
    if frame is None or begin > end:
        raise UsageError(f"{recording.path}: nothing is to be seen there at these times")
    camera = wish.camera or _camera(recording, scene, frame, wish)
    lamp = LAMP if recording.header.kind == "cell" else robot_lamp(camera)
    video = Video(wish.file, scene, wish.width, wish.height, fine=wish.fine, lamp=lamp)
    if video.draws_with == RAYS:
        warn(f"{wish.file}: there is no OpenGL here, so each picture of the video takes seconds; see docs/video.md")
    period, number = period_of(wish.speed) * NANOSECONDS, 0
    try:
        while (time := begin + round(number * period)) <= end and not video.error:
            while newest is not None and newest.time <= time:
                sight.take(newest)
                newest = next(coming, None)
            frame = sight.frame() or frame
            video.take(frame, camera, _caption(time, sight.panel()))
            number += 1
            if tell is not None:
                tell(min(1.0, (time - begin) / max(1, end - begin)))
    finally:
        video.close()
    return {"file": str(wish.file), "length": video.length, "frames": video.taken, "dropped": 0}


def _scene(recording: Recording) -> Scene:
    data = recording.scene
    try:
        if data is not None:
            return decode_scene(data)
    except MessageError as error:
        raise UsageError(f"{recording.path}: what is to be seen in it cannot be read: {error}") from None
    raise UsageError(f"{recording.path}: holds nothing that is to be seen")


def _camera(recording: Recording, scene: Scene, frame: Frame, wish: VideoOptions) -> Camera:
    """The overview of a cell; for a robot a camera that has it whole."""
    if recording.header.kind == "cell":
        return VIEWS["overview"]
    shown = EngineScene(scene)
    shown.show(frame)
    return camera_on(shown.model, shown.data, TURN, TILT, wish.width, wish.height)


def _caption(time: int, panel: dict[str, Any]) -> str:
    """Time, and what the panel of a cell tells; it may come from anywhere."""
    words = [f"{float(Fraction(time, NANOSECONDS)):.1f} s"]
    score, intention = panel.get("score"), panel.get("intention")
    points = score.get("total") if isinstance(score, dict) else None
    if isinstance(points, int | float) and math.isfinite(points):
        words.append(f"{points:g} {'point' if points == 1 else 'points'}")
    if isinstance(intention, dict):
        words.append(str(intention.get("text", ""))[:300])
    return "   ".join(word for word in words if word)
