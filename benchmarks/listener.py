"""Client in a process of its own that counts the messages of a topic until its cell is gone."""

from __future__ import annotations

import socket
import subprocess
import sys

from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, hello


def listening(address: tuple[str, int], topic: str, encoding: str) -> subprocess.Popen[str]:
    """Start such a process; it prints the number of messages at its end.

    Args:
        address: of the cell's server.
        topic: the topic.
        encoding: of the messages: ros1 or cdr.
    """
    command = [sys.executable, "-m", __name__, *map(str, address), topic, encoding]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603


def count(host: str, port: int, topic: str, encoding: str) -> int:
    """Listen until the connection ends; return the number of messages."""
    with socket.create_connection((host, port)) as connection:
        connection.sendall(hello("/listener", encoding).encode())
        connection.sendall(Frame(FrameKind.SUBSCRIBE, 1, topic).encode())
        decoder, found = Decoder(), 0
        while data := connection.recv(1 << 18):
            found += sum(frame.kind is FrameKind.MESSAGE for frame in decoder.feed(data))
    return found


if __name__ == "__main__":
    host, port, topic, encoding = sys.argv[1:]
    sys.stdout.write(f"{count(host, int(port), topic, encoding)}\n")
