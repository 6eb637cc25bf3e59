"""Whether messages of a type begin with a header."""

from __future__ import annotations

import re

_HEADER = re.compile(r"^\s*(?:std_msgs/)?Header\s+header\s*(?:#.*)?$")
_NO_FIELD = re.compile(r"^\s*(?:#.*)?$|^\s*\w+\s+\w+\s*=")
"""Comments and constants."""


def has_header(definition: str) -> bool:
    """Whether messages of this definition begin with a header, whose first four bytes count them."""
    for line in definition.splitlines():
        if not _NO_FIELD.match(line):
            return _HEADER.match(line) is not None
    return False
