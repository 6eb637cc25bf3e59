"""Errors that Cellwright raises on purpose.

They form one tree: a caller can catch `CellwrightError`, and everything else is a defect. Input from outside never
reaches an `assert`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches


class CellwrightError(Exception):
    """Base of all errors that Cellwright raises on purpose."""


class InstallationError(CellwrightError, ImportError):
    """An installed package that Cellwright cannot run on; the text has the cure."""


class UsageError(CellwrightError):
    """A call that is not possible as made (wrong state, wrong argument)."""


class UnknownNameError(CellwrightError, KeyError):
    """A name that is not among the valid ones.

    Args:
        kind: kind of the named thing, in the singular ("joint", "topic").
        name: the unknown name.
        valid: all valid names.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.valid = tuple(map(str, valid))
        super().__init__(self.sentence())

    def sentence(self) -> str:
        """The error in one sentence, with a suggestion and the valid names."""
        known = ", ".join(self.valid) or "none"
        return f"unknown {self.kind} {self.name!r}{did_you_mean(self.name, self.valid)} (known: {known})"

    def __str__(self) -> str:
        return self.sentence()


class ExpressionError(CellwrightError, ValueError):
    """A text that should be arithmetic with a finite value and is not."""


class DescriptionError(CellwrightError):
    """Files that describe no cell; `problems` has everything that is wrong.

    Args:
        problems: each as text in the form `path:line: key: what is wrong`.
        warnings: further findings, in the same form.
    """

    def __init__(self, problems: Iterable[object], warnings: Iterable[object] = ()) -> None:
        self.problems = tuple(problems)
        self.warnings = tuple(warnings)
        super().__init__("\n".join(map(str, self.problems)))


class RecordingError(UsageError):
    """A recording of a run that cannot be read, or has unexpected contents."""


class ForeignRecordingError(RecordingError):
    """An MCAP file of another program, such as a bag of ROS 2."""


class RejectedCommandError(CellwrightError):
    """A command from outside that was refused as a whole; it has no effect on the cell."""


class UnreachableError(CellwrightError):
    """A pose that the arm cannot reach, or a path that it cannot follow; the text has the reason."""


class SimulationError(CellwrightError):
    """The engine could not go on; all its later values are worthless."""


class RenderingError(CellwrightError):
    """No picture can be drawn; the text has the reason."""


class RunEndedError(BaseException):
    """The run is over: no more time will pass for a client.

    The end is no fault of the program. Like SystemExit, this class is outside of `Exception`: robot programs often
    catch every exception in their loop, and would never stop.
    """


class MessageError(RejectedCommandError):
    """Bytes or values that are no message of the expected type."""


class ServiceFailedError(CellwrightError):
    """A service took a request and gave no answer: the call itself failed, as its interface allows."""


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """Return "; did you mean X" if a valid name is similar, else an empty string."""
    names = list(valid)
    close = [each for each in names if _without_zeros(each) == _without_zeros(name)]  # final1: final01, not final15
    close = close or get_close_matches(name, names, n=1, cutoff=0.6)
    return f"; did you mean {close[0]}" if close else ""


def suggestion(name: str, valid: Iterable[str]) -> str:
    """Return "; did you mean X" if a valid name is similar, else " (known: …)" with all of them."""
    names = list(valid)
    return did_you_mean(name, names) or f" (known: {', '.join(names) or 'none'})"


def _without_zeros(name: str) -> str:
    """Return a name in lower case, without the leading zeros of its numbers."""
    return re.sub(r"(?<!\d)0+(?=\d)", "", name.lower())


def printable(text: str, max_length: int = 20_000) -> str:
    """Make a text printable in any terminal and file: line breaks and tabs stay, unprintable characters are escaped.

    Args:
        text: any text, for example from a plugin.
        max_length: a longer text is cut to this many characters, half of them from its end.
    """
    if len(text) > max_length:
        text = f"{text[: max_length // 2]} … {text[-(max_length // 2) :]}"
    if text.isprintable():  # as nearly all are: a tenth of the time of a loop
        return text
    return "".join(sign if sign.isprintable() or sign in "\n\t" else repr(sign)[1:-1] for sign in text)


def one_printable_line(text: str) -> str:
    """Make a text printable in any terminal and file, in one line: all unprintable characters are escaped."""
    return text if text.isprintable() else "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


def one_line(error: BaseException, max_length: int = 1000) -> str:
    """Return type and reason of an error of foreign code: one printable line of about `max_length` characters."""
    try:
        text = str(error.msg or "") if isinstance(error, SyntaxError) else str(error)
    except Exception:  # its __str__ fails
        text = "no reason given"
    return f"{type(error).__name__}: {' '.join(printable(text, max_length).split())}".rstrip(": ")
