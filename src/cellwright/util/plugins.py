"""Plugins of other packages by entry point, with guarded calls, and classes by their file or module.

A package is imported only when its name is requested, so a broken package affects only its users.
"""

import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypeVar

from cellwright.util.errors import CellwrightError, RunEndedError, SimulationError, UnknownNameError, one_line

Kind: TypeAlias = Literal["agents", "trials", "sensors", "devices"]

T = TypeVar("T")


class PluginError(CellwrightError):
    """A plugin of another package that cannot be used."""


def names(kind: Kind) -> list[str]:
    """Return the names of all plugins of a kind, sorted."""
    return sorted({each.name for each in _entry_points(kind)})


def package(kind: Kind, name: str) -> str:
    """Return the installed name of the package that provides a plugin.

    Raises:
        UnknownNameError: no package provides it.
    """
    return _package(_find(kind, name))


def load(kind: Kind, name: str) -> object:
    """Return the object of a plugin's entry point.

    Raises:
        UnknownNameError: no plugin has this name.
        PluginError: two packages have a plugin of this name, or it cannot be imported.
    """
    entry = _find(kind, name)
    try:
        return entry.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise plugin_error(kind, name, f"cannot be imported: {one_line(error)}") from error


def load_as(kind: Kind, name: str, expected: type[T]) -> T:
    """Load a plugin that must be an instance of `expected`; see `load`.

    Raises:
        UnknownNameError: no plugin has this name.
        PluginError: as for `load`, or it is not of that class.
    """
    found = load(kind, name)
    if not isinstance(found, expected):
        raise plugin_error(kind, name, f"must be a {expected.__name__} (got {type(found).__name__})")
    return found


def plugin_error(kind: Kind, name: str, problem: str) -> PluginError:
    """Return the error for a problem with a plugin, in one line that names its package.

    Args:
        kind: kind of the plugin.
        name: name of the plugin.
        problem: end of the line, such as "cannot be imported: …".
    """
    source = _package(_find(kind, name))
    return PluginError(f"{kind.removesuffix('s')} {name!r} of the package {source} {' '.join(problem.split())}")


def _find(kind: Kind, name: str) -> EntryPoint:
    # the same package may be found twice, through two folders of modules
    found = {(each.value, _package(each)): each for each in _entry_points(kind) if each.name == name}
    if not found:
        raise UnknownNameError(kind.removesuffix("s"), name, names(kind))
    if len(found) > 1:
        packages = ", ".join(sorted(source for _, source in found))
        raise PluginError(
            f"{kind.removesuffix('s')} {name!r} is in more than one package: {packages}; uninstall all but one"
        )
    return next(iter(found.values()))


def _entry_points(kind: Kind) -> tuple[EntryPoint, ...]:
    return _in_folders(kind, tuple((folder, _modified_at(folder)) for folder in sys.path))


@lru_cache(maxsize=16)
def _in_folders(kind: Kind, _folders: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    # Each call reads the entry points of all packages, and every trial needs them, so they are cached. The folders are
    # those in which packages are found, so that a package installed later is found too.
    return tuple(entry_points(group=f"cellwright.{kind}"))


def _modified_at(folder: str) -> int:
    """Return the time of a folder's latest change [ns]; 0 if there is no such folder."""
    try:
        return os.stat(folder or ".").st_mtime_ns
    except OSError:
        return 0


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module


class PluginFailedError(SimulationError):
    """A plugin failed at run time: the rest of the run is worthless."""


def guard_plugin(thing: T, kind: Kind, name: str, methods: Iterable[str]) -> T:
    """Wrap methods of a plugin's object so that their errors become PluginFailedError.

    Args:
        thing: the object; its methods are replaced in place.
        kind: kind of the plugin.
        name: name of the plugin.
        methods: names of the methods.

    Returns:
        The same object.
    """
    for method in methods:
        setattr(thing, method, partial(call_plugin, kind, name, getattr(thing, method)))
    return thing


def call_plugin(kind: Kind, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of another package.

    Raises:
        PluginFailedError: it has raised an error.
    """
    try:
        return function(*arguments)
    except (SimulationError, RunEndedError, KeyboardInterrupt):  # from the engine, or another plugin that it called
        raise
    except BaseException as error:  # a SystemExit would look like one of the agent, which may end that way
        problem = f"failed in {getattr(function, '__name__', 'it')}: {one_line(error)}"
        raise PluginFailedError(str(plugin_error(kind, name, problem))) from error


def is_installed(module: str) -> bool:
    """Return whether a module of another package is there to import; a mere folder of its name is none."""
    found = importlib.util.find_spec(module)
    return found is not None and found.origin is not None


def is_class_path(name: str) -> bool:
    """Return True if a name has the form of a class path, such as `path.py:Class`."""
    place, _, class_name = name.rpartition(":")
    return bool(place and class_name)


def find_class(name: str, *, method: str, error: type[CellwrightError]) -> Any:
    """Return the object at a class path, such as `path.py:Class`.

    Args:
        name: the class path.
        method: name of a method that suitable classes have; the error lists these.
        error: class of the errors.

    Raises:
        CellwrightError: there is no such file, module or class, or its import fails; of the class `error`.
    """
    place, _, class_name = name.rpartition(":")
    module = _import_file(Path(place), error) if place.endswith(".py") else _import_module(place, error)
    try:
        return getattr(module, class_name)
    except AttributeError:
        classes = [key for key, value in vars(module).items() if isinstance(value, type) and hasattr(value, method)]
        raise error(f"{place}: {UnknownNameError('class', class_name, classes).sentence()}") from None


def make_factory(name: str, found: Callable[..., T], error: type[CellwrightError]) -> Callable[..., T]:
    """Return a factory for objects of a foreign class.

    Args:
        name: name of the class in errors.
        found: the class, or a function that makes the object.
        error: class of the error that replaces any error of `found`.
    """

    def make(*arguments: Any) -> T:
        try:
            return found(*arguments)
        except KeyboardInterrupt:
            raise
        except BaseException as cause:
            raise error(f"{name}: cannot be made: {one_line(cause)}") from cause

    return make


def _import_module(name: str, error: type[CellwrightError]) -> object:
    folder = str(Path.cwd())
    if folder not in sys.path:
        # An installed command does not search the current folder.
        sys.path.insert(0, folder)
    try:
        return importlib.import_module(name)
    except KeyboardInterrupt:
        raise
    except BaseException as cause:
        raise error(f"{name}: cannot be imported: {one_line(cause)}") from cause


def _import_file(path: Path, error: type[CellwrightError]) -> object:
    # False also for a name that no file can have.
    if not os.path.isfile(path):
        raise error(f"{path}: there is no such file")
    name = f"cellwright_own_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise error(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses and pickling look modules up by name.
    sys.modules[name] = module
    # The file may import its neighbours.
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as cause:
        raise error(f"{path}{_line(path, cause)}: cannot be imported: {one_line(cause)}") from cause
    return module


def _line(path: Path, error: BaseException) -> str:
    """Return `:` and the line of the file that led to the error; empty if unknown."""
    frames = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError):
        frames.append((error.filename or "", error.lineno))
    lines = [line for name, line in frames if Path(name).resolve() == path.resolve()]
    return f":{lines[-1]}" if lines else ""
