"""Pytest with the plugin, on test files in a folder of their own, as in a user's project."""

import os
import subprocess
import sys
from pathlib import Path

import cellwright
from tests.support.waiting import TIMEOUT
from tests.support.warm import warm_start

PLUGIN = "cellwright.running.pytest_plugin"
SOURCES = str(Path(cellwright.__file__).parents[1])
_PYTEST = "import sys, pytest; sys.exit(pytest.main(sys.argv[1:]))"


def run_pytest(folder: Path, *arguments: str, is_fresh: bool = False) -> subprocess.CompletedProcess[str]:
    """Run pytest in a folder; it loads the plugin by its name, however Cellwright is installed.

    Args:
        folder: the project.
        arguments: of pytest.
        is_fresh: start an interpreter, as a user does; else a fork that has loaded Cellwright.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    environment |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": SOURCES}
    words = ["-p", PLUGIN, "--basetemp", str(folder / "made"), *arguments]
    if not is_fresh:
        return warm_start().run(_PYTEST, *words, folder=folder, environment=environment)
    command = [sys.executable, "-m", "pytest", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=TIMEOUT)
