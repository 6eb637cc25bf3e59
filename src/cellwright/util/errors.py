"""Every error that Cellwright raises on purpose.

One tree, so that a caller can catch `CellwrightError` and know that what is left is a defect. Input from outside
never reaches an `assert`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches


class CellwrightError(Exception):
    """Base of all errors that Cellwright raises on purpose."""


class UsageError(CellwrightError):
    """A call that cannot be carried out as it was made (wrong state, wrong argument)."""


class UnknownNameError(CellwrightError, KeyError):
    """A name that is not among the valid ones.

    Args:
        kind: what the name stands for, in the singular ("joint", "topic").
        name: the name that was given.
        valid: every name that would have been accepted.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.valid = tuple(valid)
        super().__init__(self.sentence())

    def sentence(self) -> str:
        """The error in one sentence, with a suggestion and the valid names."""
        known = ", ".join(self.valid) or "none"
        return f"unknown {self.kind} {self.name!r}{did_you_mean(self.name, self.valid)} (known: {known})"

    def __str__(self) -> str:
        return self.sentence()


class ExpressionError(CellwrightError, ValueError):
    """A text that should have been arithmetic with a finite value and is not."""


class DescriptionError(CellwrightError):
    """Files that describe no cell; `problems` lists everything that was found wrong.

    Args:
        problems: what is wrong, each of which reads `path:line: key: what is wrong` as text.
        warnings: what was found besides, in the same form.
    """

    def __init__(self, problems: Iterable[object], warnings: Iterable[object] = ()) -> None:
        self.problems = tuple(problems)
        self.warnings = tuple(warnings)
        super().__init__("\n".join(map(str, self.problems)))


class RecordingError(UsageError):
    """A recording of a run that cannot be read, or holds something else than it should."""


class RejectedCommandError(CellwrightError):
    """A command from outside that was refused as a whole; the cell goes on as if it had not come."""


class UnreachableError(CellwrightError):
    """A pose that the arm cannot bring its tool to, or a way that it cannot follow; the text says why."""


class SimulationError(CellwrightError):
    """The engine could not go on; nothing that it says from then on is worth anything."""


class RenderingError(CellwrightError):
    """No picture can be drawn; the text says why."""


class RunEndedError(BaseException):
    """The run is over: no more time will pass for a client.

    It is no fault of the program that it ends, and like SystemExit it stands outside of `Exception`: robot programs
    often catch every exception in their loop, and would never stop.
    """


class MessageError(RejectedCommandError):
    """Bytes or values that are not a message of the type that they should be."""


class ServiceFailedError(CellwrightError):
    """A service took a request and gave no answer: the call itself failed, as its contract says it may."""


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """The tail "; did you mean X" when one of the valid names is close, else an empty string."""
    names = list(valid)
    close = [each for each in names if _without_zeros(each) == _without_zeros(name)]  # final1: final01, not final15
    close = close or get_close_matches(name, names, n=1, cutoff=0.6)
    return f"; did you mean {close[0]}" if close else ""


def suggestion(name: str, valid: Iterable[str]) -> str:
    """The tail "; did you mean X" when one of the valid names is close, else " (known: …)" with all of them."""
    names = list(valid)
    return did_you_mean(name, names) or f" (known: {', '.join(names) or 'none'})"


def _without_zeros(name: str) -> str:
    """A name in lower case, without the zeros before its numbers."""
    return re.sub(r"(?<!\d)0+(?=\d)", "", name.lower())


def showable(text: str, most: int = 20_000) -> str:
    """A text that any terminal and any file can hold: line breaks and tabs stay, what cannot be shown is written out.

    Args:
        text: from somebody else's code, so it may hold anything.
        most: so many characters are kept of a longer one, half of them from its end.
    """
    if len(text) > most:
        text = f"{text[: most // 2]} … {text[-(most // 2) :]}"
    return "".join(sign if sign.isprintable() or sign in "\n\t" else repr(sign)[1:-1] for sign in text)


def in_a_line(error: BaseException, most: int = 1000) -> str:
    """Type and reason of an error that somebody else's code has raised: one line, showable, of about `most` signs."""
    try:
        text = str(error.msg or "") if isinstance(error, SyntaxError) else str(error)
    except Exception:  # its own way of saying itself fails
        text = "it does not say why"
    return f"{type(error).__name__}: {' '.join(showable(text, most).split())}".rstrip(": ")
