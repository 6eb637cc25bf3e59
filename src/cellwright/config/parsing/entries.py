"""Texts on the entries of configuration files, for the tables of the documentation and for the JSON Schema."""

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

REQUIRED = "required"
"""Default of an entry that a file must have."""

_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_BEHIND = re.compile(r",? see (below|above)")


class EntryText(NamedTuple):
    """Texts on one entry, in Markdown: its kind of value, its meaning, and what holds without it."""

    value: str
    meaning: str
    default: str

    @property
    def description(self) -> str:
        """Value, meaning and default in a line without links, as an editor shows it."""
        unlinked = _BEHIND.sub("", _LINK.sub(r"\1", f"{self.meaning} ({self.value})")).replace("&#124;", "|")
        words = unlinked[0].upper() + unlinked[1:]
        if self.default in (REQUIRED, "see below"):
            return f"{words}." if self.default != REQUIRED else f"{words}; required."
        return f"{words}; default: {_LINK.sub(lambda found: found[1], self.default)}."


def tables() -> Mapping[str, Mapping[str, EntryText]]:
    """Return the texts of all tables, each by the full name of an entry, such as `arm.gains.<joint>.p`."""
    return _read()


def texts(table: str) -> Mapping[str, EntryText]:
    """Return the texts of one table by the last word of an entry's name; none for an unknown table.

    Example:
        >>> texts("options")["insert_agvs"].default
        'true'
    """
    return {name.rpartition(".")[2]: text for name, text in _read().get(table, {}).items()}


@cache
def _read() -> dict[str, dict[str, EntryText]]:
    import yaml  # slow to load, and only tables and schemas need these texts

    source = (files("cellwright.config.parsing") / "entries.yaml").read_text(encoding="utf-8")
    return {
        table: {name: EntryText(*text) for name, text in rows.items()} for table, rows in yaml.safe_load(source).items()
    }
