"""Python modules of messages and services, made by ROS's own generators."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from cellwright.middleware.ros1.packages.system import RosSystem, environment
from cellwright.util.errors import UsageError

_PATIENCE = 120.0  # [s] for one generator


def generate(ros: RosSystem, packages: Path, names: Sequence[str], modules: Path) -> None:
    """Write the module of each package: `from osrf_gear.msg import Order`.

    Args:
        ros: ROS 1.
        packages: the folder in which the packages lie.
        names: the packages.
        modules: the folder that is to be on the path of Python.

    Raises:
        UsageError: a generator failed; the error has what it said last.
    """
    search = [f"-I{name}:{packages / name / 'msg'}" for name in names]
    search += [f"-I{folder.parent.name}:{folder}" for folder in sorted(ros.share.glob("*/msg")) if folder.is_dir()]
    running = [
        (command, _started(command, ros))
        for name in names
        for command in _commands(ros, packages / name, modules / name, search)
    ]
    said = [(command, process, *process.communicate(timeout=_PATIENCE)) for command, process in running]
    for command, process, out, error in said:
        if process.returncode != 0:
            last = ((error or out).strip().splitlines() or ["without a word"])[-1]
            raise UsageError(f"{Path(command[1]).name} failed for {command[-1]}: {last}")
    for name in names:
        (modules / name / "__init__.py").touch()
        for namespace in ("msg", "srv"):
            if (modules / name / namespace).is_dir():
                _initialise(modules / name / namespace)


def _commands(ros: RosSystem, package: Path, modules: Path, search: Sequence[str]) -> Iterator[list[str]]:
    for namespace in ("msg", "srv"):
        definitions = sorted(map(str, (package / namespace).glob(f"*.{namespace}")))
        if definitions:
            out = modules / namespace
            out.mkdir(parents=True, exist_ok=True)
            program = str(ros.generators / f"gen{namespace}_py.py")
            yield [str(ros.python), program, *definitions, *search, "-p", package.name, "-o", str(out)]


def _started(command: Sequence[str], ros: RosSystem) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603
        command, env=environment(ros), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def _initialise(folder: Path) -> None:
    """Write the module that imports all others of its folder."""
    names = sorted(path.stem for path in folder.glob("_*.py") if path.stem != "__init__")
    lines = [f"from .{name} import *" for name in names]
    (folder / "__init__.py").write_text("\n".join([*lines, ""]), encoding="utf-8")
