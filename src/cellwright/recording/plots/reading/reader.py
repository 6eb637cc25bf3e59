"""A reader takes the messages of some topics as they come, and knows in the end what they tell."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any, Protocol

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.reader import RecordedMessage
from cellwright.util.errors import MessageError

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


def json_of(data: bytes) -> dict[str, Any]:
    """The JSON object in a text.

    Raises:
        MessageError: there is none.
    """
    try:
        found = json.loads(from_cdr(data, String).data)
    except (ValueError, RecursionError):
        raise MessageError("a text that is no JSON") from None
    if not isinstance(found, dict):
        raise MessageError("JSON that is no object")
    return found
