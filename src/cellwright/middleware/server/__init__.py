"""The cell's bus on a socket: programs in other processes are guests, all of them equal.

What guests and cell say to each other stands in `cellwright.middleware.wire.frames`. Guests are served by the thread
that steps the simulation, while it waits for time to pass: there is no lock, and a command lands at the border between
two ticks.
"""

from cellwright.middleware.server.server import DEFAULT_PORT, Server

__all__ = ["DEFAULT_PORT", "Server"]
