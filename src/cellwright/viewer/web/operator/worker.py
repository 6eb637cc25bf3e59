"""Worker thread of the operator: polls the robot and sends queued commands, stamped with the node's clock.

An emergency stop has a connection of its own, used in the thread of the button: no pending request delays it. Slow
services (going home) run in a thread too, one at a time.
"""

import logging
import threading
import time
from typing import Any

from cellwright.clients.operators.robot import Ask, Now, command_message, service_request
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.connection import AwayError, ServerConnection
from cellwright.viewer.web.operator.command_queue import Command, CommandQueue
from cellwright.viewer.web.operator.robot_state import RobotState, SeenRobot

_MAX_RATE = 100.0  # [s of the node per s of wall time]
_MIN_INTERVAL = 0.01  # [s] between two stamps, to measure the rate
_MAX_EXTRAPOLATION = 0.25  # [s], longest extrapolation
NODE = "/browser_operator"
"""Node name of the operator, in the node and in recordings."""
_DRIVING, _WATCHING, _IDLE = 0.02, 0.05, 1.0  # [s] between two polls
_AFTERWARDS = 2.0  # [s] after the last request during which polling stays fast
_AWAY = 1.0  # [s] between attempts to reconnect


class NodeClock:
    """Estimate of the node's clock, extrapolated at the measured rate: right at any speed, and when paused."""

    def __init__(self) -> None:
        self._stamp, self._heard, self._rate = 0, float("-inf"), 1.0

    def hear(self, stamp: int, now: float) -> None:
        """Add a reading: the node's clock showed `stamp` [ns] at `now` [s]."""
        gone = now - self._heard
        if gone >= _MIN_INTERVAL:
            rate = (stamp - self._stamp) / 1e9 / gone
            self._rate = min(max(rate, 0.0), _MAX_RATE) if gone < float("inf") else 1.0
        self._stamp, self._heard = stamp, now

    def at(self, now: float) -> int:
        """Return the estimated node time at `now` [s]; 0, no time, before the first reading."""
        gone = now - self._heard
        if gone == float("inf"):
            return 0
        return self._stamp + round(min(max(gone, 0.0), _MAX_EXTRAPOLATION) * self._rate * 1e9)


log = logging.getLogger(__name__)


class Worker:
    """Operator thread of the robot whose node is served at an address."""

    def __init__(self, address: tuple[str, int]) -> None:
        self.queue: CommandQueue | None = None
        """Command queue of the robot; None before the first answer."""
        self.is_watched = True
        """True while a browser is connected."""
        self._link, self._stop_link, self._service_link = (ServerConnection(address, node=NODE) for _ in range(3))
        self._clock = NodeClock()
        self._polled = float("-inf")
        self._service: threading.Thread | None = None
        self._waiting_for = ""
        self._is_over = False
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="operator", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; send nothing more."""
        self._is_over = True
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(_AWAY)
        self._link.close()
        self._stop_link.close()
        if self._service is None or not self._service.is_alive():  # else it ends with its answer
            self._service_link.close()

    def stop(self) -> str:
        """Send an emergency stop, now or once the node is there; return why it is not sent yet, or an empty text."""
        queue = self.queue
        if queue is None:
            return "the robot has not answered yet"
        queue.stop()
        try:
            self._stop_link.publish(*command_message(Now.STOP, 0))
        except CellwrightError as error:
            text = f"emergency stop not delivered yet: {error}"
            queue.answered(text)
            return text
        queue.sent(Now.STOP)
        return ""

    def _run(self) -> None:
        while not self._is_over:
            try:
                self._work()
                pause = max(0.0, self._polled + self._period() - time.perf_counter())
            except Exception as error:  # also a defect: this thread must not end, so that a stop gets through
                message = str(error)
                if not isinstance(error, CellwrightError):
                    log.exception("browser operator failed")
                    message = f"failed: {type(error).__name__}: {error}"
                elif not isinstance(error, AwayError):  # no robot, or one of another version
                    self._link.close()
                self._lose()
                if self.queue is not None and not isinstance(error, AwayError):
                    self.queue.answered(message)
                pause = _AWAY
            self._wake.wait(pause)

    def _work(self) -> None:
        now = time.perf_counter()
        self._wake.clear()
        queue = self.queue
        if queue is not None:
            for command in queue.due():
                self._send(queue, command)
        if now - self._polled >= self._period() or queue is None:
            self._polled = now
            self._look()

    def _look(self) -> None:
        """Poll the robot's state."""
        queue = self.queue
        answer = self._link.ask(PANEL, robot=queue.robot.digest if queue is not None else "")
        if queue is None or answer.get("digest") != queue.robot.digest:
            queue = CommandQueue(SeenRobot.read(answer), wake=self._wake)
            # Connect before an emergency stop needs it.
            if not self._stop_link.is_there:
                self._stop_link.connect()
        state = RobotState.read(answer)
        self._clock.hear(state.stamp, time.perf_counter())
        queue.see(state)
        self.queue = queue

    def _send(self, queue: CommandQueue, command: Command) -> None:
        if isinstance(command, Ask):
            self._call(queue, command)
            return
        try:
            self._link.publish(*command_message(command, self._clock.at(time.perf_counter())))
        except AwayError:
            raise
        except CellwrightError as error:
            queue.refused(str(error))
        else:
            queue.sent(command)

    def _period(self) -> float:
        queue = self.queue
        if queue is not None and time.perf_counter() - queue.active < _AFTERWARDS:
            return _DRIVING
        return _WATCHING if self.is_watched else _IDLE

    def _lose(self) -> None:
        if self.queue is not None:
            self.queue.lose()
        self._stop_link.close()

    def _call(self, queue: CommandQueue, ask: Ask) -> None:
        if self._service is not None and self._service.is_alive():
            queue.answered(f"still waiting for {self._waiting_for}")
            return
        self._waiting_for = ask.value
        self._service = threading.Thread(target=self._called, args=(queue, ask), daemon=True)
        self._service.start()

    def _called(self, queue: CommandQueue, ask: Ask) -> None:
        queue.answered(f"{ask.value} …")
        try:
            answer: Any = self._service_link.call(*service_request(ask))
        except CellwrightError as error:
            queue.answered(f"{ask.value}: {error}")
            return
        outcome = "done" if answer.success else "refused"
        queue.answered(f"{ask.value}: {outcome}; {answer.message}" if answer.message else f"{ask.value}: {outcome}")
