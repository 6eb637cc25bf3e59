"""What comes from outside, as those see it who take notes of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class How(StrEnum):
    """How something came."""

    PUBLISH = "publish"
    CALL = "call"
    EXTRA = "extra"
    """A service of the server itself, past the bus."""


@dataclass(frozen=True, slots=True)
class Given:
    """Something that came from outside.

    Attributes:
        how: how it came.
        name: of the topic or service.
        message: what was published, or the request; a dictionary of JSON values where it came past the bus.
        node: whom it came from.
    """

    how: How
    name: str
    message: Any
    node: str
