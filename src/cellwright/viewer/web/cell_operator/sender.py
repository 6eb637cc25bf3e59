"""Sender of a browser's requests to the operator agent, in a thread of its own: callbacks of viser must not wait.

Commands go first and in order. Of poses, velocities and joints only the newest goes, since a drag makes more of them
than the cell takes steps.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from cellwright.clients.agents.operator.requests import COMMAND
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import CellwrightError
from cellwright.viewer.web.connection import Connection

NODE = "/browser_operator"
"""Node name of the operator's page, in the cell and in recordings."""
GAP = 0.02
"""Wall time [s] between two of these messages, at least."""
_CLOSING = 1.0  # [s]


class Sender:
    """Sender of requests.

    Args:
        link: connection of its own; closed at the end.
        report: receives what was refused, in words.
    """

    def __init__(self, link: Connection, report: Callable[[str], None]) -> None:
        self._link, self._report = link, report
        self._first: deque[Callable[[], None]] = deque()
        self._newest: dict[str, Any] = {}
        self._wake = threading.Event()
        self._is_over = False
        self._thread = threading.Thread(target=self._run, name="cell operator", daemon=True)
        self._thread.start()

    def command(self, text: str) -> None:
        """Send a command; `stop` discards all that waits."""
        if text == "stop":
            self._first.clear()
            self._newest.clear()
        self._first.append(lambda: self._link.publish(COMMAND, String(text)))
        self._wake.set()

    def put(self, topic: str, message: Any) -> None:
        """Send a message, unless a newer one on its topic comes before."""
        self._newest[topic] = message
        self._wake.set()

    def call(self, service: str, request: Any) -> None:
        """Call a service that answers with `success`."""
        self._first.append(lambda: self._call(service, request))
        self._wake.set()

    def close(self) -> None:
        """End the thread; send nothing more."""
        self._is_over = True
        self._wake.set()
        self._thread.join(_CLOSING)
        self._link.close()

    def _call(self, service: str, request: Any) -> None:
        response = self._link.call(service, request)
        if not getattr(response, "success", True):
            raise CellwrightError(f"{service}: refused; {getattr(response, 'message', '') or 'no reason given'}")

    def _run(self) -> None:
        while not self._is_over:
            self._wake.wait()
            self._wake.clear()
            while not self._is_over and (self._first or self._newest):
                if self._first:
                    self._do(self._first.popleft())
                    continue
                topic = next(iter(self._newest), "")
                message = self._newest.pop(topic, None)
                if message is not None:
                    self._do(partial(self._link.publish, topic, message))
                time.sleep(GAP)

    def _do(self, send: Callable[[], None]) -> None:
        try:
            send()
        except CellwrightError as error:
            self._report(str(error))
