"""Process of a page: `python -m cellwright.viewer.web.program`.

It reads its options as a line of JSON from standard input. Every user can read a process's arguments, so they must not
hold a token. The options are `host` and `port` to listen at, `token`, `title`, and in `source` what to show: here
`address` [host, port] of the server and its `key`. It answers with one line of JSON: `url`, or `error`. It ends when
its standard input closes, and so with its parent.
"""

import json
import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, TextIO

import viser

from cellwright.util.errors import CellwrightError
from cellwright.viewer.web.access import AccessGuard
from cellwright.viewer.web.cell_operator.feature import CellOperator
from cellwright.viewer.web.cell_panels import CellPanels
from cellwright.viewer.web.connection import ServerConnection
from cellwright.viewer.web.operator.feature import Operator
from cellwright.viewer.web.overlays import Axes, Beams, Contacts, Names, ToolPaths
from cellwright.viewer.web.page import Feature, Page
from cellwright.viewer.web.scene import PLAIN, Bodies, Environment, Shadows
from cellwright.viewer.web.time_controls import TimeControls
from cellwright.viewer.web.views import Views


def features() -> list[Feature]:
    """Features of a page, in the order of their tabs."""
    environment = Environment(is_plain=is_plain())
    panels = [CellOperator(), CellPanels(), Operator(), TimeControls()]
    drawn = [Views(), Beams(), Contacts(), ToolPaths(), Names(), Axes(), Bodies(), Shadows(), environment]
    return [*panels, *drawn]


def is_plain() -> bool:
    """Return whether the page starts without shadows."""
    return os.environ.get(PLAIN, "") not in ("", "0")


class ViserServer(viser.ViserServer):
    """viser's server without sharing: it opens no tunnel through a server on the internet."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002, FBT001
        """Return None: there is no tunnel."""
        return None


def main() -> int:
    """Show the page of a server; return the exit status."""
    return show_page(_page_of_server)


def _page_of_server(server: viser.ViserServer, source: Mapping[str, Any]) -> Page:
    host, port = source["address"]
    return Page(server, ServerConnection((str(host), int(port)), key=str(source["key"])), features())


def show_page(make: Callable[[viser.ViserServer, Mapping[str, Any]], Page]) -> int:
    """Show a page, as the program that this process is; return the exit status.

    Args:
        make: makes the page, from viser's server and from `source` in the options.
    """
    # Ctrl-C on the terminal is for the parent; its end ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    out = _own_stdout()
    # Errors of browsers do not belong on a terminal.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    warnings.filterwarnings("ignore", module="viser")  # such as of a browser that left during a message
    line = sys.stdin.readline()
    if not line:
        return 0
    options: dict[str, Any] = json.loads(line)
    try:
        guard = AccessGuard(str(options["host"]), int(options["port"]), token=str(options.get("token", "")))
        with guard.guards_viser():
            server = ViserServer(guard.host, guard.port, label=str(options.get("title", "Cellwright")), verbose=False)
        guard.incoming.follow(server.gui)
        page = make(server, options["source"])
        guard.on_visibility, guard.on_input = page.set_visible, page.take_input
    except CellwrightError as error:
        _answer(out, {"error": str(error)})
        return 1
    threading.Thread(target=_end_with_parent, args=(page,), daemon=True).start()
    _answer(out, {"url": guard.url})
    page.run()
    server.stop()
    return 0


def _own_stdout() -> TextIO:
    """Standard output for this program alone: viser's prints are discarded."""
    own = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
    return own


def _answer(out: TextIO, values: dict[str, str]) -> None:
    # The parent is gone already; this process ends too.
    with suppress(BrokenPipeError):
        out.write(json.dumps(values) + "\n")
        out.flush()


def _end_with_parent(page: Page) -> None:
    while sys.stdin.readline():
        pass
    page.close()


if __name__ == "__main__":
    sys.exit(main())
