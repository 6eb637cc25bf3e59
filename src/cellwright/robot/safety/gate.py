"""Whose commands are taken, and whether they are fresh. Pure logic; each topic is looked at by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cellwright.engine.clock import nanoseconds
from cellwright.robot.safety.settings import SafetySettings
from cellwright.util.errors import RejectedCommandError

PRESENT = 1.0
"""So long [s] after its newest command a node is still said to command."""

_FORGOTTEN = nanoseconds(1.0)  # after so long a node may begin anew with older stamps, as when it was restarted


@dataclass(slots=True)
class _Stream:
    """The newest command that was taken on a topic: from which node, when [ns], and its stamp [ns]."""

    node: str
    heard: int
    stamp: int


class Gate:
    """Lets commands pass, or refuses them.

    Args:
        safety: what is guarded against.
        now: the node's own time [ns].
        told: the time that messages carry [ns].
    """

    def __init__(self, safety: SafetySettings, now: Callable[[], int], told: Callable[[], int]) -> None:
        self._now, self._told = now, told
        self._streams: dict[str, _Stream] = {}
        self._silence, self._alone, self._age = (
            None if seconds is None else nanoseconds(seconds)
            for seconds in (safety.silence, safety.one_commander, safety.max_age)
        )

    def forget(self) -> None:
        """Begin anew."""
        self._streams.clear()

    def check(self, topic: str, node: str, stamp: int) -> None:
        """Look at a command before it is carried out; `stamp` [ns] 0 means that it has none.

        Raises:
            RejectedCommandError: it is not to be carried out.
        """
        newest = self._streams.get(topic)
        if newest is not None and self._alone is not None and newest.node != node:
            quiet = self._now() - newest.heard
            if quiet <= self._alone:
                raise RejectedCommandError(
                    f"{newest.node or 'another'} commands here; another may when it has been silent for "
                    f"{self._alone / 1e9:g} s"
                )
        if self._age is not None and stamp:
            self._check_stamp(newest, node, stamp, self._age)

    def _check_stamp(self, newest: _Stream | None, node: str, stamp: int, limit: int) -> None:
        age = self._told() - stamp
        if age > limit:
            raise RejectedCommandError(f"it is {age / 1e9:.3g} s old, and {limit / 1e9:g} s are allowed")
        if age < -limit:
            raise RejectedCommandError(f"its stamp is {-age / 1e9:.3g} s ahead of the node's clock")
        if newest is None or newest.node != node or self._now() - newest.heard > _FORGOTTEN:
            return
        if stamp < newest.stamp:
            raise RejectedCommandError(f"it is {(newest.stamp - stamp) / 1e9:.3g} s older than the one before it")

    def confirm(self, topic: str, node: str, stamp: int) -> None:
        """Take note of a command that was carried out."""
        self._streams[topic] = _Stream(node, self._now(), stamp)

    def is_silent(self, topic: str) -> bool:
        """Whether a topic has been silent for too long; never where nothing has come yet, or nobody asked for it."""
        newest = self._streams.get(topic)
        return newest is not None and self._silence is not None and self._now() - newest.heard > self._silence

    @property
    def commanders(self) -> tuple[str, ...]:
        """The nodes whose commands were taken a moment ago."""
        since = self._now() - nanoseconds(PRESENT)
        return tuple(
            sorted({stream.node for stream in self._streams.values() if stream.node and stream.heard >= since})
        )

    def get_state(self) -> dict[str, Any]:
        """All of it, as JSON values."""
        return {topic: [each.node, each.heard, each.stamp] for topic, each in self._streams.items()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self._streams = {topic: _Stream(*each) for topic, each in state.items()}
