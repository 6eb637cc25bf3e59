"""Roster of a class: the programs that patterns such as `students/*.py:Mine` select, with a short name for each."""

import glob
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.util.errors import UsageError

OPTION = "--agents"


@dataclass(frozen=True, slots=True)
class Student:
    """A program of a class.

    Attributes:
        name: short name, different for each.
        agent: the program, as `find_agent` takes it.
    """

    name: str
    agent: str

    @property
    def file_name(self) -> str:
        """The name with nothing in it that a file name cannot have."""
        return "".join(each if each.isalnum() or each in "-_." else "_" for each in self.name)


def find_students(patterns: Sequence[str]) -> list[Student]:
    """Return the programs that the patterns select, by the names of their files.

    A program is named after its file; programs whose files have one name, after folder and file.

    Raises:
        UsageError: a pattern has no class or no file, or two programs would have one name.

    Args:
        patterns: each is a pattern of files, a colon and the name of a class.
    """
    agents = list(dict.fromkeys(agent for pattern in patterns for agent in _agents(pattern)))
    files = [Path(agent.rpartition(":")[0]) for agent in agents]
    shared = Path(os.path.commonpath([os.path.abspath(file.parent) for file in files]))
    stems = Counter(file.stem for file in files)
    classes = Counter(files)
    found = []
    for agent, file in zip(agents, files, strict=True):
        below = Path(os.path.abspath(file)).relative_to(shared).with_suffix("")
        name = file.stem if stems[file.stem] == 1 else below.as_posix()
        found.append(Student(name if classes[file] == 1 else f"{name}:{agent.rpartition(':')[2]}", agent))
    names = Counter(student.file_name for student in found)
    if twice := [student.agent for student in found if names[student.file_name] > 1]:
        raise UsageError(f"{OPTION}: {twice[0]} and {twice[1]} would share a file of feedback; rename one")
    return found


def _agents(pattern: str) -> list[str]:
    files, colon, name = pattern.rpartition(":")
    if not colon or not name.isidentifier():
        raise UsageError(f"{OPTION} {pattern}: names no class; give files and a class, such as 'students/*.py:Mine'")
    found = sorted(file for file in glob.glob(files, recursive=True) if file.endswith(".py") and os.path.isfile(file))
    if not found:
        raise UsageError(
            f"{OPTION} {pattern}: there is no such Python file; quote the pattern, as 'students/*.py:Mine'"
        )
    return [f"{file}:{name}" for file in found]
