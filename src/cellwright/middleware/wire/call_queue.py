"""Calls of services on their way to the cell, so that a program with thousands of calls holds up no other service."""

from __future__ import annotations

import threading
from collections import Counter, deque
from typing import Callable

CALL_WINDOW = 4  # calls of one service that the cell has not answered yet
MAX_WAITING_CALLS = 10_000  # calls of one service that wait
MAX_WAITING_BYTES = 64 << 20  # bytes of the waiting requests of all services


class CallQueue:
    """Queue of calls, of which some of each service are with the cell; for any thread.

    The cell answers calls in the order of their arrival. Without this, each waits for all calls before it, whatever
    their service.

    Example:
        >>> queue, sent = CallQueue(), []
        >>> all(queue.add("/slow", 0, lambda number=number: sent.append(number)) for number in range(100))
        True
        >>> sent
        [0, 1, 2, 3]
        >>> queue.note_answer("/slow")
        >>> sent[-1]
        4
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._unanswered: Counter[str] = Counter()
        self._waiting: dict[str, deque[tuple[int, Callable[[], None]]]] = {}  # bytes of each, and its sender
        self._bytes = 0

    def add(self, name: str, size: int, send: Callable[[], None]) -> bool:
        """Send a call of a service, now or after others; return False if too many wait already.

        Args:
            name: the service.
            size: of the request [bytes].
            send: sends it. Afterwards `note_answer` is due, also if it fails.
        """
        with self._lock:
            if self._unanswered[name] >= CALL_WINDOW:
                waiting = self._waiting.setdefault(name, deque())
                if len(waiting) >= MAX_WAITING_CALLS or self._bytes + size > MAX_WAITING_BYTES:
                    return False
                waiting.append((size, send))
                self._bytes += size
                return True
            self._unanswered[name] += 1
        send()
        return True

    def note_answer(self, name: str) -> None:
        """Send the call of a service that has waited longest, in place of one that was answered."""
        with self._lock:
            waiting = self._waiting.get(name)
            if not waiting:
                self._unanswered[name] -= 1
                return
            size, send = waiting.popleft()
            self._bytes -= size
        send()
