"""Texts as CDR has them, kept for the next time: in messages they are names mostly, and there are few of those."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

MOST = 1024
LONGEST = 1024
"""Texts that are kept [number, bytes of each]: they come from outside, and must not eat the memory."""


class KeptTexts(dict[Any, bytes]):
    """What was written, by what was to be written; what is not there yet is written when it is looked up.

    Args:
        write: writes a text, or some.
        filled: whether zeros follow up to the next multiple of four bytes.
    """

    def __init__(self, write: Callable[[Any], bytes], *, filled: bool) -> None:
        super().__init__()
        self._write, self._filled = write, filled

    def __missing__(self, key: Any) -> bytes:
        data = self._write(key)
        if self._filled:
            data += bytes(-len(data) % 4)
        if len(data) <= LONGEST:
            if len(self) >= MOST:
                self.clear()
            self[key] = data
        return data


def text(value: str) -> bytes:
    """A text: its length, its bytes and a zero."""
    data = value.encode()
    return struct.pack(f"<I{len(data)}sx", len(data) + 1, data)


def texts(values: tuple[str, ...]) -> bytes:
    """Some texts: how many, and each from the next multiple of four bytes on."""
    written = bytearray(struct.pack("<I", len(values)))
    for value in values:
        written += bytes(-len(written) % 4)
        written += text(value)
    return bytes(written)
