"""How many messages each caller was sent: what a program in lockstep waits for, so that none is overtaken."""

from __future__ import annotations


class Sent:
    """Counts by caller and topic, since the caller connected."""

    def __init__(self) -> None:
        self._counts: dict[str, dict[str, int]] = {}

    def begin(self, caller: str, topic: str) -> None:
        """A caller has connected to a topic; if it did before, that connection does not count any more."""
        self._counts.setdefault(caller, {})[topic] = 0

    def end(self, caller: str, topic: str) -> None:
        """A caller has left a topic."""
        counts = self._counts.get(caller, {})
        counts.pop(topic, None)
        if not counts:
            self._counts.pop(caller, None)

    def count(self, caller: str, topic: str) -> None:
        """A caller is being sent one message more."""
        counts = self._counts[caller]
        counts[topic] = counts.pop(topic) + 1

    def of(self, caller: str) -> list[tuple[str, int]]:
        """Topics and how many messages the caller was sent, the topic of the newest message last."""
        return list(self._counts.get(caller, {}).items())
