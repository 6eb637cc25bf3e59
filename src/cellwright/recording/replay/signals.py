"""Signals of a recording: boolean fields and texts of its messages, as periods in which they hold."""

import re
from dataclasses import fields

from cellwright.engine.clock import seconds
from cellwright.middleware.messages import TypeSet
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.plots.reading.reader import Spans
from cellwright.recording.plots.tracks import Span
from cellwright.util.errors import CellwrightError, UnknownNameError

_BOOL, _TEXT = "std_msgs/Bool", "std_msgs/String"
_STATE = re.compile(r"[/_]state$")
_MAX_TEXT_LENGTH = 60  # characters of a text that counts as a state; longer ones are descriptions


class Signals:
    """Signals of a recording, read topic by topic on request.

    The name of a signal is its subject with the field or the text: `gripper attached`, `agv1 ready to deliver`. The
    subject is the topic without `/ariac` and a final `state`. Underscores and slashes are spaces.
    """

    def __init__(self, source: RecordingFile) -> None:
        self._source = source
        self._found: dict[str, dict[str, tuple[Span, ...]]] = {}
        self._fields = {
            name: flags
            for name, topic in source.topics.items()
            if source.counts[name]
            and not topic.is_own
            and ((flags := _flags(source.types, topic.type)) or topic.type == _TEXT)
        }

    def names(self) -> tuple[str, ...]:
        """Return the names of all signals.

        Raises:
            RecordingError: the file is damaged.
        """
        return tuple(sorted({name for topic in self._fields for name in self._read(topic)}))

    def spans(self, signal: str) -> tuple[Span, ...]:
        """Return the periods in which a signal holds, in order; the last one ends with the recording at the latest.

        Raises:
            UnknownNameError: the recording has no such signal.
            RecordingError: the file is damaged.
        """
        name = signal.replace("_", " ")
        for topic in self._fields:
            if name.startswith(_subject(topic)) and name in (found := self._read(topic)):
                return found[name]
        raise UnknownNameError("signal", signal, self.names())

    def _read(self, topic: str) -> dict[str, tuple[Span, ...]]:
        if topic not in self._found:
            self._found[topic] = self._periods(topic)
        return self._found[topic]

    def _periods(self, topic: str) -> dict[str, tuple[Span, ...]]:
        flags, subject, type_name = self._fields[topic], _subject(topic), self._source.topics[topic].type
        builders = {flag: Spans() for flag in flags} or {"data": Spans()}
        before = b""
        for message in self._source.messages([topic]):
            if message.data == before:  # states are often published unchanged
                continue
            before, decoded = message.data, self._source.decode(message)
            for field, builder in builders.items():
                value = getattr(decoded, field)
                text = value if isinstance(value, str) else field if value else ""
                builder.add(seconds(message.time), text if len(text) <= _MAX_TEXT_LENGTH else "")
        end = seconds(self._source.end_time)
        periods = {field: builder.until(end) for field, builder in builders.items()}
        if type_name == _TEXT:
            texts = dict.fromkeys(span.label for span in periods["data"])
            grouped = {f"{subject} {text}": [span for span in periods["data"] if span.label == text] for text in texts}
        elif type_name == _BOOL:
            grouped = {subject: periods["data"]}
        else:
            grouped = {f"{subject} {field}": spans for field, spans in periods.items()}
        names = ((name, name.replace("_", " ")) for name in grouped)
        return {shown: tuple(Span(span.begin, span.end, shown) for span in grouped[name]) for name, shown in names}


def _flags(types: TypeSet, type_name: str) -> tuple[str, ...]:
    """Return the boolean fields of a message type; none for a type that is unknown here."""
    try:
        found = fields(types.message(type_name))  # type: ignore[arg-type]  # the library's classes say nothing of it
    except CellwrightError:
        return ()
    return tuple(field.name for field in found if field.type in (bool, "bool"))


def _subject(topic: str) -> str:
    """Return the subject of a topic in words: `/ariac/gripper/state` is `gripper`."""
    return re.sub(r"[/_]+", " ", _STATE.sub("", topic.removeprefix("/ariac"))).strip()
