"""A run that people look on at: a server beside it, a page, and time that they pause, slow down or begin anew.

The agent works in this process as ever, or in one of its own. Guests are served between two ticks, also while time
stands; when the run is over its page stays for as long as somebody wants to look. Whether there is a terminal plays no
part: a run in the background, in a container or with its output in a file has a page as well. A program that reads the
result as JSON waits for the end of the command, and so the page goes with the run there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Self

from cellwright.cell.cell import Cell
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.cli.view.arguments import PageWish
from cellwright.cli.view.page import open_page, show_the_end
from cellwright.clients.agents.agent import Agent
from cellwright.engine.tempo import Tempo
from cellwright.middleware.server import Server
from cellwright.running.run import RunOptions, RunResult, conduct
from cellwright.running.serving import Attendance
from cellwright.util.errors import UsageError
from cellwright.viewer.services import onlookers
from cellwright.viewer.services.cell_panel import IN_COMPETITION, OVER, CellPanel
from cellwright.viewer.services.control import Control, Reset

APART = "the agent is in a process of its own: end the run, and start it again"
"""Why a run over a socket or ROS does not begin anew at a click."""

_NAP = 0.1  # [s]


class Attended:
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
        wish: PageWish,
        *,
        speed: float | None,
        lockstep: bool,
        apart: bool,
        keeps: bool,
        about: Mapping[str, Any],
        say: Callable[[str], None],
    ) -> None:
        self.cell = cell
        self.tempo = Tempo(speed)
        self.server = Server(cell, port=0, lockstep=lockstep, report=say)
        self.begins_anew = False
        """Whether somebody wants the run to begin anew."""
        self.panel = CellPanel(cell, about)
        """Tells what the page shows."""
        self._say, self._keeps = say, keeps
        hindrance = IN_COMPETITION if cell.in_competition else APART if apart else ""
        self._control = Control(self.tempo, reset=Reset(self._begin_anew, lambda: hindrance), lockstep=lockstep)
        onlookers.offer(self.server, cell, lambda _: self.panel.panel(), self._control)
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
            return conduct(self.cell, partial(self._attendance.work, agent), replace(options, panel=self.panel))
        finally:
            self._attendance = None

    def tell(self, document: dict[str, Any]) -> None:
        """Show that the run is over and what came of it, and let pages ask for that at once."""
        show_the_end(self.server, self.panel, self._control, document)

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
