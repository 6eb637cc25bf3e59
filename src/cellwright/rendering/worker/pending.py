"""What has been asked for, and will be there later."""

from __future__ import annotations

import threading
from typing import Any, Generic, TypeVar, cast

from cellwright.util.errors import RenderingError

T = TypeVar("T")


class Pending(Generic[T]):
    """Something that will be there later."""

    def __init__(self) -> None:
        self._event = threading.Event()
        self._value: Any = None
        self._error = ""

    @property
    def is_done(self) -> bool:
        """Whether it is there, or has failed."""
        return self._event.is_set()

    def result(self, timeout: float | None = None) -> T:
        """What was asked for, waiting for it at most so long [s].

        Raises:
            RenderingError: it could not be made, or is not there in time.
        """
        if not self._event.wait(timeout):
            raise RenderingError(f"what draws has not answered within {timeout:g} s")
        if self._error:
            raise RenderingError(self._error)
        return cast("T", self._value)

    def settle(self, value: Any, error: str = "") -> None:
        """Say what has come of it."""
        self._value, self._error = value, error
        self._event.set()
