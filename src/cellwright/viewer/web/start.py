"""Start and end of a page's process."""

import json
import sys
from collections.abc import Callable, Mapping
from threading import Thread
from typing import Any

from cellwright.util.errors import UsageError
from cellwright.util.process import ChildProcess

DEFAULT_PORT = 8080
LOOPBACK = "127.0.0.1"

_TIME_TO_END = 3.0  # [s]


def page_source(address: tuple[str, int], key: str = "") -> dict[str, Any]:
    """Return the source of a page that shows what is served at an address; it may start later.

    Args:
        address: host and port of the served cell, robot or recording.
        key: the server's key for its own page; empty for a page of another server.
    """
    return {"address": list(address), "key": key}


class WebPage(ChildProcess):
    """Page in its own process, which ends with this one.

    Args:
        source: its subject, as JSON values for its program, such as of `page_source`.
        program: module of its program.
        host: the address at which the page listens for browsers.
        port: the port; the next ones if it is in use. 0 takes any free port.
        token: required in the page's address; needed if `host` is open to the network.
        title: heading of the panel.
        on_gone: called by a thread of its own when the process has ended without `close`.

    Attributes:
        url: the address for a browser, with the token in it.

    Raises:
        UsageError: the page cannot start; the text says why.
    """

    def __init__(
        self,
        source: Mapping[str, Any],
        *,
        program: str = "cellwright.viewer.web.program",
        host: str = LOOPBACK,
        port: int = DEFAULT_PORT,
        token: str = "",
        title: str = "Cellwright",
        on_gone: Callable[[], None] = lambda: None,
    ) -> None:
        self._is_closing = False
        super().__init__([sys.executable, "-P", "-m", program])
        options = {"source": dict(source), "host": host, "port": port, "token": token, "title": title}
        self.send(options)
        try:
            answer = json.loads(self.ready_line())
        except ValueError:
            answer = {"error": "its process has ended"}
        if "url" not in answer:
            self.close()
            raise UsageError(f"page cannot start: {answer['error']}")
        self.url = str(answer["url"])
        Thread(target=self._watch, args=(on_gone,), name="page", daemon=True).start()

    def close(self) -> None:
        """End the process."""
        self._is_closing = True
        self.end(_TIME_TO_END)

    def _watch(self, on_gone: Callable[[], None]) -> None:
        self._process.wait()
        if not self._is_closing:
            on_gone()
