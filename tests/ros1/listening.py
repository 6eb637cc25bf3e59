"""Where processes listen, as the kernel says (Linux): a bare machine has no `ss`."""

import ipaddress
import os
import sys
from pathlib import Path

_LISTENS = "0A"  # TCP's state LISTEN in the kernel's tables


def addresses(*pids: int) -> set[str]:
    """The hosts of the addresses at which processes listen for TCP connections.

    Args:
        pids: the processes; what has ended listens nowhere.
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
    """The inodes of the sockets that a process has open."""
    found = set()
    try:
        for descriptor in Path("/proc", str(pid), "fd").iterdir():
            target = os.readlink(descriptor)
            if target.startswith("socket:["):
                found.add(target[len("socket:[") : -1])
    except FileNotFoundError:  # it closed one, or ended, meanwhile
        pass
    return found


def _host(digits: str) -> str:
    """An address as people write it; the kernel writes words of 32 bits in the machine's byte order."""
    words = [bytes.fromhex(digits[start : start + 8]) for start in range(0, len(digits), 8)]
    return str(ipaddress.ip_address(b"".join(word[::-1] if sys.byteorder == "little" else word for word in words)))
