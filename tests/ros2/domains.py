"""Domains of ROS 2 for tests, each with one process of the machine at a time: no other worker or checkout has it."""

from __future__ import annotations

import os
import random
import socket
from collections import deque
from contextlib import suppress

from tests.support.waiting import wait_until

DOMAINS = range(1, 91)
"""Domains for tests; benchmarks have 91, and from 102 on their ports are those of connections."""

_RESTING = 8
"""Domains that a process keeps after their use, since a killed node is seen in its domain for 20 s."""

_chance = random.Random(f"{os.getpid()} {os.environ.get('PYTEST_XDIST_WORKER')}")
_resting: deque[socket.socket] = deque()


class TakenDomain:
    """Domain of this process until it is given back, or the process ends in any way.

    A socket whose name is in the kernel alone holds it. It leaves no file behind, and reaches as far as domains do,
    which are ports of one network namespace.

    Attributes:
        number: of the domain.
        lock: the socket.
    """

    def __init__(self) -> None:
        self.number = wait_until(self._take, "free domain of ROS 2")

    def _take(self) -> int:
        for number in _chance.sample(DOMAINS, len(DOMAINS)):
            self.lock = socket.socket(socket.AF_UNIX)
            with suppress(OSError):
                self.lock.bind(f"\0cellwright test domain {number}")
                return number
            self.lock.close()
        return 0

    def give_back(self) -> None:
        """Let others take it, after this process has taken some more."""
        _resting.append(self.lock)
        if len(_resting) > _RESTING:
            _resting.popleft().close()
