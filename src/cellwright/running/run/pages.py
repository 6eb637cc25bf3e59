"""Pages in a browser: of a session's server, or of another source."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from cellwright.running.run.options import PageOptions

if TYPE_CHECKING:
    from cellwright.viewer.web.start import WebPage


def open_page(
    address: tuple[str, int], options: PageOptions, title: str, on_message: Callable[[str], None], *, key: str = ""
) -> WebPage:
    """Open the page of a server at an address; `key` proves to the server that a request comes from the page.

    Raises:
        UsageError: the page cannot be opened.
    """
    from cellwright.viewer.web.start import page_source

    another = "" if key else f"{address[0]}:{address[1]}"
    return open_page_of(page_source(address, key), options, title, on_message, another=another)


def open_page_of(
    source: Mapping[str, Any],
    options: PageOptions,
    title: str,
    on_message: Callable[[str], None],
    *,
    another: str,
    **program: str,
) -> WebPage:
    """Open a page, and print its address.

    Args:
        source: its subject, for its program.
        options: its address.
        title: its title.
        on_message: receives lines about it.
        another: words of `cellwright view` that open another such page; empty if there are none.
        program: `program` of `WebPage`, unless it is that of a server's page.

    Raises:
        UsageError: the page cannot be opened.
    """
    from cellwright.viewer.web.start import WebPage

    def report_end() -> None:
        advice = f"; open another one with: cellwright view {another}" if another else ""
        on_message(f"the page has stopped{advice}")

    page = WebPage(
        source, host=options.host, port=options.port, token=options.token, title=title, on_gone=report_end, **program
    )
    on_message(f"page: {page.url}")
    if options.token:
        on_message(
            "the page is open to the network: this address gives access to everything that the page shows and controls"
        )
    if options.opens and not (has_desktop() and webbrowser.open(page.url)):
        on_message("no desktop found to open a browser on; open the address yourself")
    return page


def has_desktop() -> bool:
    """Return whether this machine has a desktop on which a browser can be opened."""
    return (
        os.name == "nt"
        or os.uname().sysname == "Darwin"
        or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    )
