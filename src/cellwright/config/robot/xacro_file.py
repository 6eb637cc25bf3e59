"""Expands xacro files, the macro language that many robot descriptions are written in.

A xacro file is a program: it reckons, includes other files, and may go on for ever. It is run in a process of its own,
see `xacro_program.py`.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import cellwright
from cellwright.config.parsing.problems import Place, Problem
from cellwright.config.parsing.sources import note_source
from cellwright.util.errors import DescriptionError

LONGEST = 30.0
"""Time that a file may take to expand [s]."""

_DECLARATION = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv.pop(1)); from cellwright.config.robot.xacro_program import main; main()"
)


def is_xacro(path: Path) -> bool:
    """Whether a file has to be expanded, which its name says: a file that is data is never run as a program."""
    return path.suffix.lower() == ".xacro"


def expand(path: Path, text: str) -> str:
    """The URDF that a file's text expands to; `$(find PACKAGE)` needs no ROS.

    Raises:
        DescriptionError: it does not expand, or not within bounds.
    """
    if found := _DECLARATION.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise _refusal(path, line, "declares a document type or entities, which are not read")
    place = str(Path(cellwright.__file__).parents[1])
    try:
        done = subprocess.run(  # noqa: S603 - our own interpreter and module
            [sys.executable, "-P", "-c", _PROGRAM, place, str(path)],
            input=text.encode("utf-8", "replace"),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=LONGEST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _refusal(path, 0, f"xacro: takes longer than {LONGEST:g} s to expand") from None
    try:
        said = json.loads(done.stdout)
    except ValueError:  # it was ended by the system, or by a library that does not take a lack of memory well
        raise _refusal(path, 0, f"xacro: its process ended before it was expanded (status {done.returncode})") from None
    if "text" in said:
        for each in said["files"]:
            note_source(Path(each))
        return str(said["text"])
    raise _refusal(Path(said["path"]), int(said["line"]), str(said["message"]))


def _refusal(path: Path, line: int, message: str) -> DescriptionError:
    return DescriptionError([Problem(Place(0, str(path), line), "", message)])
