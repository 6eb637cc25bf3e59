"""Where a cell is served, as people write it."""

from __future__ import annotations

from cellwright.errors import UsageError


def address_of(address: str | tuple[str, int]) -> tuple[str, int]:
    """Host and port from `HOST:PORT`; a pair is one already.

    Raises:
        UsageError: it is no address.
    """
    if not isinstance(address, str):
        return address
    host, _, port = address.rpartition(":")
    if not host or not (port.isascii() and port.isdigit() and len(port) <= 5) or not 0 < int(port) <= 65535:
        raise UsageError(f"{address}: give a host and a port, such as 127.0.0.1:11399")
    return host, int(port)
