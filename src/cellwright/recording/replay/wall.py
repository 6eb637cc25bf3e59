"""How far the stamps of recorded messages are from simulation time: those of a robot's node tell the wall clock's."""

from __future__ import annotations

from itertools import islice
from typing import Any

from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.messages import from_cdr, message_type
from cellwright.recording.replay.source import Source
from cellwright.util.errors import CellwrightError

_MOST = 2000  # messages that are looked at
_NONE = NANOSECONDS  # a stamp that is nearer to simulation time than this [ns] is simulation time


def stamps_ahead(source: Source) -> int:
    """By how much the stamps of what was said are ahead of simulation time [ns]; 0 where they tell that time."""
    said = [name for name, topic in source.topics.items() if topic.direction == "out" and not topic.is_own]
    for message in islice(source.messages(said), _MOST):
        try:
            found: Any = from_cdr(message.data, message_type(source.topics[message.topic].type))
        except CellwrightError:
            continue
        stamp = getattr(getattr(found, "header", None), "stamp", None)
        if stamp is not None:
            ahead = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec) - message.time
            return ahead if abs(ahead) >= _NONE else 0
    return 0
