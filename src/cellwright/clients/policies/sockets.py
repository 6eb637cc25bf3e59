"""Sockets to policy servers: whether one listens, bounds on time, and the key."""

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Timer
from typing import Final
from urllib.parse import urlsplit

from cellwright.clients.policies.policy import PolicyConnectionError, PolicyError

KEY_VARIABLE: Final = "CELLWRIGHT_POLICY_KEY"
"""Environment variable of the key that a server, or a proxy before it, asks for."""

TIMEOUT: Final = 120.0
"""Bound of an answer [s]: a first inference compiles for 30 to 90 s."""


def policy_key() -> str | None:
    """Return the key of `CELLWRIGHT_POLICY_KEY`; None without one.

    Raises:
        PolicyError: no header can hold it; the error does not show it.
    """
    key = os.environ.get(KEY_VARIABLE, "").strip()
    if not (key.isascii() and key.isprintable()):
        raise PolicyError(f"{KEY_VARIABLE}: the key must be printable ASCII in one line")
    return key or None


def host_and_port(address: str, default_port: int | None) -> tuple[str, int]:
    """Return host and port of an address.

    Raises:
        PolicyError: it has none of them, and there is no default.
    """
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port or default_port
    except ValueError:
        host, port = None, None
    if not host or not port:
        raise PolicyError(f"{address}: no address of a server; write {address.partition(':')[0]}://HOST:PORT")
    return host, port


def check_listens(address: str, host: str, port: int, timeout: float) -> None:
    """Connect once, for wires that would tell only with the first observation.

    Raises:
        PolicyConnectionError: no server listens.
    """
    try:
        socket.create_connection((host, port), timeout).close()
    except (OSError, UnicodeError) as error:
        raise unreachable(address, error) from None


def unreachable(address: str, error: Exception) -> PolicyConnectionError:
    """Return the error of a server that cannot be reached."""
    reason = error.strerror or str(error) if isinstance(error, OSError) else str(error)
    return PolicyConnectionError(
        f"{address}: cannot be reached ({reason}); start the policy server, or mend the address"
    )


def late(address: str, timeout: float) -> PolicyConnectionError:
    """Return the error of an answer that did not come in time."""
    return PolicyConnectionError(
        f"{address}: no answer within {timeout:g} s; give it more time, or look at the server's log"
    )


@contextmanager
def cut_after(timeout: float, found: Callable[[], socket.socket | None]) -> Iterator[None]:
    """Break a connection after a time [s]: bounds of single reads and writes do not bound a whole exchange.

    Args:
        timeout: the time [s].
        found: returns the connection's socket; None if there is none yet.
    """

    def cut() -> None:
        with suppress(OSError):
            if (connection := found()) is not None:
                connection.shutdown(socket.SHUT_RDWR)

    timer = Timer(timeout, cut)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
