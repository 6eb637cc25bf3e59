"""What is built can be installed elsewhere, and runs there."""

import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "cellwright"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)], folder)
    (built,) = folder.glob("*.whl")
    return built


def run(command: list[str], folder: Path) -> str:
    """What a command prints that is run in a folder outside the clone."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, f"{command}\n{ran.stdout}{ran.stderr}"
    return ran.stdout


def test_the_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
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
    assert any(name.endswith("LICENSE") for name in inside)


@pytest.fixture(scope="module")
def scripts(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the programs of a fresh environment are, into which the wheel was installed."""
    folder = tmp_path_factory.mktemp("fresh")
    venv.create(folder / "venv", with_pip=True)
    scripts = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    run([str(scripts / "python"), "-m", "pip", "install", "--quiet", str(wheel)], folder)
    return scripts


def test_the_wheel_runs_in_a_fresh_environment(scripts: Path, tmp_path: Path) -> None:
    cellwright = str(scripts / "cellwright")
    assert run([cellwright, "check", "lesson"], tmp_path) == "ok\n"
    command = [cellwright, "run", "lesson", "--until", "5", "--agent", "none", "--listen", "all", "--json"]
    result = json.loads(run([*command, "--no-picture"], tmp_path))
    assert result["simulated"] == pytest.approx(5.0)
    assert result["heard"]["/clock"] == result["steps"]
    where = run([str(scripts / "python"), "-c", "import cellwright; print(cellwright.__file__)"], tmp_path)
    assert Path(where.strip()).is_relative_to(scripts.parent)


@pytest.mark.ros1
def test_the_launcher_of_the_wheel_is_run_by_its_environment(scripts: Path, tmp_path: Path) -> None:
    """As ROS starts it: an executable, from another folder, with other modules on the path of Python."""
    lines = run([str(scripts / "cellwright"), "ros1-env", "--dir", str(tmp_path / "tree")], tmp_path)
    (gear,) = tmp_path.glob("tree/*/share/osrf_gear/script/gear.py")
    assert str(scripts / "python") in gear.read_text()
    (tmp_path / "yaml.py").write_text("raise ImportError('not the library')\n")
    script = 'eval "$1"; export PYTHONPATH=$PWD; exec "$2" -n "time_limit: 7"'
    printed = run(["bash", "-c", script, "bash", lines, str(gear)], tmp_path)
    assert "\ntime_limit: 7.0\n" in printed or "\ntime_limit: 7\n" in printed
    assert "# file: gear.launch\n" in printed
