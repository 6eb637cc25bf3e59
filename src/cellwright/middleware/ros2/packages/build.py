"""Wheels of the interface packages: built with the generators of ROS 2, for an environment that has ROS 2 from wheels.

The packages are those that colcon builds in a workspace. Here only what Python needs is generated and compiled: no C++
interfaces and headers, and one type support, since the wheels have one middleware.

There are two wheels: packages whose definitions depend on the distribution have one of their own.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sysconfig
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from graphlib import TopologicalSorter
from pathlib import Path
from typing import TypeAlias

from cellwright.middleware.ros2.packages import compiling
from cellwright.middleware.ros2.packages.contents import definitions, dependencies, interface_files, varying_packages
from cellwright.middleware.ros2.packages.programs import clean_environment, run
from cellwright.middleware.ros2.packages.progress import Progress
from cellwright.middleware.ros2.packages.wheel import MODULES, pack, tag
from cellwright.util.errors import UsageError
from cellwright.util.files import replacement_path, user_folder

COMMON, VARYING = "cellwright_ros2_interfaces", "cellwright_ros2_varying"
"""Names of the wheels, and of the libraries in them: packages that all distributions have alike, and the others."""

REQUIREMENTS = Path(__file__).parent / "requirements"
"""Folder of lists of pinned packages, one for each distribution."""

Texts: TypeAlias = Mapping[str, Mapping[str, str]]
"""Definitions by package and path."""

_GENERATE = Path(__file__).with_name("generate.py")
_DONE = "done: "  # begin of its lines that name a package
_JOBS = 2  # compilers at once

_GENERATE_EACH = 0.1
_COMPILE_EACH = {"type_support.cpp": 0.14, "types.c": 0.07, "introspection.c": 0.03, "descriptions.c": 0.02}
_MODULE = 0.3
"""Time per interface and per package [s], on an idle machine with a core of 2024."""


class MissingToolsError(UsageError):
    """Programs that build the interfaces are missing."""


def requirements(name: str) -> str:
    """Return the pinned packages of a list ("jazzy"), a line each."""
    return (REQUIREMENTS / f"{name}.txt").read_text(encoding="utf-8")


def packages_of(name: str, distribution: str) -> Texts:
    """Return the definitions in a wheel, by package and path."""
    varying = varying_packages()
    return {
        package: texts
        for package, texts in definitions(distribution).items()
        if (package in varying) == (name == VARYING)
    }


def wheel_path(name: str, distribution: str, texts: Texts, variables: Mapping[str, str] = os.environ) -> Path:
    """Return the path in the cache of a wheel for a distribution and this Python; the file need not exist.

    Its name has a digest of all that the wheel is made from, so a wheel is never outdated.

    Args:
        name: `COMMON` or `VARYING`.
        distribution: "jazzy" or "kilted".
        texts: definitions in it, from `packages_of`.
        variables: the environment, for the folder of the cache.
    """
    digest = hashlib.sha256()
    for package, each in texts.items():
        for path, content in sorted(interface_files(package, each).items()):
            digest.update(f"{package}/{path} {len(content)}\0".encode() + content)
    digest.update(requirements(distribution).encode())
    for program in (_GENERATE, Path(compiling.__file__), Path(__file__)):
        digest.update(program.read_bytes())
    digest.update(tag().encode())
    version = f"1+{distribution}.{digest.hexdigest()[:12]}"
    return user_folder("XDG_CACHE_HOME", ".cache", variables) / "ros2" / f"{name}-{version}-{tag()}.whl"


def missing_tools() -> list[str]:
    """Return the tools for building that this machine lacks: a compiler, and the headers of Python."""
    absent = [name for name in (_compiler(),) if shutil.which(name) is None]
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    return absent if header.is_file() else [*absent, str(header)]


def _compiler() -> str:
    return os.environ.get("CXX", "g++")


def expected_steps(texts: Texts, wheel: Path) -> dict[str, float]:
    """Return the steps of building a wheel, with the time of each on an idle machine [s]."""
    steps = {f"generate {package}": _MODULE + _GENERATE_EACH * len(each) for package, each in texts.items()}
    count = sum(map(len, texts.values()))
    library = _library(wheel)
    steps |= {f"compile {unit} of {library}": each * count for unit, each in _COMPILE_EACH.items()}
    return steps | {f"compile {package}": _MODULE for package in texts}


def build_wheel(texts: Texts, environment: Path, wheel: Path, progress: Progress) -> None:
    """Build interfaces, and write the wheel; the file appears completely or not at all.

    Args:
        texts: definitions by package and path, which use no other packages of ours.
        environment: folder of a virtual environment with the wheels of ROS 2.
        wheel: path of the wheel, from `wheel_path`.
        progress: has `expected_steps` in its plan.

    Raises:
        MissingToolsError: tools are missing.
        UsageError: a program failed; the error ends with its last lines.
        OSError: a file cannot be written.
    """
    if absent := missing_tools():
        raise MissingToolsError(f"building the interfaces requires {', '.join(absent)}; install what is missing")
    started = time.monotonic()
    packages = _in_order(texts)
    progress.say(f"interfaces: building {', '.join(packages)}")
    wheel.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="cellwright-ros2-") as name:
        work, prefix = Path(name), Path(name) / "prefix"
        _generate(packages, work, environment, progress)
        progress.say(f"interfaces: sources generated in {time.monotonic() - started:.0f} s, compiling them")
        _lay_out(packages, work / "gen", prefix)
        _compile(packages, work, prefix / "lib" / f"lib{_library(wheel)}.so", environment, progress)
        with replacement_path(wheel) as unfinished:
            pack(prefix, unfinished, wheel.name)
    took, size = time.monotonic() - started, wheel.stat().st_size / 1e6
    progress.say(f"interfaces: built in {took:.0f} s, {size:.1f} MB: {wheel}")


def _library(wheel: Path) -> str:
    return wheel.name.partition("-")[0]


def _in_order(texts: Texts) -> dict[str, Mapping[str, str]]:
    """Return the packages, each after those that it uses."""
    uses = {name: {*dependencies(name, each)} & {*texts} for name, each in texts.items()}
    return {name: texts[name] for name in TopologicalSorter(uses).static_order()}


def _generate(packages: Texts, work: Path, environment: Path, progress: Progress) -> None:
    """Write the definitions to `src` in a folder, and generate sources in `gen` with the environment's Python."""
    for package, texts in packages.items():
        for path, content in texts.items():
            (work / "src" / package / path).parent.mkdir(parents=True, exist_ok=True)
            (work / "src" / package / path).write_text(content, encoding="utf-8")
    waiting = [f"generate {package}" for package in packages]
    progress.begin(waiting[0])

    def on_line(line: str) -> None:
        if line.startswith(_DONE):
            progress.end(waiting.pop(0))
            if waiting:
                progress.begin(waiting[0])

    # No modules beside the program; equal sources each time.
    own = {"PYTHONSAFEPATH": "1", "PYTHONHASHSEED": "0"}
    command = [str(environment / "bin" / "python"), str(_GENERATE), str(work), str(environment), *packages]
    run(command, "generators of ROS 2", clean_environment() | own, on_line)


def _compile(packages: Texts, work: Path, library: Path, environment: Path, progress: Progress) -> None:
    """Compile generated sources: a library, and a module of Python for each package."""
    generated, compiler, variables = work / "gen", _compiler(), clean_environment()
    introspection = work / "introspection"
    folders = compiling.header_folders([generated, introspection], environment)

    def run_all(commands: Mapping[str, Sequence[str]]) -> None:
        def step(name: str) -> None:
            progress.begin(f"compile {name}")
            run(commands[name], f"interfaces: {name}", variables)
            progress.end(f"compile {name}")

        with ThreadPoolExecutor(_JOBS) as pool:
            list(pool.map(step, commands))

    units = compiling.write_units(generated, introspection, work / "objects")
    library.parent.mkdir(exist_ok=True)
    name = library.stem.removeprefix("lib")
    run_all({f"{unit.name} of {name}": compiling.compile_command(compiler, unit, of, folders) for unit, of in units})
    linking = compiling.library_command(compiler, [unit for unit, _ in units], library, environment)
    run(linking, "interfaces: library", variables)
    for package in packages:
        for command in compiling.alias_commands(compiler, package, library):
            run(command, f"interfaces: library of {package}", variables)
    run_all({each: compiling.module_command(compiler, generated / each, library, folders) for each in packages})


def _lay_out(packages: Texts, generated: Path, prefix: Path) -> None:
    """Copy what Python and ROS's tools read to a prefix: modules, definitions, and the index of packages."""
    index = prefix / "share" / "ament_index" / "resource_index"
    for package, texts in packages.items():
        files = interface_files(package, texts)
        interfaces = sorted(path for path in files if "/" in path)
        described = sorted(
            path.relative_to(generated / package).as_posix()
            for path in (generated / package).glob("*/*")
            if path.suffix in (".idl", ".json")
        )
        placed = {
            **{f"share/{package}/{path}": files[path] for path in (*interfaces, "package.xml")},
            **{f"share/{package}/{path}": (generated / package / path).read_bytes() for path in described},
            f"{index.relative_to(prefix)}/packages/{package}": b"",
            f"{index.relative_to(prefix)}/rosidl_interfaces/{package}": "\n".join(
                sorted([*interfaces, *(path for path in described if path.endswith(".idl"))])
            ).encode(),
        }
        for path in sorted((generated / package).rglob("*.py")):
            placed[f"{MODULES}/{path.relative_to(generated).as_posix()}"] = path.read_bytes()
        for place, content in placed.items():
            (prefix / place).parent.mkdir(parents=True, exist_ok=True)
            (prefix / place).write_bytes(content)
