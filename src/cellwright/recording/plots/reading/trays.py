"""What lay on the trays of a cell, as its panel showed it."""

from __future__ import annotations

from typing import Any

from cellwright.recording.format.format import PANEL
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.competition import tray_name
from cellwright.recording.plots.reading.reader import SECOND, json_of
from cellwright.recording.plots.tracks import TrayPart
from cellwright.util.errors import MessageError, showable

_LONGEST = 200  # characters of a name
_LATE = 1.5  # a part that was judged may have been reported last so long before [s]


class Trays:
    """Reads which part was on which tray, from when until when."""

    topics = (PANEL,)

    def __init__(self) -> None:
        self.names: list[str] = []
        self._since: dict[tuple[str, str], float] = {}
        self._faulty: set[str] = set()
        self._gone: list[tuple[str, str, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take what the panel shows next."""
        panel = json_of(message.data)
        try:
            trays = {tray_name(str(tray["number"])): _parts(tray) for tray in panel.get("trays", ())}
        except (KeyError, TypeError, AttributeError) as error:
            raise MessageError(f"a panel that lacks something: {error}") from None
        now = message.time / SECOND
        self.names += [name for name in trays if name not in self.names]
        there = {(tray, part) for tray, parts in trays.items() for part in parts}
        self._faulty |= {part for parts in trays.values() for part, is_faulty in parts.items() if is_faulty}
        for each in [each for each in self._since if each not in there]:
            self._gone.append((*each, self._since.pop(each), now))
        for each in sorted(there - self._since.keys()):
            self._since[each] = now

    def parts(self, end: float, verdicts: list[tuple[float, str, dict[str, str]]]) -> list[TrayPart]:
        """All parts that lay on trays.

        Args:
            end: of the recording [s].
            verdicts: when which tray was judged, and what was said of each part.
        """
        spans = [*self._gone, *((*each, since, end) for each, since in self._since.items())]
        found = []
        for tray, name, begin, over in sorted(spans, key=lambda span: (span[2], span[1])):
            said = "faulty" if name in self._faulty else ""
            for when, where, words in verdicts:
                if where == tray and begin <= when <= over + _LATE:
                    said = words.get(name, said)
            found.append(TrayPart(tray, _plain(name), begin, over, said))
        return found


def _parts(tray: dict[str, Any]) -> dict[str, bool]:
    """The parts on a tray by name, and whether they are known to be faulty."""
    return {str(part["name"]): bool(part.get("faulty")) for part in tray["parts"]}


def _plain(name: str) -> str:
    """A part's name as one says it: `bin7|piston_rod_part_9` is piston rod 9 of bin 7."""
    place, _, rest = showable(name, _LONGEST).rpartition("|")
    words = rest.replace("_part", "").replace("_clone", "").replace("_", " ")
    return f"{words} ({'belt' if 'conveyor' in place else place})" if place else words
