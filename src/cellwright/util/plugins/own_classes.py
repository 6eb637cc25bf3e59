"""Classes of somebody's own, by the place where they stand: `path/to/file.py:Class`, or `package.module:Class`."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from pathlib import Path
from typing import Any

from cellwright.util.errors import CellwrightError, UnknownNameError, in_a_line


def is_place(name: str) -> bool:
    """Whether a name says where a class stands."""
    place, _, class_name = name.rpartition(":")
    return bool(place and class_name)


def find(name: str, *, method: str, error: type[CellwrightError]) -> Any:
    """What stands at a place.

    Args:
        name: the place, of which `is_place` is true.
        method: what a class that is meant has, for a suggestion where there is no such class.
        error: the class of error to raise.

    Raises:
        CellwrightError: there is no such file, module or class, or it fails when it is imported; of the class `error`.
    """
    place, _, class_name = name.rpartition(":")
    module = _import_file(Path(place), error) if place.endswith(".py") else _import_module(place, error)
    try:
        return getattr(module, class_name)
    except AttributeError:
        classes = [key for key, value in vars(module).items() if isinstance(value, type) and hasattr(value, method)]
        raise error(f"{place}: {UnknownNameError('class', class_name, classes).sentence()}") from None


def _import_module(name: str, error: type[CellwrightError]) -> object:
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)  # an installed command does not look into the folder that it is called in
    try:
        return importlib.import_module(name)
    except KeyboardInterrupt:
        raise
    except BaseException as cause:
        raise error(f"{name}: cannot be imported: {in_a_line(cause)}") from cause


def _import_file(path: Path, error: type[CellwrightError]) -> object:
    if not path.is_file():
        raise error(f"{path}: there is no such file")
    name = f"cellwright_own_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise error(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickling look modules up by name
    sys.path.insert(0, str(path.parent.resolve()))  # so that it can import its neighbours
    try:
        spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as cause:
        raise error(f"{path}{_line(path, cause)}: cannot be imported: {in_a_line(cause)}") from cause
    return module


def _line(path: Path, error: BaseException) -> str:
    """`:` and the line of the file that led to the error; nothing when it is not known."""
    frames = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError):
        frames.append((error.filename or "", error.lineno))
    lines = [line for name, line in frames if Path(name).resolve() == path.resolve()]
    return f":{lines[-1]}" if lines else ""
