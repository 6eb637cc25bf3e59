"""Server of a cell's bus on a socket: programs in other processes are clients, all of them equal.

`cellwright.middleware.wire.frames` describes the protocol. The thread that steps the simulation also serves the
clients, while it waits for time to pass. So there is no lock, and commands are carried out between two ticks.
"""

from cellwright.middleware.server.server import DEFAULT_PORT, Server

__all__ = ["DEFAULT_PORT", "Server"]
