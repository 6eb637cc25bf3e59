"""What a terminal sends, as keys by name."""

from __future__ import annotations

_SEQUENCES = {
    "[A": "up",
    "[B": "down",
    "[C": "right",
    "[D": "left",
    "OA": "up",
    "OB": "down",
    "OC": "right",
    "OD": "left",
    "[H": "home",
    "[F": "end",
    "OH": "home",
    "OF": "end",
    "[1~": "home",
    "[4~": "end",
    "[5~": "pageup",
    "[6~": "pagedown",
}
_CONTROLS = {"\r": "enter", "\n": "enter", "\x7f": "backspace", "\x08": "backspace", "\t": "tab", "\x03": "ctrl-c"}
_ESCAPE = "\x1b"
_LONGEST = 16  # characters of a sequence; what is longer is none


class KeyDecoder:
    """Turns text from a terminal into keys: a printed character stands for itself, others have names.

    Sequences may come in pieces. Those that mean nothing here are passed over whole, so that none of their characters
    is taken for a key.
    """

    def __init__(self) -> None:
        self._rest = ""

    def feed(self, text: str) -> list[str]:
        """The keys in a piece of text. An empty piece says that nothing more comes now: an escape alone is a key."""
        if not text:
            keys = ["escape"] if self._rest == _ESCAPE else []
            self._rest = ""
            return keys
        keys, text = [], self._rest + text
        at = 0
        while at < len(text):
            sign = text[at]
            if sign != _ESCAPE:
                key = _CONTROLS.get(sign, sign if sign.isprintable() else "")
                keys += [key] if key else []
                at += 1
                continue
            end = _end(text, at + 1)
            if end is None:
                break
            name = _SEQUENCES.get(text[at + 1 : end], "")
            keys += [name] if name else []
            at = end
        self._rest = text[at:]
        return keys


def _end(text: str, at: int) -> int | None:
    """Where the sequence ends whose first character after the escape is at `at`; None if it has not all come."""
    if at >= len(text):
        return None
    if text[at] == "O":
        return at + 2 if at + 1 < len(text) else None
    if text[at] != "[":
        return at if text[at] == _ESCAPE else at + 1
    for end in range(at + 1, min(len(text), at + _LONGEST)):
        if "@" <= text[end] <= "~":
            return end + 1
    return at + _LONGEST if len(text) >= at + _LONGEST else None
