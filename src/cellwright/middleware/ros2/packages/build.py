"""Wheel of the interface packages: built with the generators of ROS 2, for an environment that has ROS 2 from wheels.

The packages are those that colcon builds in a workspace. Here only what Python needs is generated and compiled, without
C++ interfaces and headers, which the wheels of ROS 2 could not serve anyway.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from graphlib import TopologicalSorter
from pathlib import Path

from cellwright.middleware.ros2.packages.contents import definitions, dependencies, interface_files
from cellwright.util.errors import UsageError
from cellwright.util.files import replacement_path, user_folder

BOOTSTRAP_VARIABLES = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
"""Variables that each interpreter with ROS 2's wheels sets for itself, and that would mislead another one."""

REQUIREMENTS = Path(__file__).parent / "requirements"
"""Folder of lists of pinned packages: `DISTRIBUTION.txt`, and `DISTRIBUTION-build.txt` for building."""

Report = Callable[[str], None]

_GENERATORS = Path(__file__).parent / "generators"
_NAME = "cellwright_ros2_interfaces"
_FLAGS = {"C": "-O1 -DNDEBUG", "CXX": "-O1 -DNDEBUG"}
_JOBS = 2  # packages at once
_LAST_LINES = 20  # of the output of a program that failed


class MissingToolsError(UsageError):
    """Programs that build the interfaces are missing."""


def requirements(name: str) -> str:
    """Return the pinned packages of a list ("jazzy", "jazzy-build"), a line each."""
    return (REQUIREMENTS / f"{name}.txt").read_text(encoding="utf-8")


def wheel_path(
    distribution: str, texts: Mapping[str, Mapping[str, str]] | None = None, variables: Mapping[str, str] = os.environ
) -> Path:
    """Return the path in the cache of the wheel for a distribution and this Python; the file need not exist.

    Its name has a digest of all that the wheel is made from, so a wheel is never outdated.

    Args:
        distribution: "jazzy" or "kilted".
        texts: definitions by package and path; None for those of Cellwright.
        variables: the environment, for the folder of the cache.
    """
    digest = hashlib.sha256()
    for package, each in (definitions() if texts is None else texts).items():
        for path, content in sorted(interface_files(package, each).items()):
            digest.update(f"{package}/{path} {len(content)}\0".encode() + content)
    for name in (distribution, f"{distribution}-build"):
        digest.update(requirements(name).encode())
    for generators in sorted(_GENERATORS.iterdir()):
        digest.update(generators.read_bytes())
    digest.update(repr((_FLAGS, _tag())).encode())
    version = f"1+{distribution}.{digest.hexdigest()[:12]}"
    return user_folder("XDG_CACHE_HOME", ".cache", variables) / "ros2" / f"{_NAME}-{version}-{_tag()}.whl"


def _tag() -> str:
    """Return the tag of wheels for this Python and machine."""
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def missing_tools() -> list[str]:
    """Return the tools for building that this machine lacks: programs, and the headers of Python."""
    absent = [name for name in ("cmake", "ninja", os.environ.get("CXX", "g++")) if shutil.which(name) is None]
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    return absent if header.is_file() else [*absent, str(header)]


def build_wheel(distribution: str, environment: Path, wheel: Path, report: Report) -> None:
    """Build the interfaces, and write the wheel; the file appears completely or not at all.

    Args:
        distribution: "jazzy" or "kilted".
        environment: folder of a virtual environment with the wheels of ROS 2.
        wheel: path of the wheel, from `wheel_path`.
        report: takes a line on what is done.

    Raises:
        MissingToolsError: tools are missing.
        UsageError: a package failed; the error ends with the last lines of its build.
        OSError: a file cannot be written.
    """
    if absent := missing_tools():
        raise MissingToolsError(f"building the interfaces requires {', '.join(absent)}; install what is missing")
    started = time.monotonic()
    report(f"interfaces: building {', '.join(definitions())}")
    wheel.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="cellwright-ros2-") as name:
        work = Path(name)
        tools, prefix = work / "tools", work / "prefix"
        listed = REQUIREMENTS / f"{distribution}-build.txt"
        pip(environment, ["install", "--no-deps", "--prefix", str(tools), "--requirement", str(listed)])
        for folder in (environment, tools):
            _name_own_headers(folder, environment)
        variables = _build_variables(environment, tools, prefix)
        built = _in_order(lambda package: _build(package, work, environment, variables))
        for number, (package, seconds) in enumerate(built, start=1):
            report(f"interfaces: {package} built in {seconds:.0f} s ({number} of {len(definitions())})")
        with replacement_path(wheel) as unfinished:
            _pack(prefix, unfinished, wheel.name)
    report(f"interfaces: built in {time.monotonic() - started:.0f} s, {wheel.stat().st_size / 1e6:.1f} MB: {wheel}")


def _in_order(build: Callable[[str], float]) -> Iterator[tuple[str, float]]:
    """Build packages, each after those that it uses and the largest first; yield each with its seconds.

    After a failure no other package is begun.
    """
    texts = definitions()
    order = TopologicalSorter({name: set(dependencies(name, each)) & {*texts} for name, each in texts.items()})
    order.prepare()
    running: dict[Future[float], str] = {}
    waiting: list[str] = []
    with ThreadPoolExecutor(_JOBS) as pool:
        while order.is_active():
            waiting = sorted([*waiting, *order.get_ready()], key=lambda name: -len(texts[name]))
            while waiting and len(running) < _JOBS:
                package = waiting.pop(0)
                running[pool.submit(build, package)] = package
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                package = running.pop(future)
                yield package, future.result()
                order.done(package)


def _build(package: str, work: Path, environment: Path, variables: Mapping[str, str]) -> float:
    """Generate, compile and install a package below the prefix; return how long it took [s]."""
    started = time.monotonic()
    source, folder = work / "src" / package, work / "build" / package
    for path, content in interface_files(package, definitions()[package]).items():
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        (source / path).write_bytes(content)
    settings = {
        "CMAKE_INSTALL_PREFIX": work / "prefix",
        "CMAKE_BUILD_TYPE": "Release",
        **{f"CMAKE_{language}_FLAGS_RELEASE": flags for language, flags in _FLAGS.items()},
        "BUILD_TESTING": "OFF",
        "Python3_EXECUTABLE": environment / "bin" / "python",
        "Python3_FIND_VIRTUALENV": "ONLY",
        "rosidl_default_generators_DIR": _GENERATORS,
    }
    options = [f"-D{name}={value}" for name, value in settings.items()]
    for command in (
        ["cmake", "-G", "Ninja", "-S", str(source), "-B", str(folder), *options],
        ["cmake", "--build", str(folder), "--parallel", "1"],
        ["cmake", "--install", str(folder), "--strip"],
    ):
        run(command, package, variables)
    return time.monotonic() - started


def _build_variables(environment: Path, tools: Path, prefix: Path) -> dict[str, str]:
    """Return the variables of builds; interpreters need no bootstrap then, which runs each of them twice."""
    variables = clean_environment()
    ask = "import os; print(os.environ['LD_LIBRARY_PATH'])"
    libraries = run([str(environment / "bin" / "python"), "-c", ask], "ROS 2's Python", variables).strip()
    modules = Path("lib") / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
    prefixes = os.pathsep.join(map(str, (prefix, tools, environment)))
    programs = os.pathsep.join([str(tools / "bin"), str(environment / "bin"), variables.get("PATH", os.defpath)])
    return variables | {
        "PATH": programs,
        "PYTHONPATH": str(tools / modules),
        "AMENT_PREFIX_PATH": prefixes,
        "CMAKE_PREFIX_PATH": prefixes,
        BOOTSTRAP_VARIABLES[0]: libraries,
        BOOTSTRAP_VARIABLES[1]: "1",
    }


_HEADERS = re.compile(
    r"/opt/python/cp\d+-cp\d+/(include/python[\d.]+|lib/python[\d.]+/site-packages/numpy/_core/include)"
)
"""Folders of headers on the machine that built the wheels."""


def _name_own_headers(folder: Path, environment: Path) -> None:
    """Replace the headers of Python and numpy in CMake's files of installed packages by those of this machine."""
    numpy = next((environment / "lib").glob("python*/site-packages/numpy/_core/include"), None)
    own = {"include": sysconfig.get_paths()["include"], "lib": str(numpy)}
    for path in (folder / "share").rglob("*.cmake"):
        text = path.read_text(encoding="utf-8")
        if (changed := _HEADERS.sub(lambda found: own[found[1].partition("/")[0]], text)) != text:
            path.write_text(changed, encoding="utf-8")


def _pack(prefix: Path, wheel: Path, name: str) -> None:
    """Write a wheel with what Python and ROS's tools read: modules, libraries, definitions and the index of packages.

    Headers and CMake's files stay out. The rest goes to the same places below the environment as below the prefix.
    """
    distribution, version, *tag = name.removesuffix(".whl").split("-")
    modules = Path("lib") / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
    contents = {}
    for path in sorted(prefix.rglob("*")):
        inside = path.relative_to(prefix)
        if not path.is_file() or path.suffix == ".pyc" or inside.parts[0] == "include" or "cmake" in inside.parts:
            continue
        if not inside.is_relative_to(modules):
            contents[f"{distribution}-{version}.data/data/{inside.as_posix()}"] = path.read_bytes()
        elif not inside.relative_to(modules).parts[0].endswith(".egg-info"):
            contents[inside.relative_to(modules).as_posix()] = path.read_bytes()
    information = f"{distribution}-{version}.dist-info"
    metadata = f"Metadata-Version: 2.1\nName: {distribution.replace('_', '-')}\nVersion: {version}\n"
    contents[f"{information}/METADATA"] = metadata.encode()
    wheel_lines = f"Wheel-Version: 1.0\nGenerator: cellwright\nRoot-Is-Purelib: false\nTag: {'-'.join(tag)}\n"
    contents[f"{information}/WHEEL"] = wheel_lines.encode()
    record = [f"{path},sha256={_record_digest(content)},{len(content)}" for path, content in contents.items()]
    contents[f"{information}/RECORD"] = "\n".join([*record, f"{information}/RECORD,,\n"]).encode()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for place, content in contents.items():
            archive.writestr(
                zipfile.ZipInfo(place), content, zipfile.ZIP_DEFLATED
            )  # without times: equal builds are equal


def _record_digest(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


def pip(environment: Path, arguments: Sequence[str]) -> None:
    """Run this interpreter's pip on a virtual environment; files of Python are not compiled.

    Raises:
        UsageError: it failed; the error ends with its last lines.
    """
    options = ["--python", str(environment / "bin" / "python"), "--quiet", "--disable-pip-version-check", "--no-input"]
    run([sys.executable, "-m", "pip", *options, *arguments, "--no-compile"], "pip", clean_environment())


def clean_environment(variables: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the variables of a process that starts an interpreter with ROS 2's wheels."""
    dropped = {"PYTHONHOME", "PYTHONPATH", *BOOTSTRAP_VARIABLES}
    return {name: value for name, value in variables.items() if name not in dropped}


def run(command: Sequence[str], what: str, variables: Mapping[str, str]) -> str:
    """Run a program to its end, and return its output.

    Raises:
        UsageError: it cannot be started or failed; the error names `what`, and ends with its last lines.
    """
    try:
        ran = subprocess.run(  # noqa: S603
            command,
            env=dict(variables),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
    except OSError as error:
        raise UsageError(f"{what}: {command[0]}: cannot be started: {error.strerror or error}") from None
    if ran.returncode != 0:
        raise UsageError(
            "\n".join([f"{what}: {Path(command[0]).name} failed:", *ran.stdout.splitlines()[-_LAST_LINES:]])
        )
    return ran.stdout
