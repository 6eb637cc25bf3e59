"""Recorder of a run: all messages of its bus, its external input, and what a replay needs besides."""

import json
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.engine.clock import PeriodicCallback
from cellwright.middleware.bus import Subscription
from cellwright.middleware.messages import Message, TypeSet
from cellwright.middleware.messages.standard import MultiArrayLayout, String, UInt8MultiArray
from cellwright.middleware.messages.types import FAULTS
from cellwright.recording.format import format as names
from cellwright.recording.format.commands import Command, note_commands
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.rendering.scene.engine import DrawnNode, SceneCapture
from cellwright.rendering.scene.scene import SceneFrame, encode_scene
from cellwright.util.errors import CellwrightError

NODE = "/recorder"
_FRAMES = Fraction(1, 25)  # simulation time between two frames of the scene [s]
_WHOLE_FRAMES = 25  # every 25th frame is whole; the others hold changes
_HASHES = Fraction(1)  # simulation time between two state hashes [s]
_PANELS = Fraction(1, 2)  # simulation time between two readings of a panel [s]

PICTURES = frozenset({"sensor_msgs/Image", "sensor_msgs/PointCloud", "sensor_msgs/PointCloud2"})
"""Message types that are recorded only while a client subscribes to them. They are by far the largest, and drawing them
for the file alone would slow the run down."""

_LAST = 1_000_000
"""Rank among the watches of a tick: after all publications."""


class Recorder:
    """Recorder of a node, from its creation until `end`; a reset of the simulation continues in another file.

    It only listens, and leaves the run as it is.

    Args:
        served: the recorded node.
        path: the file; after the first reset the next file is NAME_2, and so on.
        header: header of the recording.
        attachments: attached files, by name (see `format`).
        panel: returns the values of its panel, as JSON values.
        stamp: second clock for the arrival of commands (see `Command.stamp`).
        report: called with a line when a file can no longer be written.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(
        self,
        served: DrawnNode,
        path: Path,
        header: RecordingHeader,
        *,
        attachments: Mapping[str, bytes] | None = None,
        panel: Callable[[], Mapping[str, Any]] | None = None,
        stamp: Callable[[], int] | None = None,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.on_begin: Callable[[], None] = lambda: None
        """Called when a new file was begun after a reset, for the events that come first in it."""
        self.renew_header: Callable[[], RecordingHeader] = lambda: header
        """Returns the header of a new file: the run may start with another seed."""
        self._served, self._simulation, self._types = served, served.simulation, served.bus.types
        self._path, self._header = path, header
        self._attachments = dict(attachments or {})
        self._panel, self._report = panel, report
        self._taker = SceneCapture.of(served)
        self._runs = 0
        self._is_over = False
        self.paths: list[Path] = []
        """The files, one a run."""
        self.is_whole = True
        """True if all finished files were written completely."""
        self._begin()
        self._leave = [note_commands(served.bus, self._simulation.clock, self._note, stamp)]
        self._leave += [self._listen(topic).cancel for topic in _topics(served)]
        self._watch("frames", _FRAMES, self._keep_frame)
        self._watch("state hashes", _HASHES, self._keep_hash)
        if panel is not None:
            self._watch("panels", _PANELS, self._keep_panel)
        self._simulation.on_reset.append(self._finish_run)
        self._simulation.on_restart.append(self._restart)
        self._leave.append(partial(self._simulation.on_reset.remove, self._finish_run))
        self._leave.append(partial(self._simulation.on_restart.remove, self._restart))
        self._keep_frame(0)
        self._keep_panel(0)
        self._file.flush()

    def event(self, value: Mapping[str, Any]) -> None:
        """Record an event, as JSON values, and the panel that shows it."""
        self._write_text(names.EVENT, json.dumps(value))
        self._keep_panel(0)

    def end(self, result: Mapping[str, Any]) -> None:
        """Record the result of the run, and close the file. A second call does nothing."""
        if self._is_over:
            return
        self._is_over = True
        for leave in self._leave:
            leave()
        self._finish(result)

    def _begin(self) -> None:
        self._runs += 1
        path = self._path if self._runs == 1 else self._path.with_stem(f"{self._path.stem}_{self._runs}")
        self._file = file = McapFile(path, report=self._report, types=self._types)
        self.paths.append(path)
        header = self._header.with_clock_offset(self._simulation.clock.offset)
        file.describe(names.METADATA, header.metadata())
        for name, data in {names.SCENE: encode_scene(self._taker.scene), **self._attachments}.items():
            file.attach(name, "application/octet-stream", data)
        topics = [*_topics(self._served), *(RecordedTopic(name, kind) for name, kind in names.OWN_TOPICS.items())]
        self._channels = {topic.name: file.channel(topic) for topic in topics}
        self._frames = 0
        self._hashed = -1
        self._before: SceneFrame | None = None
        self._last_panel = ""

    def _finish_run(self) -> None:
        """Close the file, as time is about to restart at 0."""
        self._finish({"outcome": "reset"})

    def _restart(self) -> None:
        """Begin another file, at time 0."""
        self._attachments.pop(names.START, None)
        self._header = self.renew_header()
        try:
            self._begin()
        except CellwrightError as error:
            self.is_whole = False
            self._report(str(error))
        else:
            self.on_begin()

    def _finish(self, result: Mapping[str, Any]) -> None:
        self._keep_frame(0)
        self._keep_panel(0)
        self._keep_hash(0)
        self._write_text(names.END, json.dumps(result))
        self._file.close()
        self.is_whole = self.is_whole and self._file.is_whole

    def _listen(self, topic: RecordedTopic) -> Subscription:
        clock, name = self._simulation.clock, topic.name
        write = self._types.cdr_writer(self._types.message(topic.type).__msgtype__)
        newest: Message | None = None
        data, is_reported = b"", False

        def on_message(message: Message) -> None:
            nonlocal newest, data, is_reported
            # A message that is published again is the same object, and need not be encoded again.
            if message is not newest:
                try:
                    data = write(message)
                except FAULTS:
                    if not is_reported:
                        is_reported = True
                        self._report(f"{self._path}: {name} is not recorded: {_fault_of(message, self._types)}")
                    return
                newest = message
            self._file.add(self._channels[name], clock.now, data)

        def take_cdr(encoded: bytes) -> None:
            self._file.add(self._channels[name], clock.now, encoded)

        is_passive = topic.type in PICTURES
        return self._served.bus.subscribe(name, on_message, node=NODE, passive=is_passive, take_cdr=take_cdr)

    def _note(self, command: Command) -> None:
        self._write_text(names.COMMAND, command.encode())

    def _keep_frame(self, _index: int) -> None:
        self._simulation.refresh()
        frame = self._taker.frame(self._simulation.data, self._simulation.now)
        # the simulation has become unstable and is about to end
        if not np.isfinite(frame.poses).all():
            return
        is_whole = self._frames % _WHOLE_FRAMES == 0
        self._frames += 1
        data = frame.encode(None if is_whole else self._before)
        carrier = UInt8MultiArray(MultiArrayLayout([], 0), np.frombuffer(data, np.uint8))
        self._write(names.FRAME, self._types.to_cdr(carrier))
        self._before = frame

    def _keep_hash(self, _index: int) -> None:
        tick = self._simulation.clock.tick
        if tick != self._hashed:
            self._hashed = tick
            self._write_text(names.STATE_HASH, json.dumps({"tick": tick, "hash": self._simulation.state_hash()}))

    def _keep_panel(self, _index: int) -> None:
        if self._panel is None:
            return
        text = json.dumps(self._panel())
        if text != self._last_panel:
            self._last_panel = text
            self._write_text(names.PANEL, text)

    def _watch(self, name: str, period: Fraction, action: Callable[[int], None]) -> None:
        watch: PeriodicCallback = self._simulation.watch(f"recording: {name}", period, action, _LAST)
        self._leave.append(watch.cancel)

    def _write_text(self, topic: str, text: str) -> None:
        self._write(topic, self._types.to_cdr(String(text)))

    def _write(self, topic: str, data: bytes) -> None:
        self._file.add(self._channels[topic], self._simulation.now, data)


def _fault_of(message: Message, types: TypeSet) -> str:
    """Return the reason why a message cannot be encoded."""
    try:
        types.to_cdr(message)
    except CellwrightError as error:
        return str(error)
    return "it has changed meanwhile"


def _topics(served: DrawnNode) -> list[RecordedTopic]:
    """List the topics of the bus, as a recording has them."""
    found = []
    for info in served.bus.topics():
        node = ",".join(info.publishers) or next(iter(info.subscribers), "")
        found.append(RecordedTopic(info.name, info.type, info.direction.value, info.rate, info.latch, node))
    return found
