"""Environment of our own: a folder with a Python that has ROS 2 from pinned wheels, and our interfaces.

`python -m cellwright.middleware.ros2.packages.environment` makes it; `scripts/install-ros2` runs that, after it has
installed missing tools.

- `requirements/DISTRIBUTION.txt` pins every package, so that pip resolves nothing.
- The interfaces come as two wheels, built once and kept in the user's cache. An environment may take the first, with
  packages that all distributions have alike, from another distribution, which spares most of the building.
- A file in the folder names its contents. It is written last, and so a folder without it is incomplete.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import shutil
import sys
import time
import venv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cellwright.middleware.ros2.packages.build import (
    COMMON,
    REQUIREMENTS,
    VARYING,
    MissingToolsError,
    build_wheel,
    expected_steps,
    packages_of,
    requirements,
    wheel_path,
)
from cellwright.middleware.ros2.packages.contents import JAZZY, KILTED
from cellwright.middleware.ros2.packages.programs import pip
from cellwright.middleware.ros2.packages.progress import Progress
from cellwright.util.errors import UsageError
from cellwright.util.files import user_folder, write_atomic

DISTRIBUTIONS = (JAZZY, KILTED)
"""ROS 2 distributions that wheels exist of, the default first."""

FOLDER_VARIABLE = "CELLWRIGHT_ROS2_HOME"
"""Environment variable: the folder of the environment, in place of one in the user's data."""

RMW = "rmw_fastrtps_cpp"
"""The only middleware that the wheels have."""

_CONTENTS = "cellwright.json"
_NEWEST = (3, 14)
_WHEELS = "wheels"
_EXPECTED = {_WHEELS: 25.0}  # [s], on an idle machine with a fast network
_COLLECTING = 0.7  # share of it in which pip collects the wheels, before it installs them
_PYTHON = f"{sys.version_info[0]}.{sys.version_info[1]}"
FAILED, MISSING_TOOLS, INTERRUPTED = 1, 3, 130
"""Exit statuses: a step failed, programs that build the interfaces are missing, and Ctrl-C."""


def environment_folder(distribution: str, variables: Mapping[str, str] = os.environ) -> Path:
    """Return the folder of the environment of a distribution, which need not exist."""
    if named := variables.get(FOLDER_VARIABLE):
        return Path(named).expanduser().absolute()
    return user_folder("XDG_DATA_HOME", ".local/share", variables) / f"ros2-{distribution}"


def complete_environments(variables: Mapping[str, str] = os.environ) -> Iterator[tuple[str, Path]]:
    """Yield the distribution and the folder of each complete environment, the default distribution first."""
    seen = set()
    for distribution in DISTRIBUTIONS:
        folder = environment_folder(distribution, variables)
        contents = _contents(folder)
        if folder not in seen and contents.get("interfaces"):
            seen.add(folder)
            yield str(contents["distribution"]), folder


def install(
    distribution: str, progress: Progress, variables: Mapping[str, str] = os.environ, *, interfaces: str | None = None
) -> Path:
    """Make the environment of a distribution, or bring it up to date; return its folder.

    Args:
        distribution: one of `DISTRIBUTIONS`.
        progress: shows what is done, and the time left.
        variables: the environment, for folders.
        interfaces: distribution whose common interfaces are taken from the cache; None for the environment's own.

    Raises:
        MissingToolsError: the interfaces are not in the cache, and programs to build them are missing. The rest is
            installed, and another call goes on from there.
        UsageError: this machine cannot run the wheels, the other interfaces are not in the cache, or a step failed.
    """
    check_machine(distribution)
    folder = environment_folder(distribution, variables)
    alike, others = (packages_of(name, distribution) for name in (COMMON, VARYING))
    common = wheel_path(COMMON, interfaces or distribution, alike, variables)
    varying = wheel_path(VARYING, distribution, others, variables)
    wheels, own = {common: alike, varying: others}, [wheel_path(COMMON, distribution, alike, variables), varying]
    base = {"distribution": distribution, "requirements": _digest(requirements(distribution)), "python": _PYTHON}
    whole = base | {"interfaces": _names(wheels)}
    if _contains(folder, whole) or _contains(folder, base | {"interfaces": _names(own)}):
        return folder
    if interfaces is not None and not common.is_file():
        raise UsageError(f"interfaces of {interfaces}: not built here; run scripts/install-ros2 {interfaces} first")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with _lock(folder.with_name(f".{folder.name}.lock"), progress):
            # Another process has installed it meanwhile.
            if _contains(folder, whole):
                return folder
            is_made, unbuilt = _contains(folder, base), [wheel for wheel in wheels if not wheel.is_file()]
            progress.plan({} if is_made else _EXPECTED)
            for wheel in unbuilt:
                progress.plan(expected_steps(wheels[wheel], wheel))
            if not is_made:
                _make(folder, distribution, progress)
                _describe(folder, base)
            for wheel in unbuilt:
                build_wheel(wheels[wheel], folder, wheel, progress)
            _describe(folder, base)
            # The order matters: an older wheel of the first had files of the second.
            for wheel in wheels:
                pip(folder, ["install", "--no-deps", "--force-reinstall", str(wheel)])
            _describe(folder, whole)
    except OSError as error:
        raise UsageError(f"{error.filename or folder}: {error.strerror or error}") from None
    return folder


def check_machine(distribution: str) -> None:
    """Check that there are wheels for this machine.

    Raises:
        UsageError: there are none.
    """
    if distribution not in DISTRIBUTIONS:
        raise UsageError(f"{distribution}: no wheels of this ROS 2; give one of {', '.join(DISTRIBUTIONS)}")
    system, machine = sys.platform, platform.machine()
    if system != "linux" or machine != "x86_64" or sys.version_info[:2] > _NEWEST:
        raise UsageError(
            f"wheels of ROS 2 exist for Linux on x86_64 and Python up to {_NEWEST[0]}.{_NEWEST[1]} "
            f"(got {system} on {machine}, Python {_PYTHON}); use a ROS 2 distribution instead"
        )


def _make(folder: Path, distribution: str, progress: Progress) -> None:
    """Create the environment without our interfaces, in place of an incomplete or outdated one."""
    started = time.monotonic()
    if folder.exists() and not (folder / "pyvenv.cfg").is_file() and any(folder.iterdir()):
        raise UsageError(f"{folder}: is no virtual environment; remove it, or set {FOLDER_VARIABLE}")
    shutil.rmtree(folder, ignore_errors=True)
    count = len(requirements(distribution).splitlines())
    progress.say(f"ROS 2 {distribution}: installing {count} wheels into {folder}")
    progress.begin(_WHEELS)
    collected = 0

    def on_line(line: str) -> None:
        nonlocal collected
        if line.startswith("Collecting "):
            collected += 1
            progress.at(_WHEELS, _COLLECTING * collected / count)

    venv.create(folder, symlinks=True)
    pip(folder, ["install", "--no-deps", "--requirement", str(REQUIREMENTS / f"{distribution}.txt")], on_line)
    progress.end(_WHEELS)
    progress.say(f"ROS 2 {distribution}: installed in {time.monotonic() - started:.0f} s")


def _contains(folder: Path, wanted: Mapping[str, str]) -> bool:
    """Return True if an environment has a working interpreter, and its contents include the wanted ones."""
    return wanted.items() <= _contents(folder).items() and (folder / "bin" / "python").exists()


def _contents(folder: Path) -> dict[str, Any]:
    """Return the description of an environment's contents; empty if there is none."""
    try:
        read = json.loads((folder / _CONTENTS).read_bytes())
    except (OSError, ValueError):
        return {}
    return read if isinstance(read, dict) else {}


def _describe(folder: Path, contents: Mapping[str, str]) -> None:
    write_atomic(folder / _CONTENTS, json.dumps(contents, indent=1) + "\n")


def _names(wheels: Iterable[Path]) -> str:
    return " ".join(wheel.name for wheel in wheels)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@contextmanager
def _lock(path: Path, progress: Progress) -> Iterator[None]:
    """Wait until no other process installs there, and keep others waiting."""
    # Not on Windows, where the rest of this module is loaded too.
    import fcntl

    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            progress.say("waiting for another installation into the same folder")
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def main(arguments: Sequence[str] | None = None) -> int:
    """Install ROS 2 into an environment of its own; return the exit status: 0 or one of those above.

    Raises:
        SystemExit: an argument is not valid (2), or help was asked for.
    """
    parser = argparse.ArgumentParser(prog="install-ros2", description="Install ROS 2 into an environment of its own.")
    parser.add_argument("distribution", nargs="?", default=DISTRIBUTIONS[0], choices=DISTRIBUTIONS)
    parser.add_argument("--interfaces", choices=DISTRIBUTIONS, help="take the common ones built for this distribution")
    options = parser.parse_args(arguments)
    distribution: str = options.distribution
    started = time.monotonic()

    progress = Progress(sys.stdout, "install-ros2")
    try:
        with progress:
            folder = install(distribution, progress, interfaces=options.interfaces)
    except MissingToolsError as error:
        progress.say(str(error))
        return MISSING_TOOLS
    except KeyboardInterrupt:
        progress.say("interrupted; the next call continues")
        return INTERRUPTED
    except UsageError as error:
        for line in str(error).splitlines():
            progress.say(f"error: {line}")
        return FAILED
    progress.say(f"ROS 2 {distribution} is there: {folder} ({time.monotonic() - started:.0f} s)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
