"""Python modules of messages and services, made by ROS's own generators."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from cellwright.errors import UsageError
from cellwright.ros1.tools import Ros1Tools, environment

_PATIENCE = 120.0  # [s] for one generator


def generate(tools: Ros1Tools, packages: Path, names: Sequence[str], modules: Path) -> None:
    """Write the module of each package: `from osrf_gear.msg import Order`.

    Args:
        tools: ROS 1.
        packages: the folder in which the packages lie.
        names: the packages.
        modules: the folder that is to be on the path of Python.

    Raises:
        UsageError: a generator failed; the error has what it said last.
    """
    search = [f"-I{name}:{packages / name / 'msg'}" for name in names]
    search += [f"-I{folder.parent.name}:{folder}" for folder in sorted(tools.share.glob("*/msg")) if folder.is_dir()]
    running = [
        (command, _started(command, tools))
        for name in names
        for command in _commands(tools, packages / name, modules / name, search)
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


def _commands(tools: Ros1Tools, package: Path, modules: Path, search: Sequence[str]) -> Iterator[list[str]]:
    for namespace in ("msg", "srv"):
        definitions = sorted(map(str, (package / namespace).glob(f"*.{namespace}")))
        if definitions:
            out = modules / namespace
            out.mkdir(parents=True, exist_ok=True)
            program = str(tools.generators / f"gen{namespace}_py.py")
            yield [str(tools.python), program, *definitions, *search, "-p", package.name, "-o", str(out)]


def _started(command: Sequence[str], tools: Ros1Tools) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603
        command, env=environment(tools), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def _initialise(folder: Path) -> None:
    """Write the module that imports all others of its folder."""
    names = sorted(path.stem for path in folder.glob("_*.py") if path.stem != "__init__")
    lines = [f"from .{name} import *" for name in names]
    (folder / "__init__.py").write_text("\n".join([*lines, ""]), encoding="utf-8")
