"""Writes an exported file: the topics of a recording, or of a part of it, and its scene as markers and transforms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cellwright.middleware.messages import to_cdr
from cellwright.recording.format.format import FRAME, METADATA, RecordedTopic
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import Recording
from cellwright.recording.format.span import Span
from cellwright.recording.replay.exported.markers import Markers
from cellwright.recording.replay.exported.names import MARKERS, TRANSFORMS
from cellwright.recording.replay.exported.transforms import Transforms
from cellwright.recording.replay.sight import Sight
from cellwright.rendering.scene import Scene
from cellwright.rendering.scene.encoded import decode_scene
from cellwright.util.atomic_file import in_its_place
from cellwright.util.errors import CellwrightError, MessageError, UsageError

_TOLD_EVERY = 500  # messages


def write_mcap(
    recording: Recording,
    path: Path,
    *,
    start: int | None = None,
    until: int | None = None,
    tell: Callable[[float], None] | None = None,
) -> list[str]:
    """Export a recording; a file that is there already is replaced when the new one is whole.

    It can be looked at, and neither played nor run again by Cellwright: what that needs stays in the recording. A file
    that begins later begins with what is latched then.

    Args:
        recording: what is exported, whole or cut short.
        path: the file.
        start: from this time [ns] on; None: from the begin.
        until: up to this time [ns]; None: to the end.
        tell: told now and then how far it is, 0..1; None for nobody.

    Returns:
        What is missing in it, and why, in lines.

    Raises:
        RecordingError: the recording is damaged.
        UsageError: there is nothing in it at these times, or the file cannot be written.
    """
    span = Span.of(recording, start, until)
    try:
        if path.exists() and path.samefile(recording.path):
            raise UsageError(f"{path}: is the recording itself, which is worth more than what is made of it")
        with in_its_place(path) as unfinished:
            unfinished.touch()  # where that fails, the reason is told of the file that was asked for
            failures: list[str] = []
            with McapFile(unfinished, report=failures.append) as file:
                missing = _Export(recording, file, span, tell or _nobody).write()
            if not file.is_whole:
                raise UsageError(f"{path}: {failures[0].removeprefix(f'{unfinished}: ')}")
    except OSError as error:
        raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
    return missing


class _Export:
    """One way through a part of a recording."""

    def __init__(self, recording: Recording, file: McapFile, span: Span, tell: Callable[[float], None]) -> None:
        self._recording, self._file, self._span, self._tell = recording, file, span, tell
        self._missing: list[str] = []
        self._channels: dict[str, int] = {}

    def write(self) -> list[str]:
        """Write everything; what is missing, and why."""
        self._file.describe(METADATA, self._recording.header.of_export())
        for topic in self._recording.topics.values():
            if topic.name != FRAME:
                self._open(topic)
        scene = self._scene()
        if scene is not None:
            self._mark(scene)
        self._say_all(None if scene is None else Transforms(scene.bodies))
        return self._missing

    def _open(self, topic: RecordedTopic) -> None:
        try:
            self._channels[topic.name] = self._file.channel(topic)
        except CellwrightError as error:  # a type of a package that is not here
            self._missing.append(f"{topic.name} is left out: {error}")

    def _scene(self) -> Scene | None:
        try:
            return decode_scene(self._recording.scene or b"")
        except MessageError as error:
            self._missing.append(f"what is to be seen is left out: {error}")
            return None

    def _mark(self, scene: Scene) -> None:
        markers = Markers(scene)
        if markers.left_out:
            self._missing.append(f"{markers.left_out} meshes are left out: they are too large for markers")
        self._file.add(self._file.channel(MARKERS), self._span.begin, to_cdr(markers.message))

    def _say_all(self, transforms: Transforms | None) -> None:
        sight = Sight(self._recording)
        channel = -1
        if transforms is not None:
            channel = self._file.channel(TRANSFORMS)
            sight.seek(self._span.begin - 1)

        def say_frame(time: int) -> None:
            frame = sight.frame()
            said = None if frame is None or transforms is None else transforms.take(replace(frame, time=time))
            if said is not None:
                self._file.add(channel, time, to_cdr(said))

        say_frame(self._span.begin)
        messages = self._span.messages(self._recording, [*self._channels, FRAME])
        for number, message in enumerate(messages):
            if number % _TOLD_EVERY == 0:
                self._tell(self._span.share(message.time))
            if message.topic != FRAME:
                self._file.add(self._channels[message.topic], message.time, message.data)
            elif transforms is not None:
                sight.take(message)
                say_frame(message.time)


def _nobody(_share: float) -> None:
    pass
