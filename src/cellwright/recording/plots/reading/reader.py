"""Readers of plot data: their protocol, spans of a state, the vacuum gripper, and commands."""

import json
import re
from collections.abc import Collection
from contextlib import suppress
from typing import Protocol

import numpy as np

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.osrf_gear import VacuumGripperState
from cellwright.recording.format.format import COMMAND
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.tracks import CommandTrack, Span
from cellwright.util.errors import printable

SECOND = 1e9
"""[ns]."""

_MAX_NAME_LENGTH = 200  # characters of a name
_NAME_PATTERN = re.compile(rb'"name": ?"((?:[^"\\]|\\.){1,200})"')


class TopicReader(Protocol):
    """Reader of something in the messages of its topics."""

    @property
    def topics(self) -> Collection[str]:
        """Topics that it reads."""
        ...

    def take(self, message: RecordedMessage) -> None:
        """Take the next message of one of its topics.

        Raises:
            MessageError: the message is damaged; it is skipped.
        """
        ...


class Spans:
    """Builder of periods from a value that is published repeatedly."""

    def __init__(self) -> None:
        self._changes: list[tuple[float, str]] = []

    def add(self, time: float, label: str) -> None:
        """Set the value from `time` [s] on to `label`; empty for none."""
        if not self._changes or self._changes[-1][1] != label:
            self._changes.append((time, label))

    def until(self, end: float) -> list[Span]:
        """Return the periods, the last of them until `end` [s]."""
        ends = [*(time for time, _ in self._changes[1:]), end][: len(self._changes)]
        return [Span(begin, over, label) for (begin, label), over in zip(self._changes, ends, strict=True) if label]


class GripperReader:
    """Reader of the state of a vacuum gripper, which is published in each step: repeated bytes are skipped."""

    def __init__(self, topic: str = "/ariac/gripper/state") -> None:
        self.topics = (topic,)
        self.on, self.attached = Spans(), Spans()
        self._before = b""

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        if message.data == self._before:
            return
        state = TYPES.from_cdr(message.data, VacuumGripperState)
        self._before = message.data
        self.on.add(message.time / SECOND, "on" if state.enabled else "")
        self.attached.add(message.time / SECOND, "attached" if state.attached else "")


class CommandReader:
    """Reader of the names and times of commands; their content, which may be long, is not decoded."""

    topics = (COMMAND,)

    def __init__(self) -> None:
        self._times: dict[str, list[float]] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next command."""
        if found := _NAME_PATTERN.search(message.data):
            self._times.setdefault(_shown_name(found[1]), []).append(message.time / SECOND)

    def tracks(self) -> list[CommandTrack]:
        """Return the commands of each name, ordered by their first command."""
        return [CommandTrack(name, np.array(times)) for name, times in self._times.items()]


def _shown_name(name: bytes) -> str:
    """Return a name from JSON as text that can be shown."""
    text = name.decode(errors="replace")
    with suppress(ValueError):
        text = str(json.loads(f'"{text}"'))
    return printable(text, _MAX_NAME_LENGTH)
