"""The process that expands a xacro file: its text on stdin, what came of it as JSON on stdout.

A xacro file is a program. It runs apart, with bounds of memory and time, so that one that does not end or grows without
limit takes nothing along.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import sys
from pathlib import Path
from typing import TextIO
from xml.parsers.expat import ExpatError

import xacro
import xacro.substitution_args

from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.packages import package_folders
from cellwright.config.robot.xacro_expressions import keep_to_reckoning

MOST_MEMORY = 1 << 30
"""Memory that a file may take to expand [bytes]; held on Linux only."""
MOST_TEXT = 16 << 20
"""Longest text that a file may expand to, in characters."""

_QUOTED = re.compile(r"'([^']+)'|\"([^\"]+)\"|(xacro:\w+)|'?(\w+)'?")
_LONGEST_MESSAGE = 300
_REPETITIONS = (  # xacro says what it was told, and by whom, twice
    (re.compile(r"<class '[^']*'>: (.*) \1"), r"\1"),
    (re.compile(r"(: \S+) \[Errno \d+\].*"), r"\1"),
)


class _RefusedError(Exception):
    """A file that does not expand: which, on what line (0: unknown), and why."""

    def __init__(self, path: Path, line: int, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.line = line


def main() -> None:
    """Expand the text on stdin of the file that is named by the first argument."""
    if sys.platform == "linux":
        import resource  # there is none on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answer, path = sys.stdout, Path(sys.argv[1])
    text = sys.stdin.buffer.read().decode("utf-8", "replace")
    try:
        expanded = _expanded(path, text)
        _tell(answer, text=expanded, files=[str(each) for each in xacro.all_includes])
    except _RefusedError as error:
        _tell(answer, path=str(error.path), line=error.line, message=str(error))


def _tell(answer: TextIO, **said: str | int | list[str]) -> None:
    answer.write(json.dumps(said))
    answer.flush()


def _expanded(path: Path, text: str) -> str:
    silence = io.StringIO()
    try:
        with contextlib.redirect_stderr(silence), contextlib.redirect_stdout(silence):
            keep_to_reckoning()
            _find_packages_beside(path)
            xacro.init_stacks(str(path))
            document = xacro.parse(text, str(path))
            xacro.process_doc(document)
            expanded = str(document.toxml())
    except ExpatError as error:
        raise _RefusedError(_current(path), error.lineno, f"no valid XML (column {error.offset + 1})") from None
    except RecursionError:
        raise _RefusedError(_current(path), 0, "xacro: macros that call each other without end") from None
    except Exception as error:  # expressions are Python: anything may come out of them
        raise _failure(_current(path), error) from None
    if len(expanded) > MOST_TEXT:
        raise _RefusedError(path, 0, f"xacro: expands to more than {MOST_TEXT >> 20} MiB")
    return expanded


def _find_packages_beside(path: Path) -> None:
    """Have `$(find PACKAGE)` look where meshes are looked for, rather than in an installation of ROS 2."""

    def find(name: str) -> str:
        found = next((folder for folder in package_folders(name, path) if folder.is_dir()), None)
        if found is None:
            raise xacro.substitution_args.SubstitutionException(
                f"there is no package {name!r} above this file, nor in ROS_PACKAGE_PATH"
            )
        return str(found)

    module = xacro.substitution_args
    module._eval_find = module._eval_dict["find"] = find


def _current(path: Path) -> Path:
    """The file that xacro was at when it failed: the one given, or one that it includes."""
    stack = [name for name in xacro.filestack or [] if name]
    return Path(stack[-1]) if stack else path


def _failure(path: Path, error: Exception) -> _RefusedError:
    if isinstance(error, MemoryError) or isinstance(getattr(error, "exc", None), MemoryError):
        return _RefusedError(path, 0, f"xacro: needs more than {MOST_MEMORY >> 20} MiB of memory to expand")
    message = " ".join(str(error).split()) or type(error).__name__
    for pattern, instead in _REPETITIONS:
        message = pattern.sub(instead, message)
    if isinstance(error, xacro.XacroException) and error.macros:
        names = ", ".join(macro.body.getAttribute("name") for macro in error.macros)
        message += f" (in the macro {names})"
    return _RefusedError(path, _line_of(path, message), f"xacro: {shortened(message, _LONGEST_MESSAGE)}")


def _line_of(path: Path, message: str) -> int:
    """The line that a message is about, as far as can be told: where what it quotes stands in the file; else 0."""
    try:
        with path.open("rb") as stream:
            text = stream.read(MOST_TEXT).decode("utf-8", "replace")
    except (OSError, ValueError):
        return 0
    quoted = [next(filter(None, match.groups())) for match in _QUOTED.finditer(message)]
    for words in sorted(quoted, key=len, reverse=True):
        if len(words) > 2 and text.count(words) == 1:
            return text.count("\n", 0, text.index(words)) + 1
    return 0
