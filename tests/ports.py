"""Ports that no other test has, in this or in another worker."""

import os
import random
import socket

# Below the range from which a kernel gives out ports for connections, so that none of those gets in between.
_LOWEST, _HIGHEST = 20000, 29999
_chance = random.Random(f"{os.getpid()} {os.environ.get('PYTEST_XDIST_WORKER')}")


def free_port() -> int:
    """A port of the loopback that nobody listens at now."""
    while True:
        port = _chance.randint(_LOWEST, _HIGHEST)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
