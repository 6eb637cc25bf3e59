"""An answer that comes when some time has passed."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.middleware.messages import Message


class Later:
    """A service's response that is not there yet: the service answers once, whoever called hears of it."""

    def __init__(self) -> None:
        self.response: Message | None = None
        """The response, once it is there."""
        self._listeners: list[Callable[[Message], None]] = []

    def answer(self, response: Message) -> None:
        """Give the response. A second one counts for nothing."""
        if self.response is None:
            self.response = response
            for listener in self._listeners:
                listener(response)
            self._listeners.clear()

    def then(self, listener: Callable[[Message], None]) -> None:
        """Have `listener(response)` called when it is there; at once if it is."""
        if self.response is None:
            self._listeners.append(listener)
        else:
            listener(self.response)
