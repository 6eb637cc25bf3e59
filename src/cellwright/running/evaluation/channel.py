"""Channel from a process of an evaluation to the one that started it: lines of JSON through its standard streams."""

import json
import os
import threading
from typing import BinaryIO, TextIO

_sending = threading.Lock()


def send(channel: TextIO, kind: str, content: object) -> None:
    """Send a line of JSON: an object with `content` as its only value, under `kind`. Several threads may send."""
    with _sending:
        channel.write(json.dumps({kind: content}, allow_nan=False) + "\n")
        channel.flush()


def take_over_standard_streams() -> tuple[BinaryIO, TextIO]:
    """Return stdin and stdout for the channel alone; all else reads nothing and writes to stderr from here on."""
    lifeline = os.fdopen(os.dup(0), "rb", buffering=0)
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    os.close(empty)
    os.dup2(2, 1)
    return lifeline, channel
