"""Expands xacro files, the macro language that many robot descriptions are written in."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from xml.parsers.expat import ExpatError

import xacro

from cellwright.description.problems import Place, Problem
from cellwright.errors import DescriptionError

_MACROS = re.compile(r"<xacro:|=\s*[\"'][^\"'<>]*\$[({]")
_DECLARATION = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


def is_xacro(path: Path, text: str) -> bool:
    """Whether a file has to be expanded: by its name, or because macros or substitutions are used in it."""
    return path.suffix.lower() == ".xacro" or _MACROS.search(text) is not None


def expand(path: Path, text: str) -> str:
    """The URDF that a file's text expands to.

    Raises:
        DescriptionError: it does not expand, or the package `xacro` is not installed.
    """
    if found := _DECLARATION.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise _refusal(path, line, "declares a document type or entities, which are not read")
    try:
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            xacro.init_stacks(str(path))
            document = xacro.parse(text, str(path))
            xacro.process_doc(document)
            return str(document.toxml())
    except ExpatError as error:
        raise _refusal(path, error.lineno, f"no valid XML (column {error.offset + 1})") from None
    except RecursionError:
        raise _refusal(path, 0, "xacro: macros that call each other without end") from None
    except Exception as error:  # xacro evaluates Python: anything may come out of it
        message = " ".join(str(error).split()) or type(error).__name__
        raise _refusal(path, 0, f"xacro: {message}") from None


def _refusal(path: Path, line: int, message: str) -> DescriptionError:
    return DescriptionError([Problem(Place(0, str(path), line), "", message)])
