"""Where messages wait for a client that looks at them later."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial

from cellwright.middleware.messages import Message
from cellwright.util.errors import UsageError


class Mailbox:
    """Messages of any number of topics in order of arrival, the oldest dropped when it is full.

    Args:
        size: how many messages fit in.
    """

    def __init__(self, size: int) -> None:
        if size < 1:
            raise UsageError(f"a mailbox must hold at least one message, not {size}")
        self._waiting: deque[tuple[str, Message]] = deque()
        self.size = size
        self.dropped = 0
        """How many messages were dropped so far."""

    def __len__(self) -> int:
        return len(self._waiting)

    def listener(self, topic: str) -> Callable[[Message], None]:
        """A callback that puts the messages of a topic in here."""
        return partial(self.put, topic)

    def put(self, topic: str, message: Message) -> None:
        """Leave a message."""
        if len(self._waiting) >= self.size:
            self._waiting.popleft()
            self.dropped += 1
        self._waiting.append((topic, message))

    def take(self) -> tuple[str, Message] | None:
        """Take out the oldest message and its topic; None when there is none."""
        return self._waiting.popleft() if self._waiting else None

    def empty(self) -> list[tuple[str, Message]]:
        """Take out all messages."""
        messages = list(self._waiting)
        self._waiting.clear()
        return messages
