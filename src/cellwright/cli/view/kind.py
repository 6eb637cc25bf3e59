"""What somebody wants to see: told by its name, its address, or what is in its file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from enum import Enum
from pathlib import Path

from cellwright.cli.options import refuse
from cellwright.config.robot.robots import bundled, find_robot, is_robot_file
from cellwright.util.errors import CellwrightError

_ADDRESS = re.compile(r"[^/\\]+:[0-9]{1,5}")
_RECORDINGS = (".mcap", ".bag")


class Kind(Enum):
    """Kinds of what can be seen."""

    TRIAL = "a trial"
    ROBOT = "a robot"
    RECORDING = "a recording"
    ADDRESS = "something that is served"


def kind_of(words: Sequence[str]) -> Kind:
    """What these words of a command line stand for; what is none of the others is taken for a trial.

    Raises:
        UsageError: several things at once, which only the files of a trial can be.
    """
    kinds = [_kind(word) for word in words]
    if len(words) > 1 and set(kinds) != {Kind.TRIAL}:
        other = next(word for word, kind in zip(words, kinds, strict=True) if kind is not Kind.TRIAL)
        refuse(f"{other}: one thing at a time is shown; only the files of a trial are joined")
    return kinds[0]


def _kind(word: str) -> Kind:
    path = Path(word)
    if path.suffix.lower() in _RECORDINGS:
        return Kind.RECORDING
    if _ADDRESS.fullmatch(word) and not path.exists():
        return Kind.ADDRESS
    if word in bundled():
        return Kind.ROBOT
    with suppress(CellwrightError, OSError, ValueError):  # what it lacks is told when it is loaded
        if path.is_dir() or is_robot_file(find_robot(word)):
            return Kind.ROBOT
    return Kind.TRIAL
