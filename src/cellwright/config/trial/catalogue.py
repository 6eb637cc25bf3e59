"""Catalogue of bundled trials and tasks, and of bundled files with an arm and sensors for trials that have none."""

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from cellwright.util import plugins as plugins
from cellwright.util.errors import UnknownNameError, one_line

_SUFFIX = ".yaml"
_SENSORS = "_sensors"
_FOLDER = Path(str(files("cellwright.config.trial"))) / "catalogue"
_TASKS = _FOLDER / "tasks"

LESSON = "lesson"
SAMPLE = "sample"
QUALIFIER = "qualifier"
BASELINE = "final, baseline"
DROPPED_PART = "final, dropped part"
KIT_CHANGE = "final, in-process kit change"
TASK = "task"

SCENARIOS = (LESSON, SAMPLE, QUALIFIER, BASELINE, DROPPED_PART, KIT_CHANGE)
"""Subjects of the bundled trials, the easier first; the finals had three scenarios of five trials each."""


def bundled() -> list[str]:
    """Return the names of the bundled trials, by scenario."""
    names = (name for name in _names() if not name.endswith(_SENSORS))
    return sorted(names, key=lambda name: (SCENARIOS.index(scenario(name)), name))


def bundled_sensors() -> list[str]:
    """Return the names of the bundled files with an arm and sensors, for use with a trial that has none."""
    return sorted(name for name in _names() if name.endswith(_SENSORS))


def bundled_tasks() -> list[str]:
    """Return the names of the bundled tasks: trials of small cells with a section `task`."""
    return sorted(path.stem for path in _TASKS.glob(f"*{_SUFFIX}"))


def all_bundled() -> list[str]:
    """Return all bundled names: trials, tasks, and files with an arm and sensors."""
    return [*bundled(), *bundled_tasks(), *bundled_sensors()]


def scenario(name: str) -> str:
    """Return the subject of a bundled trial or task, by its name: one of `SCENARIOS`, or `TASK`."""
    if name in bundled_tasks():
        return TASK
    if name == LESSON:
        return LESSON
    if name.startswith("qual"):
        return QUALIFIER
    if final := re.fullmatch(r"final(\d+)", name):
        return (BASELINE, DROPPED_PART, KIT_CHANGE)[(int(final[1]) - 1) // 5]
    return SAMPLE


def find_trial(name_or_path: str | Path) -> Path:
    """Return a trial's file: an existing path, else the trial, task or sensor file of that name.

    Bundled trials take precedence over those of plugins.

    Raises:
        UnknownNameError: no such file or name.
        PluginError: the trial is a plugin's, and it cannot be used.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    name = str(name_or_path)
    known = all_bundled()
    if name in known:
        return (_TASKS if name in bundled_tasks() else _FOLDER) / f"{name}{_SUFFIX}"
    from_plugins = plugins.names("trials")
    if name in from_plugins:
        return _plugin_trial(name)
    raise UnknownNameError("trial", name, [*known, *from_plugins])


def _plugin_trial(name: str) -> Path:
    """Return the file of a plugin's trial, which is a path or a function that returns one."""
    found = plugins.load("trials", name)
    try:
        path = found() if callable(found) else found
    except Exception as error:
        raise plugins.plugin_error("trials", name, f"failed: {one_line(error)}") from error
    if not isinstance(path, str | Path):
        raise plugins.plugin_error("trials", name, f"must be the path of a file (got {type(path).__name__})")
    if not Path(path).is_file():
        raise plugins.plugin_error("trials", name, f"there is no file {path}")
    return Path(path)


def _names() -> Iterator[str]:
    return (path.stem for path in _FOLDER.glob(f"*{_SUFFIX}"))
