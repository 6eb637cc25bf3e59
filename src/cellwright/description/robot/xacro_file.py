"""Expands xacro files, the macro language that many robot descriptions are written in.

A xacro file is a program: its expressions are evaluated, and it may include other files. Use those that you trust.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from xml.parsers.expat import ExpatError

import xacro
import xacro.substitution_args

from cellwright.description.reading.problems import Place, Problem
from cellwright.description.reading.tree import shortened
from cellwright.description.robot.packages import package_folders
from cellwright.errors import DescriptionError

_DECLARATION = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_QUOTED = re.compile(r"'([^']+)'|\"([^\"]+)\"|(xacro:\w+)|'?(\w+)'?")
_LONGEST_MESSAGE = 300
_REPETITIONS = (  # xacro says what it was told, and by whom, twice
    (re.compile(r"<class '[^']*'>: (.*) \1"), r"\1"),
    (re.compile(r"(: \S+) \[Errno \d+\].*"), r"\1"),
)


def is_xacro(path: Path) -> bool:
    """Whether a file has to be expanded, which its name says: a file that is data is never run as a program."""
    return path.suffix.lower() == ".xacro"


def expand(path: Path, text: str) -> str:
    """The URDF that a file's text expands to; `$(find PACKAGE)` needs no ROS.

    Raises:
        DescriptionError: it does not expand.
    """
    if found := _DECLARATION.search(text):
        raise _refusal(path, _line(text, found.start()), "declares a document type or entities, which are not read")
    silence = io.StringIO()
    try:
        with contextlib.redirect_stderr(silence), contextlib.redirect_stdout(silence), _finding_packages(path):
            xacro.init_stacks(str(path))
            document = xacro.parse(text, str(path))
            xacro.process_doc(document)
            return str(document.toxml())
    except ExpatError as error:
        raise _refusal(_current(path), error.lineno, f"no valid XML (column {error.offset + 1})") from None
    except RecursionError:
        raise _refusal(_current(path), 0, "xacro: macros that call each other without end") from None
    except Exception as error:  # expressions are Python: anything may come out of them
        raise _failure(_current(path), error) from None


@contextlib.contextmanager
def _finding_packages(path: Path) -> Iterator[None]:
    """Have `$(find PACKAGE)` look where meshes are looked for, rather than in an installation of ROS 2."""

    def find(name: str) -> str:
        found = next((folder for folder in package_folders(name, path) if folder.is_dir()), None)
        if found is None:
            raise xacro.substitution_args.SubstitutionException(
                f"there is no package {name!r} above this file, nor in ROS_PACKAGE_PATH"
            )
        return str(found)

    module = xacro.substitution_args
    before = module._eval_find
    module._eval_find = module._eval_dict["find"] = find
    try:
        yield
    finally:
        module._eval_find = module._eval_dict["find"] = before


def _current(path: Path) -> Path:
    """The file that xacro was at when it failed: the one given, or one that it includes."""
    stack = [name for name in xacro.filestack or [] if name]
    return Path(stack[-1]) if stack else path


def _failure(path: Path, error: Exception) -> DescriptionError:
    message = " ".join(str(error).split()) or type(error).__name__
    for pattern, instead in _REPETITIONS:
        message = pattern.sub(instead, message)
    if isinstance(error, xacro.XacroException) and error.macros:
        names = ", ".join(macro.body.getAttribute("name") for macro in error.macros)
        message += f" (in the macro {names})"
    return _refusal(path, _line_of(path, message), f"xacro: {shortened(message, _LONGEST_MESSAGE)}")


def _line_of(path: Path, message: str) -> int:
    """The line that a message is about, as far as can be told: where what it quotes stands in the file; else 0."""
    try:
        text = path.read_text("utf-8", errors="replace")
    except (OSError, ValueError):
        return 0
    quoted = [next(filter(None, match.groups())) for match in _QUOTED.finditer(message)]
    for words in sorted(quoted, key=len, reverse=True):
        if len(words) > 2 and text.count(words) == 1:
            return _line(text, text.index(words))
    return 0


def _line(text: str, index: int) -> int:
    return text.count("\n", 0, index) + 1


def _refusal(path: Path, line: int, message: str) -> DescriptionError:
    return DescriptionError([Problem(Place(0, str(path), line), "", message)])
