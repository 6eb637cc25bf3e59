"""Listening addresses of processes, from the kernel (Linux): a bare machine has no `ss`."""

import ipaddress
import os
import sys
from pathlib import Path

_LISTENS = "0A"  # TCP's state LISTEN in the kernel's tables


def addresses(*pids: int) -> set[str]:
    """Return the hosts of the addresses at which processes listen for TCP connections.

    Args:
        pids: the processes; ended ones have none.
    """
    ours = {socket for pid in pids for socket in _sockets(pid)}
    found = set()
    for table in ("tcp", "tcp6"):
        path = Path("/proc/net", table)
        for line in path.read_text().splitlines()[1:] if path.exists() else ():
            words = line.split()
            if words[3] == _LISTENS and words[9] in ours:
                found.add(_host(words[1].partition(":")[0]))
    return found


def _sockets(pid: int) -> set[str]:
    """Return the inodes of a process's open sockets."""
    found = set()
    try:
        for descriptor in Path("/proc", str(pid), "fd").iterdir():
            target = os.readlink(descriptor)
            if target.startswith("socket:["):
                found.add(target[len("socket:[") : -1])
    except FileNotFoundError:  # it has closed one, or ended
        pass
    return found


def _host(digits: str) -> str:
    """Return an address in its usual form; the kernel writes words of 32 bits in the machine's byte order."""
    words = [bytes.fromhex(digits[start : start + 8]) for start in range(0, len(digits), 8)]
    return str(ipaddress.ip_address(b"".join(word[::-1] if sys.byteorder == "little" else word for word in words)))
