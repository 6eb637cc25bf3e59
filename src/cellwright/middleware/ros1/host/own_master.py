"""A ROS master of our own, where nobody runs one: master and log collector, as `roscore` has them.

They are started one by one and not by `roscore`, which would leave them behind if it were killed.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable

from cellwright.middleware.ros1.host.children import Child, Patience, how_it_ended
from cellwright.middleware.ros1.host.installation import HOW_TO_GET_IT, Installation
from cellwright.middleware.ros1.host.master import Master
from cellwright.util.errors import UsageError

START_LIMIT = 15.0
"""How long [s] a master may take to answer."""

_NAP = 0.02


class OwnMaster:
    """Runs a master, and again when it ends.

    Args:
        installation: the ROS 1 to take it from.
        master: where it is to answer.
        report: takes a line about what happens.

    Raises:
        UsageError: there is no program to run, or something else listens at the address.
    """

    def __init__(self, installation: Installation, master: Master, report: Callable[[str], None]) -> None:
        program = installation.program("rosmaster")
        if program is None:
            raise UsageError(f"no ROS master answers at {master.uri}, and rosmaster is not installed; {HOW_TO_GET_IT}")
        if master.is_port_taken():
            raise UsageError(f"what listens at {master.uri} is no ROS master; ROS_MASTER_URI can name another port")
        self._installation = installation
        self._master = master
        self._report = report
        self._program = program
        self._patience = Patience()
        self._again = 0.0
        self._is_left_to_others = False
        self._said = ""
        self._rosout: Child | None = None
        self._rosout_patience = Patience()
        self._rosout_again: float | None = None
        self._child: Child | None = self._start()

    def wait(self, is_stopped: Callable[[], bool], *, limit: float = START_LIMIT) -> None:
        """Wait until it answers, or until there is a wish to stop.

        Raises:
            UsageError: it ended, or did not answer in time.
        """
        end = time.monotonic() + limit
        while not self._master.answers():
            if is_stopped():
                return
            status = None if self._child is None else self._child.poll()
            if status is not None or time.monotonic() > end:
                how = "does not answer" if status is None else how_it_ended(status)
                raise UsageError(f"the ROS master that was started at {self._master.uri} {how}: {self._said}")
            time.sleep(_NAP)
        self._start_rosout()

    def mark(self) -> None:
        """Give the run an id, as `roslaunch` expects of a master.

        Raises:
            MasterError: it does not answer.
        """
        self._master.set_parameter("/run_id", str(uuid.uuid1()))

    def poll(self) -> None:
        """Look after it; to be called often."""
        if self._child is not None:
            status = self._child.poll()
            if status is None:
                self._look_after_rosout()
            else:
                wait = self._patience.after(time.monotonic() - self._child.started)
                self._report(f"the ROS master at {self._master.uri} {how_it_ended(status)}; it is started again")
                self._stop_children()
                self._again = time.monotonic() + wait
        elif time.monotonic() >= self._again and not self._is_left_to_others:
            if self._master.is_port_taken():
                self._is_left_to_others = True
                self._report(f"somebody else listens at {self._master.uri} now; it is left to run the master")
            else:
                self._again = time.monotonic() + self._patience.after(0.0)
                self._child = self._start()
                self._start_rosout()

    def stop(self) -> None:
        """End it."""
        self._stop_children()

    def _start(self) -> Child:
        return self._run([self._program, "--core", "-p", str(self._master.port)])

    def _start_rosout(self) -> None:
        """The node that collects what others log; it waits for the master by itself."""
        if rosout := self._installation.node("rosout", "rosout"):
            self._rosout = self._run([rosout])

    def _look_after_rosout(self) -> None:
        """Start it again if it alone has ended; without it what programs log is lost, and nothing else."""
        if self._rosout is not None and (status := self._rosout.poll()) is not None:
            self._rosout_again = time.monotonic() + self._rosout_patience.after(time.monotonic() - self._rosout.started)
            self._report(f"the node /rosout {how_it_ended(status)}; it is started again")
            self._rosout = None
        elif self._rosout is None and self._rosout_again is not None and time.monotonic() >= self._rosout_again:
            self._rosout_again = None
            self._start_rosout()

    def _run(self, command: list[str]) -> Child:
        return Child(
            command,
            self._installation.environment,
            python=self._installation.python,
            on_error=self._hear,
        )

    def _hear(self, line: str) -> None:
        self._said = line

    def _stop_children(self) -> None:
        for child in (self._rosout, self._child):
            if child is not None:
                child.stop()
        self._rosout = self._child = None
        self._rosout_again = None
