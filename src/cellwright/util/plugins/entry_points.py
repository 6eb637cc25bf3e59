"""What other packages bring along, by entry point: agents, trials, sensors and devices.

Nothing is imported before it is asked for by its name, so a package that is broken costs only who names it.
"""

from __future__ import annotations

import os
import sys
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Literal, TypeAlias, TypeVar

from cellwright.util.errors import CellwrightError, UnknownNameError, in_a_line

Kind: TypeAlias = Literal["agents", "trials", "sensors", "devices"]

T = TypeVar("T")


class PluginError(CellwrightError):
    """Something of another package that cannot be used."""


def names(kind: Kind) -> list[str]:
    """The names under which packages bring something of a kind along, sorted."""
    return sorted({each.name for each in _entry_points(kind)})


def package(kind: Kind, name: str) -> str:
    """The package that brings it along, as it is installed under.

    Raises:
        UnknownNameError: none does.
    """
    return _package(_found(kind, name))


def load(kind: Kind, name: str) -> object:
    """What a package brings along under a name.

    Raises:
        UnknownNameError: there is nothing of that name.
        PluginError: two packages have something of that name, or it cannot be imported.
    """
    entry = _found(kind, name)
    try:
        return entry.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise refusal(kind, name, f"cannot be imported: {in_a_line(error)}") from error


def load_as(kind: Kind, name: str, wanted: type[T]) -> T:
    """As `load`, of a class.

    Raises:
        UnknownNameError: there is nothing of that name.
        PluginError: as for `load`, or it is not of that class.
    """
    found = load(kind, name)
    if not isinstance(found, wanted):
        raise refusal(kind, name, f"must be a {wanted.__name__}, and is of the type {type(found).__name__}")
    return found


def refusal(kind: Kind, name: str, what: str) -> PluginError:
    """The error that says what is wrong with something, in one line, and whose it is."""
    source = _package(_found(kind, name))
    return PluginError(f"{kind.removesuffix('s')} {name!r} of the package {source} {' '.join(what.split())}")


def _found(kind: Kind, name: str) -> EntryPoint:
    # the same package may be found twice, by way of two folders that modules are looked for in
    found = {(each.value, _package(each)): each for each in _entry_points(kind) if each.name == name}
    if not found:
        raise UnknownNameError(kind.removesuffix("s"), name, names(kind))
    if len(found) > 1:
        packages = ", ".join(sorted(source for _, source in found))
        raise PluginError(f"{kind.removesuffix('s')} {name!r} comes with more than one package: {packages}")
    return next(iter(found.values()))


def _entry_points(kind: Kind) -> tuple[EntryPoint, ...]:
    return _in_folders(kind, tuple((folder, _changed(folder)) for folder in sys.path))


@lru_cache(maxsize=16)
def _in_folders(kind: Kind, _folders: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    # each look reads the entry points of all packages, and every trial that is read asks for them; the folders are
    # those in which packages are looked for, so that one that is installed meanwhile is found
    return tuple(entry_points(group=f"cellwright.{kind}"))


def _changed(folder: str) -> int:
    """When a folder got its newest package [ns]; 0 where there is no such folder."""
    try:
        return os.stat(folder or ".").st_mtime_ns
    except OSError:
        return 0


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module
