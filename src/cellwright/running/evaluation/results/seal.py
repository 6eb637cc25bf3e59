"""Seals of the lines in a results file: a line that was changed afterwards is noticed, and is not believed.

A seal is the HMAC-SHA256 of the line. Without a key, it finds accidents and edits. With a key in the environment, which
programs under evaluation do not inherit, a line cannot be written without the key. A line is sealed alone, and not with
those before it: a damaged line then costs no other, and merged files are those of one machine.
"""

import hmac
import os

from cellwright.util.errors import CellwrightError

KEY_VARIABLE = "CELLWRIGHT_RESULTS_KEY"
"""Variable with the key; the same on all machines of an evaluation."""

_DIGITS = 32
_BEFORE, _AFTER = b',"seal":"', b'"}'
_LENGTH = len(_BEFORE) + _DIGITS + len(_AFTER)


class SealError(CellwrightError):
    """A line has no seal, or was changed after it was sealed."""


def sealed(document: str) -> bytes:
    """Return a JSON object with its seal as its last entry."""
    text = document.encode()
    return text[:-1] + _BEFORE + _seal(text) + _AFTER


def unsealed(line: bytes) -> bytes:
    """Return the JSON object of a line of `sealed`, without its seal.

    Raises:
        SealError: the line was changed, or sealed with another key.
    """
    # The seal stands at a fixed place, so that a line need not be parsed before it is believed.
    text, end = line[:-_LENGTH] + b"}", line[-_LENGTH:]
    if not (end.startswith(_BEFORE) and end.endswith(_AFTER)):
        raise SealError("it has no seal: Cellwright has not written it so")
    if not hmac.compare_digest(end[len(_BEFORE) : -len(_AFTER)], _seal(text)):
        key = f", or sealed with another {KEY_VARIABLE}" if os.environ.get(KEY_VARIABLE) else ""
        raise SealError(f"it was changed after it was written{key}")
    return text


def _seal(text: bytes) -> bytes:
    key = os.environ.get(KEY_VARIABLE, "").encode()
    return hmac.digest(key, text, "sha256").hex()[:_DIGITS].encode()
