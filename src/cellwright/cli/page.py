"""Page in a browser beside what is served, and a run in this process with a page on it.

The agent works in this process as ever, or in one of its own. Guests are served between two ticks, also while time
stands; when the run is over its page stays for as long as somebody wants to look. Whether there is a terminal plays no
part: a run in the background, in a container or with its output in a file has a page as well. A program that reads the
result as JSON waits for the end of the command, and so the page goes with the run there.
"""

from __future__ import annotations

import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from ipaddress import ip_address
from typing import Any, Self

from cellwright.cell.cell import Cell
from cellwright.cli.arguments import PageOptions, has_desktop
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.clients.agents.agent import Agent
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.running.run import RunOptions, RunResult, execute_run
from cellwright.running.serving import Attendance
from cellwright.util.errors import UsageError
from cellwright.viewer.services import scene
from cellwright.viewer.services.cell_panel import IN_COMPETITION, OVER, CellPanel
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.web.start import WebPage

_LAST_LOOK = 0.7  # [s]: a page asks for its panel four times a second


def show_end(server: Server, panel: CellPanel, control: Control, result: Mapping[str, Any]) -> None:
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
def page_for(
    server: Server, wish: PageOptions | None, title: str, say: Callable[[str], None]
) -> Iterator[WebPage | None]:
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
    address: tuple[str, int], wish: PageOptions, title: str, say: Callable[[str], None], *, key: str = ""
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
    if wish.opens and not (has_desktop() and webbrowser.open(page.url)):
        say("there is no desktop here to open a browser on: open that address yourself")
    return page


AGENT_IN_OWN_PROCESS = "the agent is in a process of its own: end the run, and start it again"
"""Why a run over a socket or ROS does not begin anew at a click."""

_NAP = 0.1  # [s]


class ViewedRun:
    """A cell with a page on it, for one run or for several, one after another.

    Args:
        cell: the cell.
        wish: what page.
        speed: simulated seconds a wall second at first; None: as fast as it goes.
        lockstep: whether time passes only while the agent, in a process of its own, waits.
        apart: whether the agent is in a process of its own.
        keeps: whether the page stays after the run, until somebody ends the command.
        about: what is to be told of the run, such as the agent's name.
        say: takes a line for people.

    Raises:
        UsageError: there can be no page.
    """

    def __init__(
        self,
        cell: Cell,
        wish: PageOptions,
        *,
        speed: float | None,
        lockstep: bool,
        apart: bool,
        keeps: bool,
        about: Mapping[str, Any],
        say: Callable[[str], None],
    ) -> None:
        self.cell = cell
        self.tempo = RateControl(speed)
        self.server = Server(cell, port=0, lockstep=lockstep, report=say)
        self.begins_anew = False
        """Whether somebody wants the run to begin anew."""
        self.panel = CellPanel(cell, about)
        """Tells what the page shows."""
        self._say, self._keeps = say, keeps
        hindrance = IN_COMPETITION if cell.in_competition else AGENT_IN_OWN_PROCESS if apart else ""
        self._control = Control(self.tempo, reset=Reset(self._begin_anew, lambda: hindrance), lockstep=lockstep)
        scene.offer_viewer_services(self.server, cell, lambda _: self.panel.panel(), self._control)
        self._attendance: Attendance | None = None
        try:
            self._page = open_page(self.server.address, wish, f"{cell.name} · Cellwright", say, key=self.server.key)
        except UsageError:
            self.server.close("there is no page")
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.server.close(OVER)
        self._page.close()

    def run(self, agent: Agent | None, options: RunOptions) -> RunResult:
        """Run the cell from the start, with an agent in this process, until it is over or is to begin anew."""
        self.begins_anew, self._control.over = False, ""
        self.panel.begin_anew()
        self._attendance = Attendance(self.cell, self.server, self.tempo)
        try:
            return execute_run(self.cell, partial(self._attendance.work, agent), replace(options, panel=self.panel))
        finally:
            self._attendance = None

    def tell(self, document: dict[str, Any]) -> None:
        """Show that the run is over and what came of it, and let pages ask for that at once."""
        show_end(self.server, self.panel, self._control, document)

    def stays(self) -> bool:
        """Keep the page until Ctrl-C, SIGTERM or SIGHUP if it is to stay; whether the run is to begin anew instead."""
        if self.begins_anew or not self._keeps:
            return self.begins_anew
        self._say("the page stays open; Ctrl-C ends")
        with suppress(KeyboardInterrupt), ended_as_by_ctrl_c():
            while self._page.is_open and not self.begins_anew:
                self.server.wait(_NAP, until_asked=False)
            return self.begins_anew
        return False

    def _begin_anew(self) -> None:
        self.begins_anew = True
        if self._attendance is not None:
            self._attendance.stop()
