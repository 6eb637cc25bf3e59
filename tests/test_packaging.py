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


def test_the_wheel_runs_in_a_fresh_environment(wheel: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "venv", with_pip=True)
    scripts = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    run([str(scripts / "python"), "-m", "pip", "install", "--quiet", str(wheel)], tmp_path)
    cellwright = str(scripts / "cellwright")
    assert run([cellwright, "check", "lesson"], tmp_path) == "ok\n"
    command = [cellwright, "run", "lesson", "--until", "5", "--agent", "none", "--listen", "all", "--json"]
    result = json.loads(run([*command, "--no-picture"], tmp_path))
    assert result["simulated"] == pytest.approx(5.0)
    assert result["heard"]["/clock"] == result["steps"]
    where = run([str(scripts / "python"), "-c", "import cellwright; print(cellwright.__file__)"], tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)
