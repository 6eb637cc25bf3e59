"""Names of a trial's files: one file, or several that are joined, such as `final01+kitter_sensors`.

The texts of joined files are read as one, as by the launcher of 2017: a later section replaces an earlier one of the
same name.
"""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from cellwright.config.parsing.sources import read_texts
from cellwright.config.parsing.tree import Problems, Table
from cellwright.config.parsing.yaml_source import parse_mapping
from cellwright.config.trial.catalogue import find_trial
from cellwright.util.errors import CellwrightError, UsageError

JOIN = "+"
"""Sign between the names of files that are joined."""

TrialName: TypeAlias = "str | Path | Sequence[str | Path]"
"""A trial's name or file, several joined by `+`, or a list of them."""


def find_files(trial: TrialName, find: Callable[[str], Path] = find_trial) -> list[Path]:
    """Return the files of a trial, in the order in which they are joined.

    Example:
        >>> [file.name for file in find_files("final01+kitter_sensors")]
        ['final01.yaml', 'kitter_sensors.yaml']

    Args:
        trial: its name, or names that are joined.
        find: returns the file of a single name.

    Raises:
        UnknownNameError: there is no such file or name.
        UsageError: a name is empty.
    """
    if isinstance(trial, Path):
        return [find_trial(trial)]
    if isinstance(trial, str):
        return [find(name) for name in split_names(trial)]
    return [file for each in trial for file in find_files(each, find)]


def split_names(text: str) -> list[str]:
    """Return the names in a text; a sign `+` within the path of an existing file joins nothing.

    Raises:
        UsageError: a name is empty.
    """
    words, names = text.split(JOIN), []
    while words:
        ends = range(len(words), 1, -1)
        end = next((end for end in ends if os.path.exists(JOIN.join(words[:end]))), 1)
        names.append(JOIN.join(words[:end]))
        words = words[end:]
    if not all(names):
        raise UsageError(f"{text}: a name is missing beside {JOIN}; write such as final01{JOIN}kitter_sensors")
    return names


def joined_name(names: Sequence[str]) -> str:
    """Return the one name of files that are joined, as `find_files` reads it."""
    return JOIN.join(names)


def refuse_several_trials(names: Sequence[str], files: Sequence[Sequence[Path]]) -> None:
    """Refuse separate names of which two have orders: they may be meant as one trial or as two.

    Args:
        names: separate words of a command line.
        files: the files of each word.

    Raises:
        UsageError: two of them have orders.
    """
    with_orders = [name for name, each in zip(names, files, strict=True) if any(map(_has_orders, each))]
    if len(with_orders) > 1:
        one, other = with_orders[:2]
        raise UsageError(
            f"{one} and {other}: both have orders, and may be one trial or two; write {joined_name(names)} for one, or "
            "give one of them (cellwright eval runs several trials)"
        )


def _has_orders(file: Path) -> bool:
    """Return whether a file has orders; one that cannot be read has none, and its loader reports why."""
    try:
        root = parse_mapping(read_texts([file]), Problems(), "a configuration must be a mapping of sections")
    except CellwrightError:
        return False
    orders = root.get("orders")
    return isinstance(orders, Table) and bool(orders.entries)
