"""A page that is open while something is served."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from ipaddress import ip_address
from typing import Any

from cellwright.cli.view.arguments import PageWish, desktop
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.util.errors import UsageError
from cellwright.viewer.services.cell_panel import OVER, CellPanel
from cellwright.viewer.services.control import Control
from cellwright.viewer.web.start import WebPage

_LAST_LOOK = 0.7  # [s]: a page asks for its panel four times a second


def show_the_end(server: Server, panel: CellPanel, control: Control, result: Mapping[str, Any]) -> None:
    """Have pages show that a run is over and what came of it, before anything else is done.

    Args:
        server: what the pages ask.
        panel: tells of the cell.
        control: tells how its time passes.
        result: as `CellPanel.end` takes it.
    """
    panel.end(result)
    control.over = OVER
    server.wait(_LAST_LOOK, until_asked=False)


@contextmanager
def page_on(server: Server, wish: PageWish | None, title: str, say: Callable[[str], None]) -> Iterator[WebPage | None]:
    """Have a page open on what a server serves, if one is wanted.

    Args:
        server: what serves; it is closed when there can be no page.
        wish: what page.
        title: what stands above it.
        say: takes a line with the page's address.

    Raises:
        UsageError: there can be no page; the text says why.
    """
    if wish is None:
        yield None
        return
    host, port = server.address
    address = (LOOPBACK if ip_address(host).is_unspecified else host, port)
    try:
        page = open_page(address, wish, title, say, key=server.key)
    except UsageError as error:
        server.close(str(error))
        raise
    try:
        yield page
    finally:
        page.close()


def open_page(
    address: tuple[str, int], wish: PageWish, title: str, say: Callable[[str], None], *, key: str = ""
) -> WebPage:
    """Open a page on what is served at an address.

    Args:
        address: host and port.
        wish: what page.
        title: what stands above it.
        say: takes a line with the page's address.
        key: of the server there, where it tells things to its own page alone.

    Raises:
        UsageError: there can be none.
    """

    def tell_end() -> None:
        another = "" if key else f"; another one: cellwright view {address[0]}:{address[1]}"
        say(f"the page has ended{another}")

    page = WebPage(address, host=wish.host, port=wish.port, token=wish.token, title=title, key=key, on_gone=tell_end)
    say(f"page: {page.url}")
    if wish.token:
        say("it is open to the network: whoever has this address can look on, and do what the page lets one do")
    if wish.opens and not (desktop() and webbrowser.open(page.url)):
        say("there is no desktop here to open a browser on: open that address yourself")
    return page
