"""Tests of the built packages: they can be installed elsewhere, and run there."""

import email
import json
import os
import subprocess
import sys
import tomllib
import venv
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmStart

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "cellwright"
CELLWRIGHT = """
import sys, cellwright
from cellwright.__main__ import main
print(cellwright.__file__, flush=True)
sys.argv[0] = "cellwright"
sys.exit(main())
"""
"""The command, which first prints its place of installation."""
LOADED = ("cellwright.cli.main", "cellwright.cli.run.command", "cellwright.cli.teleop.command")


@pytest.fixture(scope="module")
def backend(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the build backend, which pip would otherwise fetch for each build."""
    folder = tmp_path_factory.mktemp("backend")
    required = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    run([sys.executable, "-m", "pip", "install", "--quiet", "--target", str(folder), *required], folder)
    return folder


def build(source: Path, backend: Path, folder: Path, *targets: str) -> None:
    """Build `sdist` or `wheel` of the sources in a folder."""
    wanted = [word for target in targets for word in ("-t", target)]
    run([sys.executable, "-m", "hatchling", "build", *wanted, "-d", str(folder)], source, path=backend)


@pytest.fixture(scope="module")
def built(backend: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the sdist and the wheel."""
    folder = tmp_path_factory.mktemp("built")
    build(ROOT, backend, folder, "sdist", "wheel")
    return folder


@pytest.fixture(scope="module")
def wheel(built: Path) -> Path:
    (wheel,) = built.glob("*.whl")
    return wheel


def bare() -> dict[str, str]:
    """Return the environment of the tests, without PYTHONPATH."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def run(command: list[str], folder: Path, *, path: Path | None = None, status: int = 0) -> str:
    """Run a command in a folder and return its output; Python's path holds only `path`."""
    environment = bare()
    if path is not None:
        environment["PYTHONPATH"] = str(path)
    ran = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    assert ran.returncode == status, f"{command}\n{ran.stdout}{ran.stderr}"
    return ran.stdout


def test_wheel_contains_only_the_package(wheel: Path) -> None:
    inside = set(zipfile.ZipFile(wheel).namelist())
    ours = {
        f"cellwright/{path.relative_to(PACKAGE).as_posix()}"
        for path in PACKAGE.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    suffixes = {Path(name).suffix for name in ours}
    assert {".py", ".msg", ".srv", ".yaml", ".typed"} <= suffixes
    assert ours <= inside
    others = {name for name in inside - ours if ".dist-info/" not in name}
    assert not others
    (licence,) = [name for name in inside if name.endswith("licenses/LICENSE")]
    assert zipfile.ZipFile(wheel).read(licence) == (ROOT / "LICENSE").read_bytes()
    assert wheel.name.endswith("-py3-none-any.whl")


def test_sdist_builds_same_wheel(built: Path, wheel: Path, backend: Path, tmp_path: Path) -> None:
    (sdist,) = built.glob("*.tar.gz")
    run(["tar", "-xf", str(sdist)], tmp_path)  # tarfile of Debian's Python 3.11.2 does not know the filter yet
    (source,) = tmp_path.iterdir()
    assert {"LICENSE", "README.md", "pyproject.toml", "src", "tests", "docs"} <= {
        each.name for each in source.iterdir()
    }
    build(source, backend, tmp_path, "wheel")
    again = tmp_path / wheel.name
    assert contents(again) == contents(wheel)


def contents(wheel: Path) -> dict[str, bytes]:
    archive = zipfile.ZipFile(wheel)
    return {name: archive.read(name) for name in archive.namelist()}


def link_requirements(wheel: Path, site: Path) -> None:
    """Link the requirements of a wheel, and their requirements, from this environment into another one.

    pip then finds them there and fetches nothing. Packages that the wheel does not name are missing. pip fetches
    required packages that this environment lacks, or has in another version.
    """
    (metadata,) = [name for name in zipfile.ZipFile(wheel).namelist() if name.endswith(".dist-info/METADATA")]
    message = email.message_from_bytes(zipfile.ZipFile(wheel).read(metadata))
    waiting = [(Requirement(line), "") for line in message.get_all("Requires-Dist", [])]
    linked: set[tuple[str, str]] = set()
    while waiting:
        required, extra = waiting.pop()
        if required.marker is not None and not required.marker.evaluate({"extra": extra}):
            continue
        for wanted in {"", *required.extras} - {extra for name, extra in linked if name == required.name}:
            linked.add((required.name, wanted))
            with suppress(PackageNotFoundError):
                found = distribution(required.name)
                link_files(found, site)
                waiting += [(Requirement(line), wanted) for line in found.requires or []]


def link_files(found: Distribution, site: Path) -> None:
    """Link the packages and modules of a distribution into a folder."""
    for name in {file.parts[0] for file in found.files or []} - {"..", "__pycache__"}:
        if not (site / name).exists():
            (site / name).symlink_to(Path(str(found.locate_file(name))))


@pytest.fixture(scope="module")
def scripts(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the programs of a fresh environment with the wheel installed."""
    folder = tmp_path_factory.mktemp("fresh")
    venv.create(folder / "venv")
    scripts = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    (site,) = (folder / "venv").glob("**/site-packages")
    link_requirements(wheel, site)
    pip = [sys.executable, "-m", "pip", "--python", str(scripts / "python")]
    run([*pip, "install", "--quiet", "--no-compile", str(wheel)], folder)
    return scripts


@pytest.fixture(scope="module")
def installed(scripts: Path) -> Iterator[WarmStart]:
    """Yield a process of the fresh environment that has loaded the installed package."""
    start = WarmStart(LOADED, python=str(scripts / "python"), environment=bare())
    yield start
    start.close()


def test_wheel_runs_in_fresh_environment(scripts: Path, tmp_path: Path) -> None:
    cellwright = str(scripts / "cellwright")
    assert run([cellwright, "check", "lesson"], tmp_path) == "ok\n"
    command = [cellwright, "run", "lesson", "--until", "5", "--agent", "none", "--listen", "all", "--json"]
    result = json.loads(run([*command, "--no-picture"], tmp_path))
    assert result["simulated"] == pytest.approx(5.0)
    assert result["heard"]["/clock"] == result["steps"]
    where = run([str(scripts / "python"), "-c", "import cellwright; print(cellwright.__file__)"], tmp_path)
    assert Path(where.strip()).is_relative_to(scripts.parent)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["trials"], "qual1a"),
        (["run", "lesson", "--agent", "lesson", "--until", "3", "--no-picture"], "stopped before"),
        (["teleop", "qinglong", "--check"], "passed"),
        (["eval", "lesson", "--agent", "brief.py:Brief", "--out", "results"], "passed      1 of 1 runs"),
    ],
    ids=lambda each: each[0] if isinstance(each, list) else "",
)
def test_readme_commands_work_in_fresh_environment(
    arguments: list[str], expected: str, installed: WarmStart, scripts: Path, tmp_path: Path
) -> None:
    calls = "client.start_competition(); client.end_competition()"
    (tmp_path / "brief.py").write_text(f"class Brief:\n    def run(self, client):\n        {calls}\n")
    ran = installed.run(CELLWRIGHT, *arguments, folder=tmp_path, environment=bare())
    assert ran.returncode == (1 if arguments[0] == "run" else 0), ran.stdout + ran.stderr
    where, _, printed = ran.stdout.partition("\n")
    assert Path(where).is_relative_to(scripts.parent)
    assert expected in printed


def test_fresh_environment_without_extra_refuses_video(installed: WarmStart, tmp_path: Path) -> None:
    ran = installed.run(CELLWRIGHT, "run", "lesson", "--video", "run.mp4", folder=tmp_path, environment=bare())
    message = "error: video: PyAV is not installed; run: pip install 'cellwright[video]'\n"
    assert (ran.returncode, ran.stderr) == (2, message)


def test_types_of_wheel_are_used_by_mypy(scripts: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from cellwright.util.pose import Pose\n\nheight: float = Pose().position[2]\nname: str = Pose().yaw\n"
    )
    options = ["--strict", "--cache-dir", os.devnull, "--python-executable", str(scripts / "python")]
    output = run([sys.executable, "-m", "mypy", *options, "mine.py"], tmp_path, status=1)
    assert 'mine.py:4: error: Incompatible types in assignment (expression has type "float"' in output
    assert "Found 1 error" in output


@pytest.mark.ros1
def test_launcher_of_wheel_uses_python_of_environment(scripts: Path, tmp_path: Path) -> None:
    """As ROS starts it: an executable, from another folder, with other modules on the path of Python."""
    lines = run([str(scripts / "cellwright"), "ros1-env", "--dir", str(tmp_path / "tree")], tmp_path)
    (gear,) = tmp_path.glob("tree/*/share/osrf_gear/script/gear.py")
    assert str(scripts / "python") in gear.read_text()
    (tmp_path / "yaml.py").write_text("raise ImportError('not the library')\n")
    script = 'eval "$1"; export PYTHONPATH=$PWD; exec "$2" -n "time_limit: 7"'
    printed = run(["bash", "-c", script, "bash", lines, str(gear)], tmp_path)
    assert "\ntime_limit: 7.0\n" in printed or "\ntime_limit: 7\n" in printed
    assert "# file: gear.launch\n" in printed
