"""Worker program of an evaluation: reads one job from stdin, and writes progress and the result to stdout.

What the agent prints, logs or leaves behind when it crashes goes to stderr, the log of the job. The process ends when
its stdin ends. So it never outlives the evaluation that started it, however that ended.
"""

import faulthandler
import json
import logging
import os
import signal
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from cellwright.cell.cell import Cell
from cellwright.cell.devices.grippers import Gripper
from cellwright.cell.kitting.effects import Effect, KitSubmitted, OrderAnnounced, OrderCompleted
from cellwright.cell.kitting.evidence import evidence_to_json
from cellwright.cell.kitting.inventory import part_type
from cellwright.cell.variation import vary
from cellwright.clients.agents.agent import Agent, AgentError, find_agent
from cellwright.config.parsing.overrides import Override
from cellwright.config.parsing.sources import sources_collected
from cellwright.config.trial.gear2017 import load_trial
from cellwright.recording.format.run_log import RunLog
from cellwright.running.evaluation.execution.channel import SignedChannel
from cellwright.running.evaluation.execution.memory import limit_memory
from cellwright.running.evaluation.execution.process import JobOrder
from cellwright.running.evaluation.execution.replayed import ReplayedCommands
from cellwright.running.evaluation.results.state import StateReporter
from cellwright.running.remote.hosting import RemoteAgent
from cellwright.running.run import (
    CellTarget,
    Outputs,
    Program,
    RecordOptions,
    RunOptions,
    ServerOptions,
    Session,
    cell_result,
)
from cellwright.util.errors import RecordingError, UsageError
from cellwright.util.process import take_over_standard_streams

_BEFORE = ("init", "ready")
"""States of a competition that has not started."""
_PROGRESS_PERIOD = 0.5  # [s] of wall time between two lines of progress
_PR_SET_DUMPABLE = 4


class Timeline:
    """Timeline of one run of a cell; it does not affect the run.

    Call `look` some ten times a simulated second: it reads the states of AGVs and fixed trays.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._orders: dict[str, dict[str, Any]] = {}
        self._kits: list[dict[str, Any]] = []
        self._held: list[dict[str, Any]] = []
        self._senders: dict[str, list[dict[str, Any]]] = {name: [] for name in cell.senders}
        cell.competition.on_effect.append(self._take_effect)
        self._lasting: dict[str, dict[str, Any]] = {}
        """Part that each gripper holds, by the gripper's name."""
        for gripper in cell.grippers.values():
            gripper.on_change.append(self._take_grip)

    def look(self) -> None:
        """Read the states of AGVs and fixed trays."""
        now = self._cell.simulation.time
        for name, sender in self._cell.senders.items():
            spans = self._senders[name]
            if not spans or spans[-1]["state"] != sender.state:
                if spans:
                    spans[-1]["end"] = now
                spans.append({"begin": now, "end": None, "state": sender.state})

    def as_json(self) -> dict[str, Any]:
        """Return the events so far as JSON values; times in s, `end` None for what still lasts."""
        return {
            "end": self._cell.simulation.time,
            "orders": list(self._orders.values()),
            "kits": self._kits,
            "held": self._held,
            "agvs": {_short(name): spans for name, spans in self._senders.items()},
        }

    def _take_effect(self, effect: Effect) -> None:
        now = self._cell.simulation.time
        match effect:
            case OrderAnnounced(order):
                self._orders[order.order_id] = {"order": order.order_id, "announced": now, "completed": None}
            case OrderCompleted(score):
                self._orders[score.order_id]["completed"] = now
            case KitSubmitted(tray, kit_type, score):
                number = _short(tray.partition("::")[0])
                self._kits.append({"time": now, "agv": number, "kit": kit_type, "points": score.total})
            case _:
                pass

    def _take_grip(self, gripper: Gripper) -> None:
        now = self._cell.simulation.time
        lasting = self._lasting.get(gripper.name)
        if lasting is not None:
            if gripper.part == lasting["part"]:
                return
            self._lasting.pop(gripper.name)["end"] = now
        if gripper.part is not None:
            held = {"begin": now, "end": None, "part": gripper.part, "type": part_type(gripper.part)}
            self._lasting[gripper.name] = held
            self._held.append(held)


def work(order: JobOrder, channel: SignedChannel) -> dict[str, Any]:
    """Run a job: a trial's files, a program, a seed. Return the fields of a `Report`.

    Raises:
        AgentError: there is no such agent, or it could not be made.
        RecordingError: the recording to play cannot be read.
    """
    program = _program(order)
    with sources_collected() as sources:
        cell = make_cell(order)
    timeline = Timeline(cell)
    states = StateReporter(cell, channel.send)
    shown = time.monotonic()

    def progress(cell: Cell) -> None:
        nonlocal shown
        timeline.look()
        # A program that never starts the competition would otherwise use all of its wall time.
        if cell.competition.state in _BEFORE and cell.simulation.time >= order.start:
            session.stop.limit(cell.simulation.now, "the competition was not started in time")
        now = time.monotonic()
        if now - shown >= _PROGRESS_PERIOD:
            shown = now
            points = cell.competition.score().total if cell.task is None else float(cell.task.succeeded_at is not None)
            channel.send("progress", {"time": cell.simulation.time, "points": points})
            states.report()

    files = list(map(Path, order.files))
    with Session(
        CellTarget(lambda: cell, lambda: files, is_varied=order.vary, sources=sources),
        serve=ServerOptions(port=0, lockstep=True) if order.over else False,
        record=RecordOptions(make_record(order), {"agent": order.agent}, log=make_log(order)),
        options=RunOptions(on_progress=progress),
        outputs=Outputs(report=_warn),
    ) as session:
        result = cell_result(session.run(program))
    timeline.look()
    states.report()
    sys.stderr.write(result.error)
    return {
        "outcome": result.outcome.name.lower(),
        "points": result.points,
        "wall": result.wall,
        "simulated": result.simulated,
        "steps": result.steps,
        "success": result.success,
        "state_hash": result.state_hash,
        "score": evidence_to_json(result.evidence),
        "timeline": timeline.as_json(),
        "error": result.error,
    }


def _program(order: JobOrder) -> Agent | Program:
    """Return what works the cell; only an agent without `over` runs in this process."""
    if order.replays:
        return ReplayedCommands(Path(order.replays), order.end)
    if order.over:
        return RemoteAgent(order.agent, level=logging.INFO, on_message=_print)
    return find_agent(order.agent)()


def _print(line: str) -> None:
    sys.stderr.write(f"{line}\n")


def make_cell(order: JobOrder) -> Cell:
    """Return a new cell for a job, from its files."""
    trial = load_trial(list(map(Path, order.files)), overrides=list(map(Override.read, order.overrides))).trial
    return Cell(vary(trial, order.seed) if order.vary else trial, seed=order.seed, report=_warn)


def _warn(line: str) -> None:
    logging.getLogger("cellwright").warning("%s", line)


def make_log(order: JobOrder) -> RunLog | None:
    """Return the log of a job, if it has one; without one the run counts all the same."""
    if not order.run_log:
        return None
    try:
        return RunLog(Path(order.run_log), about={"agent": order.agent}, report=_warn)
    except UsageError as error:
        _warn(str(error))
        return None


def make_record(order: JobOrder) -> list[Path]:
    """Return the recording of a job, if it has one; without it the run counts all the same."""
    if not order.record:
        return []
    path = Path(order.record)
    try:
        path.open("wb").close()
    except OSError as error:
        _warn(f"{path}: cannot be written: {error.strerror or error}")
        return []
    return [path]


def main() -> NoReturn:
    """Run the job from stdin, and exit."""
    lifeline, stream = take_over_standard_streams()
    order = JobOrder(**json.loads(lifeline.readline()))
    channel = SignedChannel(stream, order.key)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    faulthandler.enable()
    if order.memory:
        limit_memory(order.memory)
    if order.over:
        # of this process alone: the evaluation removes it, however the run ends
        tempfile.tempdir = sys.argv[2]
        _hide_memory()
    _report_own_kills(channel)
    channel.send("begun", os.getpid())
    # C's own timer: it ends a program that hangs inside a library too, and the log shows where
    faulthandler.dump_traceback_later(order.wall, exit=True)
    try:
        if order.files:
            channel.send("result", work(order, channel))
        else:
            find_agent(order.agent)()
            channel.send("made", True)
    except (AgentError, RecordingError) as error:
        channel.send("refused", str(error))
    sys.stdout.flush()
    sys.stderr.flush()
    # does not wait for threads that the agent has left behind
    os._exit(0)


def _hide_memory() -> None:
    """Keep other processes of the same user, unless it is root, from the memory and the streams of this one."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_DUMPABLE, 0)


def _report_own_kills(channel: SignedChannel) -> None:
    """Report when the program kills this process from Python: the end of a process does not show who sent the signal.

    A thread or a fork of the agent may do so too. Its guard counts as this process.
    """
    if sys.platform == "win32":
        return
    number, guard = os.getpid(), os.getppid()
    own = {"os.kill": {number, -number, 0, -1, guard, -guard}, "os.killpg": {number, 0, guard}}

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event in own and arguments[0] in own[event] and arguments[1] in (signal.SIGKILL, signal.SIGTERM):
            with suppress(OSError):  # the evaluation has ended
                channel.send_at_once("kills", True)

    sys.addaudithook(hook)


def _end_with(lifeline: BinaryIO) -> None:
    lifeline.read(1)
    if sys.platform != "win32" and os.getpgrp() == os.getpid():
        # with the processes that the agent has started
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def _short(sender: str) -> str:
    """Return the name of what submits kits in a timeline: the number of an AGV, or the name of a fixed tray."""
    return sender.removeprefix("agv")


if __name__ == "__main__":
    main()
