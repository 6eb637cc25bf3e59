"""Tests of a run with viewers: pause, step and speed leave the run as it is, and a viewer can restart it."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.cli.run.command import AGENT_IN_OWN_PROCESS
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.clients.client import Client
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.running.remote.hosting import RemoteAgent
from cellwright.running.run import Outcome, RunOptions, ServerOptions, Session, run_cell
from cellwright.running.run import serving as servings
from cellwright.running.run.result import cell_result
from cellwright.running.run.target import HasPanel
from cellwright.util.errors import CellwrightError, UsageError
from cellwright.viewer.web.connection import ServerConnection
from tests.cli.conftest import CommandLine
from tests.running.run.test_collisions import IntoThePost
from tests.support.cells import ARM_ONLY, KITTING
from tests.support.quick_children import QUICK_AGENTS
from tests.support.waiting import wait_until

SLOW = 0.05
"""A speed at which a run of 2 s is not over before the test has acted on it."""


class Sends:
    """Sends off the kit that stands on tray 1, after a second in which a test can act."""

    runs = 0

    def run(self, client: Client) -> None:
        type(self).runs += 1
        client.set_status("looking around")
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")
        client.sleep(1.0)


class NoPage:
    """Stands for a page's process, which has tests of its own."""

    is_running = True

    def close(self) -> None:
        self.is_running = False


@pytest.fixture(autouse=True)
def no_page(monkeypatch: pytest.MonkeyPatch) -> NoPage:
    page = NoPage()
    monkeypatch.setattr(servings, "open_page", lambda *_, **__: page)
    return page


def looked_at(
    cell: Cell,
    *,
    speed: float | None = None,
    lockstep: bool = False,
    until: float | None = None,
    restart_refusal: str = "",
) -> Session:
    here = ServerOptions(port=0, lockstep=lockstep, restart_refusal=restart_refusal)
    return Session(cell, view=True, rate=RateControl(speed), serve=here, options=RunOptions(until=until))


def server_of(session: Session) -> Server:
    assert session.server is not None
    return session.server


@contextmanager
def looking(crowd: Session, act: Callable[[ServerConnection], None]) -> Iterator[None]:
    """Act as a viewer in another thread while the run goes on; serve its requests until it is done."""
    wrong: list[BaseException] = []
    link = ServerConnection(server_of(crowd).address, key=server_of(crowd).key)

    def look() -> None:
        try:
            act(link)
        except BaseException as error:  # for the waiting thread
            wrong.append(error)
        finally:
            link.close()

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield
    finally:
        wait_until(
            lambda: not thread.is_alive(),
            "end of the viewer's thread",
            between=lambda: server_of(crowd).wait(0.02, until_request=False),
        )
        assert not wrong, wrong


def control(link: ServerConnection, **asked: Any) -> dict[str, Any]:
    return link.ask("cellwright/control", **asked)


def panel(link: ServerConnection) -> dict[str, Any]:
    return link.ask("cellwright/panel")


def until(link: ServerConnection, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    seen: list[dict[str, Any]] = []

    def holds() -> bool:
        seen[:] = [panel(link)]
        return condition(seen[0])

    wait_until(holds, "such state on the panel", seen=lambda: seen)
    return seen[0]


def test_pauses_steps_and_speeds_do_not_change_run() -> None:
    alone = run_cell(Cell(KITTING), Sends(), RunOptions())
    crowd_cell = Cell(KITTING)

    def meddle(link: ServerConnection) -> None:
        until(link, lambda state: state["clock"]["tick"] > 0)
        control(link, action="pause")
        before = panel(link)["clock"]["tick"]
        assert panel(link)["clock"]["tick"] == before
        control(link, action="speed", factor="max")
        control(link, action="step", ticks=25)
        assert until(link, lambda state: not state["control"]["ticks_left"])["clock"]["tick"] == before + 25
        assert panel(link)["intention"]["text"] == "looking around"
        control(link, action="resume")

    with looked_at(crowd_cell, speed=SLOW) as crowd, looking(crowd, meddle):
        result = cell_result(crowd.run(Sends()))
    assert (result.outcome, result.score.total) == (Outcome.DONE, 6.0)
    assert result.state_hash == alone.state_hash


def test_restart_ends_agent_at_once() -> None:
    cell = Cell(KITTING, competition=False)

    def restart(link: ServerConnection) -> None:
        until(link, lambda state: state["clock"]["tick"] > 10)
        control(link, action="pause")
        control(link, action="reset")
        assert until(link, lambda state: state["control"]["resets"] == 1)["control"]["paused"]
        control(link, action="resume")

    with looked_at(cell, speed=SLOW) as crowd:
        with looking(crowd, restart):
            cell_result(crowd.run(Sends()))
            assert crowd.wait(), "it starts again at once, wherever standard input is"
        crowd.rate.set_speed(None)
        result = cell_result(crowd.run(Sends()))
        assert result.outcome is Outcome.DONE
    assert result.state_hash == run_cell(Cell(KITTING), Sends(), RunOptions()).state_hash


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_ctrl_c_ends_paused_run() -> None:
    def pause_and_end(link: ServerConnection) -> None:
        until(link, lambda state: state["clock"]["tick"] > 0)
        control(link, action="pause")
        os.kill(os.getpid(), signal.SIGINT)

    with looked_at(Cell(KITTING), speed=SLOW) as crowd, looking(crowd, pause_and_end):
        result = cell_result(crowd.run(Sends()))
    assert result.outcome is Outcome.INTERRUPTED


@pytest.mark.parametrize(
    ("cell", "apart", "reason"),
    [
        (Cell(KITTING), False, "not available in competition mode"),
        (Cell(KITTING, competition=False), True, AGENT_IN_OWN_PROCESS),
    ],
)
def test_run_that_cannot_restart_reports_reason(cell: Cell, apart: bool, reason: str) -> None:
    def ask(link: ServerConnection) -> None:
        with pytest.raises(CellwrightError, match=reason):
            control(link, action="reset")

    with looked_at(cell, restart_refusal=AGENT_IN_OWN_PROCESS if apart else "") as crowd, looking(crowd, ask):
        pass


def test_page_stays_after_run_and_disables_controls(no_page: NoPage) -> None:
    with looked_at(Cell(KITTING, competition=False), until=0.1) as crowd:
        crowd.run()

        def look(link: ServerConnection) -> None:
            state = panel(link)
            assert state["result"]["outcome"] == "until"
            assert state["control"]["over"] == state["refused"]["belt"] == "the run is over"
            for action in ("pause", "resume", "step", "speed"):
                with pytest.raises(CellwrightError, match="the run is over"):
                    control(link, action=action)
            assert "reset" not in state["control"]["refused"], "it may start again"
            no_page.is_running = False

        with looking(crowd, look):
            assert not crowd.wait()


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_page_after_run(number: signal.Signals, no_page: NoPage) -> None:
    with looked_at(Cell(KITTING), until=0.1) as crowd:
        crowd.run()

        def end(link: ServerConnection) -> None:
            assert panel(link)["result"]["outcome"] == "until"
            os.kill(os.getpid(), number)

        with looking(crowd, end), ended_as_by_ctrl_c():
            assert not crowd.wait()
        assert no_page.is_running


@pytest.mark.slow
def test_collisions_are_on_panel_during_and_after_run() -> None:
    cell = Cell(ARM_ONLY)

    def look(link: ServerConnection) -> None:
        seen = until(link, lambda state: state["collisions"]["count"] > 0)["collisions"]["latest"][-1]
        assert (seen["obstacle"], seen["end"]) == ("camera frame 2", None), "it lasts"

    with Session(cell, view=True, options=RunOptions(ends_when_done=False)) as crowd:
        with looking(crowd, look):
            result = cell_result(crowd.run(IntoThePost()))
        assert isinstance(crowd.target, HasPanel)
        state = crowd.target.panel({})["collisions"]
    assert state["count"] == len(result.collisions) > 0
    assert [each["end"] for each in state["latest"]] == [each.end for each in result.collisions]


@QUICK_AGENTS
@pytest.mark.slow
def test_viewers_stay_after_remote_agent_ends() -> None:
    cell = Cell(KITTING)

    def look(link: ServerConnection) -> None:
        until(link, lambda state: state["state"] == "done")
        assert panel(link)["score"]["total"] == 6.0

    with looked_at(cell, lockstep=True) as crowd:
        with looking(crowd, look):
            result = cell_result(crowd.run(RemoteAgent(f"{__file__}:Sends")))
        assert all(node.startswith("/page_") for node in server_of(crowd).clients)
    assert (result.outcome, result.score.total) == (Outcome.DONE, 6.0)


def test_failed_page_start_leaves_no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise UsageError("page cannot start")

    monkeypatch.setattr(servings, "open_page", refuse)
    with pytest.raises(UsageError, match="page cannot start"), looked_at(Cell(KITTING)):
        pass


def test_viewed_run_has_result_of_plain_run(cellwright: CommandLine) -> None:
    command = ("run", "lesson", "--agent", "none", "--until", "0.2", "--no-picture", "--json")
    plain, viewed = cellwright(*command), cellwright(*command, "--view", "--speed", "max")
    assert viewed.status == 0, "and the page has gone with the run"
    assert json.loads(plain.out)["state_hash"] == json.loads(viewed.out)["state_hash"]


def test_page_options_without_view_are_refused(cellwright: CommandLine) -> None:
    for more in (["--view-port", "8080"], ["--view-host", "127.0.0.1"], ["--open"]):
        ran = cellwright("run", "lesson", *more)
        assert (ran.status, ran.err) == (2, f"error: {more[0]} requires --view\n")
