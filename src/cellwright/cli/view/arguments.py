"""How a page is asked for on the command line, and what is refused before anything starts."""

from __future__ import annotations

import os
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.options import refuse
from cellwright.rendering.views import VIEWS
from cellwright.viewer.web.start import DEFAULT_PORT, LOOPBACK

LOOK = "Looking on"
"""Heading in the help."""

View = Annotated[
    bool,
    typer.Option(
        "--view",
        metavar="",
        help="Show it on a page, in a browser; the page's address is printed.",
        rich_help_panel=LOOK,
    ),
]
ViewHost = Annotated[
    str | None,
    typer.Option(
        metavar="HOST",
        help=f"Address at which the page is; {LOOPBACK} when left out. Any other needs the token that is printed.",
        rich_help_panel=LOOK,
    ),
]
ViewPort = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help=f"Port of the page: {DEFAULT_PORT} when left out, and one of the next where it is in use. 0: a free one.",
        rich_help_panel=LOOK,
    ),
]
Open = Annotated[
    bool, typer.Option("--open", metavar="", help="Open the page in this desktop's browser.", rich_help_panel=LOOK)
]


@dataclass(frozen=True)
class PageWish:
    """A wish for a page.

    Attributes:
        host: where it listens for browsers.
        port: at which port, or one of the next ones.
        token: what its address has to hold; empty where only this machine can reach it.
        opens: open it in a browser here.
    """

    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    token: str = ""
    opens: bool = False


def page_wish(*, view: bool, host: str | None, port: int | None, opens: bool) -> PageWish | None:
    """The page that somebody wants; None for none.

    Raises:
        UsageError: something is said of a page that nobody wants, or it cannot be there.
    """
    if not view:
        said = {"--view-host": host is not None, "--view-port": port is not None, "--open": opens}
        if given := [option for option, is_given in said.items() if is_given]:
            refuse(f"{given[0]}: there is no page; say --view as well")
        return None
    host, port = LOOPBACK if host is None else host, DEFAULT_PORT if port is None else port
    if not 0 <= port <= 65535:
        refuse(f"--view-port {port}: give a port from 0 to 65535")
    return PageWish(host, port, "" if _is_local(host) else secrets.token_urlsafe(16), opens)


def refuse_a_camera(words: Sequence[str], *, view: bool) -> None:
    """Refuse the name of a place of pictures behind `--view`, which once took one.

    Raises:
        UsageError: there is one among the words that stand for files.
    """
    for word in words if view else ():
        if word in VIEWS and not Path(word).exists():
            refuse(f"--view {word}: --view opens a page now, and takes no name; for pictures say --camera {word}")


def desktop() -> bool:
    """Whether there is a desktop here, on which a browser can be opened."""
    return (
        os.name == "nt"
        or os.uname().sysname == "Darwin"
        or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    )


def _is_local(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
