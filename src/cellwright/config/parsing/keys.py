"""What may stand in a section of a file: declared once, for the reader that looks for it and for the reference.

A reader passes `names` on to whatever tells unknown entries; the pages of the documentation have the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

REQUIRED = "required"
"""The default of an entry that must be there."""


@dataclass(frozen=True, slots=True)
class Key:
    """One entry.

    Attributes:
        name: as it stands in the file.
        value: what is written there, with its unit.
        meaning: what that does.
        default: what is meant when it is left out: a value, or a remark in words; `REQUIRED` where it must be there.
    """

    name: str
    value: str
    meaning: str
    default: object = "none"


class Keys:
    """The entries of a section, in the order of the reference."""

    def __init__(self, *keys: Key) -> None:
        self._keys = keys

    def __iter__(self) -> Iterator[Key]:
        return iter(self._keys)

    @property
    def names(self) -> tuple[str, ...]:
        """What they are called."""
        return tuple(key.name for key in self)

    @property
    def required(self) -> tuple[str, ...]:
        """Those that must be there."""
        return tuple(key.name for key in self if key.default == REQUIRED)

    def table(self, prefix: str = "") -> str:
        """The entries as a table in Markdown.

        Args:
            prefix: what stands before each name, such as `arm.`.
        """
        rows = [f"| `{prefix}{key.name}` | {key.value} | {key.meaning} | {_text(key.default)} |" for key in self]
        return "\n".join(["| entry | value | meaning | default |", "|---|---|---|---|", *rows, ""])


def _text(default: object) -> str:
    """A default as a file would have it, or in words."""
    if isinstance(default, bool):
        return str(default).lower()
    return f"{default:g}" if isinstance(default, int | float) else str(default)
