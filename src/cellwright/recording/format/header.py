"""What a recording says of itself: of what it is, and what somebody needs to know who runs it again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cellwright.recording.format.format import FORMAT
from cellwright.util.errors import RecordingError, showable

_EXPORT = "export"
_LONGEST_NAME = 200  # characters


@dataclass(frozen=True)
class RecordingHeader:
    """What a recording is of.

    Attributes:
        kind: "cell" or "robot".
        name: of the trial or the robot.
        facts: JSON values: versions, seed, timestep and whatever else the run depends on.
    """

    kind: str
    name: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    def metadata(self) -> dict[str, str]:
        """As the values of a metadata record."""
        return {"format": FORMAT, "kind": self.kind, "name": self.name, "header": json.dumps(self.facts)}

    def of_export(self) -> dict[str, str]:
        """As the values of a metadata record in a file that was made of the recording for other tools."""
        return self.metadata() | {"format": _EXPORT}

    @staticmethod
    def of(values: Mapping[str, str]) -> RecordingHeader:
        """The header in a metadata record, which may come from anywhere.

        Raises:
            RecordingError: it is none, or of another format.
        """
        if values.get("format") == _EXPORT:
            raise RecordingError("it was made for other tools, and is no recording: give the one that it was made of")
        if values.get("format") != FORMAT:
            found = values.get("format", "none")
            raise RecordingError(f"it is a recording of format {found!r:.20}, and this version reads {FORMAT}")
        kind, name = values.get("kind", ""), values.get("name", "")
        try:
            facts = json.loads(values.get("header", ""))
        except (ValueError, RecursionError):
            facts = None
        if kind not in ("cell", "robot") or not isinstance(facts, dict):
            raise RecordingError("what it says of itself makes no sense")
        return RecordingHeader(kind, " ".join(showable(name, _LONGEST_NAME).split()), facts)
