"""Unique ports for tests, across all workers."""

import os
import random
import socket

# Below the range from which a kernel assigns ports to connections, so that none of those takes one.
_LOWEST, _HIGHEST = 20000, 29999
_chance = random.Random(f"{os.getpid()} {os.environ.get('PYTEST_XDIST_WORKER')}")


def free_port() -> int:
    """Return a free port of the loopback."""
    while True:
        port = _chance.randint(_LOWEST, _HIGHEST)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
