"""Readers of plot data: their protocol, spans of a state, the vacuum gripper, and commands."""

import json
import re
from collections.abc import Collection
from contextlib import suppress
from typing import Protocol

import numpy as np

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.osrf_gear import VacuumGripperState
from cellwright.recording.format.format import COMMAND
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.tracks import CommandTrack, Span
from cellwright.util.errors import showable

SECOND = 1e9
"""Nanoseconds."""


class Reader(Protocol):
    """Reads something out of the messages of its topics."""

    @property
    def topics(self) -> Collection[str]:
        """What it wants to see."""
        ...

    def take(self, message: RecordedMessage) -> None:
        """See the next message of one of its topics.

        Raises:
            MessageError: the message is damaged; it is left out.
        """
        ...


class Spans:
    """Puts together spans from a value that is told again and again."""

    def __init__(self) -> None:
        self._changes: list[tuple[float, str]] = []

    def add(self, time: float, label: str) -> None:
        """From `time` [s] on it is `label`; empty for nothing."""
        if not self._changes or self._changes[-1][1] != label:
            self._changes.append((time, label))

    def until(self, end: float) -> list[Span]:
        """The spans, the last of them until `end` [s]."""
        ends = [*(time for time, _ in self._changes[1:]), end][: len(self._changes)]
        return [Span(begin, over, label) for (begin, label), over in zip(self._changes, ends, strict=True) if label]


class Gripper:
    """Reads /ariac/gripper/state, which is told in each step: bytes that are the same again are passed over."""

    topics = ("/ariac/gripper/state",)

    def __init__(self) -> None:
        self.on, self.attached = Spans(), Spans()
        self._before = b""

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        if message.data == self._before:
            return
        state = from_cdr(message.data, VacuumGripperState)
        self._before = message.data
        self.on.add(message.time / SECOND, "on" if state.enabled else "")
        self.attached.add(message.time / SECOND, "attached" if state.attached else "")


_MAX_NAME_LENGTH = 200  # characters of a name
_NAME_PATTERN = re.compile(rb'"name": ?"((?:[^"\\]|\\.){1,200})"')


class Commands:
    """Reads names and times alone: what was commanded may be long."""

    topics = (COMMAND,)

    def __init__(self) -> None:
        self._times: dict[str, list[float]] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next command."""
        if found := _NAME_PATTERN.search(message.data):
            self._times.setdefault(_shown_name(found[1]), []).append(message.time / SECOND)

    def tracks(self) -> list[CommandTrack]:
        """Those of each name, in the order in which they came first."""
        return [CommandTrack(name, np.array(times)) for name, times in self._times.items()]


def _shown_name(name: bytes) -> str:
    """A name as JSON writes it, in plain text that can be shown."""
    text = name.decode(errors="replace")
    with suppress(ValueError):
        text = str(json.loads(f'"{text}"'))
    return showable(text, _MAX_NAME_LENGTH)
