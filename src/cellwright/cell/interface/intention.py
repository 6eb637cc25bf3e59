"""What the agent says that it is about: for people who look on, and no part of the cell's state."""

from __future__ import annotations

from cellwright.util.errors import showable

TOPIC = "/cellwright/intention"

LONGEST = 200
"""Characters that are kept of it."""


class Intention:
    """The newest word of an agent about what it is doing."""

    def __init__(self) -> None:
        self.text = ""
        """What it said; empty when nothing was said in this run."""
        self.node = ""
        """Who said it."""
        self.time = 0
        """When [ns]."""

    def say(self, text: str, node: str, now: int) -> None:
        """Take note of a word; it is made fit for a line of text."""
        line = " ".join(showable(text[: 4 * LONGEST], 4 * LONGEST).split())
        self.text = line if len(line) <= LONGEST else line[: LONGEST - 1] + "…"
        self.node, self.time = node, now

    def forget(self) -> None:
        """Begin with nothing said."""
        self.text, self.node, self.time = "", "", 0
