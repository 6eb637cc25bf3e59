"""A reader takes the messages of some topics as they come, and knows in the end what they tell."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from typing import Any, Protocol

from cellwright.errors import MessageError
from cellwright.messages import from_cdr
from cellwright.messages.standard import String

SECOND = 1e-9
"""Of a nanosecond."""


class Recorded(Protocol):
    """A message in a recording."""

    @property
    def topic(self) -> str:
        """Name of its topic."""
        ...

    @property
    def time(self) -> int:
        """When it was said [ns]."""
        ...

    @property
    def data(self) -> bytes:
        """Its bytes, CDR."""
        ...


class Source(Protocol):
    """As much of a recording as figures need."""

    @property
    def name(self) -> str:
        """Of the trial or robot."""
        ...

    @property
    def kind(self) -> str:
        """`cell` or `robot`."""
        ...

    @property
    def facts(self) -> Mapping[str, Any]:
        """What else is known of the run: seed, agent and so on."""
        ...

    @property
    def is_complete(self) -> bool:
        """Whether it has its end."""
        ...

    @property
    def topics(self) -> Collection[str]:
        """Names of the topics in it."""
        ...

    @property
    def begin(self) -> int:
        """Time of its first message [ns]."""
        ...

    @property
    def end_time(self) -> int:
        """Time of its last message [ns]."""
        ...

    @property
    def scene(self) -> bytes | None:
        """What there is to be seen, encoded; None where that is missing."""
        ...

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """The messages of some topics, in the order of their times."""
        ...


class Reader(Protocol):
    """Reads something out of the messages of its topics."""

    @property
    def topics(self) -> Collection[str]:
        """What it wants to see."""
        ...

    def take(self, message: Recorded) -> None:
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
