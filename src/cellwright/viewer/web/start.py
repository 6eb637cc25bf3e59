"""Starts a page, and ends it."""

import json
import sys
from collections.abc import Callable
from threading import Thread

from cellwright.util.errors import UsageError
from cellwright.util.process import ChildProcess

DEFAULT_PORT = 8080
LOOPBACK = "127.0.0.1"

_TIME_TO_END = 3.0  # [s]


class WebPage(ChildProcess):
    """A page on what is served at an address, in a process of its own, which ends with this one.

    Args:
        address: host and port where the cell, the robot or the recording is served, now or soon.
        host: the address at which the page listens for browsers.
        port: the port; where it is in use, one of the next ones is taken. 0: any that is free.
        token: what has to be in the page's address; needed where `host` is open to the network.
        title: what stands above the panel.
        key: the key of the server there, for its own page; empty for a page on what somebody else serves.
        on_gone: is called, by a thread of its own, when its process has ended and nobody had closed it.

    Attributes:
        url: where a browser finds it, with the token in it.

    Raises:
        UsageError: it cannot be shown; the text says why.
    """

    def __init__(
        self,
        address: tuple[str, int],
        *,
        host: str = LOOPBACK,
        port: int = DEFAULT_PORT,
        token: str = "",
        title: str = "Cellwright",
        key: str = "",
        on_gone: Callable[[], None] = lambda: None,
    ) -> None:
        self._is_closing = False
        super().__init__([sys.executable, "-P", "-m", "cellwright.viewer.web.program"])
        asked = {"address": list(address), "key": key, "host": host, "port": port, "token": token, "title": title}
        self.send(json.dumps(asked))
        try:
            answer = json.loads(self.ready_line())
        except ValueError:
            answer = {"error": "its process has ended"}
        if "url" not in answer:
            self.close()
            raise UsageError(f"no page can be shown: {answer['error']}")
        self.url = str(answer["url"])
        Thread(target=self._watch, args=(on_gone,), name="page", daemon=True).start()

    def close(self) -> None:
        """End it."""
        self._is_closing = True
        self.end(_TIME_TO_END)

    def _watch(self, on_gone: Callable[[], None]) -> None:
        self._process.wait()
        if not self._is_closing:
            on_gone()
