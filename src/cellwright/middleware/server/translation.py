"""Messages to bytes and back, in the two forms that guests may ask for."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.middleware.messages import Message, from_cdr, from_ros1, to_cdr, to_ros1

_WRITE: dict[str, Callable[[Message], bytes]] = {"cdr": to_cdr, "ros1": to_ros1}

ENCODINGS = tuple(_WRITE)
"""Names of the forms: CDR as in ROS 2, and that of ROS 1."""


class Translation:
    """Writes each message once in each form, however many guests it goes to."""

    def __init__(self) -> None:
        self._newest: Message | None = None
        self._written: dict[str, bytes] = {}

    def to_bytes(self, message: Message, encoding: str) -> bytes:
        """A message as bytes.

        Raises:
            UsageError: its type has no such form.
            MessageError: a value does not fit its field.
        """
        if message is not self._newest:
            self._newest, self._written = message, {}
        data = self._written.get(encoding)
        if data is None:
            data = self._written[encoding] = _WRITE[encoding](message)
        return data


def from_bytes(data: bytes, message_class: type[Message], encoding: str) -> Message:
    """The message in bytes.

    Raises:
        MessageError: it is something else.
    """
    return from_ros1(data, message_class) if encoding == "ros1" else from_cdr(data, message_class)
