"""Work of an agent in this process: its call, its errors, and the switches of the process that it may have changed."""

from __future__ import annotations

import locale
import os
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import current_thread, main_thread

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyConnectionError
from cellwright.running.run.result import Outcome, final_outcome
from cellwright.util.errors import RunEndedError, SimulationError, printable

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM", "SIGUSR1") if hasattr(signal, name)
)
POLICY_FAULTS = (PolicyConnectionError, PolicyAnswerError)
"""Errors of a policy's server and its wire: no verdict on a policy."""
DRIVE = 30.0
"""Simulation time [s] to wait for a kit that is on its way after the agent has returned."""
_MAX_ERROR = 20_000  # characters of an error


@contextmanager
def restored_environment() -> Iterator[None]:
    """Restore the working folder, numpy's error handling, signal handlers, locale, streams and other switches.

    It leaves what it cannot restore: a folder that is gone, a handler that was not set in Python.
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
    """Return the working folder; empty if it is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def wait_for_kits(cell: Cell, client: Client) -> None:
    """Wait for kits on their way after the agent has returned; the competition may still end."""
    competition, senders = cell.competition, tuple(cell.senders.values())

    def no_kit_on_its_way() -> bool:
        return competition.state == "done" or all(each.state != "preparing_to_deliver" for each in senders)

    client.wait_until(no_kit_on_its_way, DRIVE)
    client.wait_until(lambda: competition.state == "done", 0.1)


def work_in_process(agent: Agent, cell: Cell, transport: InProcess) -> tuple[Outcome, str]:
    """Let an agent work a run in this process; return how it ended, and the error."""
    client = Client(transport)
    try:
        with restored_environment():
            call_agent(agent, client)
        wait_for_kits(cell, client)
    except RunEndedError:
        # The normal end of a program that works until it is stopped.
        pass
    except KeyboardInterrupt:
        return Outcome.INTERRUPTED, ""
    except POLICY_FAULTS as error:
        return Outcome.INFRASTRUCTURE, f"{error}\n"
    except SimulationError as error:
        return Outcome.UNSTABLE, f"{error}\n"
    except BaseException as raised:  # any error of an agent is reported, and the run still has its score
        return Outcome.CRASHED, agent_traceback(raised)
    finally:
        client.close()
    stopped = cell.simulation.now >= transport.stop.deadline
    return final_outcome(cell, otherwise=Outcome.UNTIL if stopped else Outcome.GAVE_UP), ""


def call_agent(agent: Agent, client: Client) -> None:
    """Let an agent work. A program may exit, and reports with its status whether it came to its end."""
    try:
        agent.run(client)
    except SystemExit as stop:
        if stop.code not in (None, 0):
            raise


def agent_traceback(error: BaseException, *files: str) -> str:
    """Return the error with the agent's traceback, without frames of this file and of `files`."""
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int | str) else type(error.code)
        return printable(f"the agent exited with {code!r}", _MAX_ERROR) + "\n"
    inner = error.__traceback__
    while inner is not None and inner.tb_frame.f_code.co_filename in (__file__, *files):
        inner = inner.tb_next
    return printable("".join(traceback.format_exception(type(error), error, inner or error.__traceback__)), _MAX_ERROR)
