"""Handler of topics whose messages are for recordings alone."""

from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import RejectedCommandError

MAX_LENGTH = 2 << 20
"""Largest length of a message [characters]."""


class Notes:
    """Handler that keeps nothing: a recorder sees all that comes in."""

    def note_policy(self, row: Endpoint, message: String, node: str) -> None:
        """Refuse what is too long for a recording."""
        if len(message.data) > MAX_LENGTH:
            raise RejectedCommandError(
                f"{row.name}: from {node or 'a program'}: at most {MAX_LENGTH} characters (got {len(message.data)})"
            )
