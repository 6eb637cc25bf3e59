"""An agent at work, and what is told of one that failed."""

from __future__ import annotations

import traceback

from cellwright.clients.agents.agent import Agent
from cellwright.clients.client.client import Client
from cellwright.running.run.course import Course, how_it_ended, wait_for_kits
from cellwright.running.run.result import Outcome
from cellwright.running.run.surroundings import surroundings_kept
from cellwright.util.errors import RunEndedError, SimulationError, showable

_LONGEST = 20_000  # characters of what is told of an error


def work_in_process(agent: Agent | None, course: Course) -> tuple[Outcome, str]:
    """Let an agent work a run in this process; without one, let time pass. How it ended, and what went wrong."""
    cell, transport = course.cell, course.transport
    client = Client(transport)
    try:
        if agent is None:
            client.wait_until(lambda: False)
        else:
            with surroundings_kept():
                let_work(agent, client)
            wait_for_kits(cell, client)
    except RunEndedError:
        pass  # the ordinary end of a program that works until it is stopped
    except KeyboardInterrupt:
        return Outcome.INTERRUPTED, ""
    except SimulationError as error:
        return Outcome.UNSTABLE, f"{error}\n"
    except BaseException as raised:  # whatever somebody's program raises is reported, and the run still has its score
        return Outcome.CRASHED, told(raised)
    finally:
        client.close()
    stopped = cell.simulation.now >= transport.deadline
    return how_it_ended(cell, otherwise=Outcome.UNTIL if stopped else Outcome.GAVE_UP), ""


def let_work(agent: Agent, client: Client) -> None:
    """Let an agent work. A program may end itself, and says with its status whether it came to its end."""
    try:
        agent.run(client)
    except SystemExit as stop:
        if stop.code not in (None, 0):
            raise


def told(error: BaseException, *files: str) -> str:
    """The error and how the agent came to it; frames of this file and of `files` are of no interest to its author."""
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int | str) else type(error.code)
        return showable(f"the agent exited with {code!r}", _LONGEST) + "\n"
    inner = error.__traceback__
    while inner is not None and inner.tb_frame.f_code.co_filename in (__file__, *files):
        inner = inner.tb_next
    return showable("".join(traceback.format_exception(type(error), error, inner or error.__traceback__)), _LONGEST)
