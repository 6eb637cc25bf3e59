"""A page on what another process serves."""

from __future__ import annotations

import time

from rich.console import Console

from cellwright.cli.options import refuse
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.cli.view.arguments import PageWish
from cellwright.cli.view.page import open_page
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PAGE, PANEL
from cellwright.viewer.web.link import Link

_NAP = 0.1  # [s]


def watch(address: tuple[str, int], wish: PageWish, console: Console) -> None:
    """Show what is served at an address until a signal comes, also when it has gone and come back meanwhile.

    Raises:
        UsageError: nobody answers there, what does has nothing to show, or there can be no page.
    """
    name = name_of(address)

    def say(line: str) -> None:
        console.print(line, markup=False, soft_wrap=True)

    is_stopped = Stop()
    with stopped_by_signals(is_stopped.stop):
        page = open_page(address, wish, f"{name} · Cellwright", say)
        try:
            while page.is_open and not is_stopped.has_come:
                time.sleep(_NAP)
        finally:
            page.close()


def name_of(address: tuple[str, int]) -> str:
    """The name of what is served at an address, and can be seen.

    Raises:
        UsageError: nobody answers there, or what does has nothing to show.
    """
    link = Link(address, node=f"{PAGE}asks")
    try:
        return str(link.ask(PANEL)["name"])
    except (CellwrightError, KeyError) as error:
        refuse(f"{address[0]}:{address[1]}: cannot be shown: {error}")
    finally:
        link.close()
