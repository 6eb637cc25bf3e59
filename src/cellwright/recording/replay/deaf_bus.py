"""A bus that speaks and hears nothing: what was recorded cannot be changed any more."""

from __future__ import annotations

from typing import Any, NoReturn

from cellwright.middleware.bus import Bus
from cellwright.middleware.messages import Message
from cellwright.util.errors import RejectedCommandError

WHY_NOT = "this is a recording: it plays what was, and hears no commands"


class DeafBus(Bus):
    """Topics that are listened to, as those of any bus; every command and every call is refused."""

    def publish(self, topic: str, message: Message, *, node: str = "") -> None:  # noqa: ARG002
        """Refuse a message.

        Raises:
            RejectedCommandError: always.
        """
        self._refuse(topic, node)

    def call(self, service: str, request: Message, *, node: str = "") -> Any:  # noqa: ARG002
        """Refuse a call.

        Raises:
            RejectedCommandError: always.
        """
        self._refuse(service, node)

    def _refuse(self, name: str, node: str) -> NoReturn:
        self.refusals.refuse(f"{name} from {node}" if node else name, WHY_NOT)
        raise RejectedCommandError(WHY_NOT)
