"""Agent at work in this process: the run under way, how it ends, and what is put back after it.

Results are written after it: to files whose paths are relative, and with numbers that are computed.
"""

from __future__ import annotations

import locale
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from threading import current_thread, main_thread
from typing import TypeAlias

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.running.run.result import Outcome, RunResult
from cellwright.util.errors import RunEndedError, SimulationError, showable

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM", "SIGUSR1") if hasattr(signal, name)
)


@contextmanager
def restored_environment() -> Iterator[None]:
    """Put back the working folder, what numpy does about errors, signal handlers, locale, streams and other switches.

    What cannot be put back is left: a folder that is gone, a handler that was not set in Python.
    """
    folder, errors, language = _folder(), np.geterr(), locale.setlocale(locale.LC_ALL)
    streams, depth = (sys.stdin, sys.stdout, sys.stderr), sys.getrecursionlimit()
    # only the main thread may set handlers; a program in another one has not changed any either
    handlers = {each: signal.getsignal(each) for each in _SIGNALS} if current_thread() is main_thread() else {}
    try:
        yield
    finally:
        with suppress(OSError):
            if folder and folder != _folder():
                os.chdir(folder)
        np.seterr(**errors)
        with suppress(locale.Error):
            locale.setlocale(locale.LC_ALL, language)
        sys.stdin, sys.stdout, sys.stderr = streams
        with suppress(RecursionError):
            sys.setrecursionlimit(depth)
        for number, handler in handlers.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)


def _folder() -> str:
    """The working folder; empty if it is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""


DRIVE = 30.0
"""Simulation time [s] for which a kit that is on its way is waited for after the agent has returned."""


class RunContext:
    """A run under way.

    Args:
        cell: what runs.
        transport: what lets its time pass, up to the deadline that it has.
        heard: how many messages were counted so far, by topic.
    """

    def __init__(self, cell: Cell, transport: InProcess, heard: Mapping[str, int]) -> None:
        self.cell = cell
        self.transport = transport
        self.on_reset: list[Callable[[int], None]] = []
        """Those who are told, with the time [ns] at which it was, that the run has begun anew under way."""
        self._heard = heard
        self._tick = cell.simulation.clock.tick
        self._wall = time.perf_counter()

    def begin_anew(self) -> None:
        """Begin the run anew, at time 0, for those who work the cell from elsewhere."""
        stood, self._tick = self.cell.simulation.now, 0
        self.cell.reset()
        self.transport.stop.reset()
        for listener in self.on_reset:
            listener(stood)

    def result(self, outcome: Outcome, error: str = "") -> RunResult:
        """What has come of it by now."""
        cell, clock = self.cell, self.cell.simulation.clock
        return RunResult(
            outcome=outcome,
            competition_state=cell.competition.state,
            score=cell.competition.score(),
            evidence=cell.competition.evidence(),
            state_hash=cell.state_hash(),
            simulated=cell.simulation.time - self._tick * float(clock.timestep),
            wall=time.perf_counter() - self._wall,
            steps=clock.tick - self._tick,
            error=error,
            heard=dict(self._heard),
        )


Work: TypeAlias = Callable[[RunContext], tuple[Outcome, str]]
"""Lets time pass until a run is over; says how it ended, and what went wrong."""


def how_it_ended(cell: Cell, *, otherwise: Outcome) -> Outcome:
    """How a run ended that came to its end: by the competition, or otherwise."""
    if cell.competition.state != "done":
        return otherwise
    return Outcome.TIME_LIMIT if cell.competition.is_timed_out else Outcome.DONE


def wait_for_kits(cell: Cell, client: Client) -> None:
    """The agent has returned; kits that it sent off still arrive, and the competition may still end."""
    competition, agvs = cell.competition, tuple(cell.agvs.values())

    def nothing_to_come() -> bool:
        return competition.state == "done" or all(agv.state != "preparing_to_deliver" for agv in agvs)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: competition.state == "done", 0.1)


_LONGEST = 20_000  # characters of what is told of an error


def work_in_process(agent: Agent | None, course: RunContext) -> tuple[Outcome, str]:
    """Let an agent work a run in this process; without one, let time pass. How it ended, and what went wrong."""
    cell, transport = course.cell, course.transport
    client = Client(transport)
    try:
        if agent is None:
            client.wait_until(lambda: False)
        else:
            with restored_environment():
                call_agent(agent, client)
            wait_for_kits(cell, client)
    except RunEndedError:
        pass  # the ordinary end of a program that works until it is stopped
    except KeyboardInterrupt:
        return Outcome.INTERRUPTED, ""
    except SimulationError as error:
        return Outcome.UNSTABLE, f"{error}\n"
    except BaseException as raised:  # whatever somebody's program raises is reported, and the run still has its score
        return Outcome.CRASHED, agent_traceback(raised)
    finally:
        client.close()
    stopped = cell.simulation.now >= transport.stop.deadline
    return how_it_ended(cell, otherwise=Outcome.UNTIL if stopped else Outcome.GAVE_UP), ""


def call_agent(agent: Agent, client: Client) -> None:
    """Let an agent work. A program may end itself, and says with its status whether it came to its end."""
    try:
        agent.run(client)
    except SystemExit as stop:
        if stop.code not in (None, 0):
            raise


def agent_traceback(error: BaseException, *files: str) -> str:
    """The error and how the agent came to it; frames of this file and of `files` are of no interest to its author."""
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int | str) else type(error.code)
        return showable(f"the agent exited with {code!r}", _LONGEST) + "\n"
    inner = error.__traceback__
    while inner is not None and inner.tb_frame.f_code.co_filename in (__file__, *files):
        inner = inner.tb_next
    return showable("".join(traceback.format_exception(type(error), error, inner or error.__traceback__)), _LONGEST)
