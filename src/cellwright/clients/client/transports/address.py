"""Where a cell is served, as people write it."""

from __future__ import annotations

import re

from cellwright.util.errors import UsageError

_LAST_PORT = 65535


def address_of(address: str | tuple[str, int]) -> tuple[str, int]:
    """Host and port from `HOST:PORT`; a pair is one already.

    Raises:
        UsageError: it is no address.
    """
    host, port = address if not isinstance(address, str) else _split(address)
    if not host or not 0 < port <= _LAST_PORT:
        raise UsageError(f"{address}: give a host and a port, such as 127.0.0.1:11399")
    return host, port


def _split(address: str) -> tuple[str, int]:
    """Host and port of a text; port 0 where it has none."""
    host, _, port = address.rpartition(":")
    return host, int(port) if re.fullmatch("[0-9]{1,5}", port) else 0
