"""Pytest with the plugin, on test files in a folder of their own, as in a user's project."""

import os
import subprocess
import sys
from pathlib import Path

import cellwright
from tests.support.waiting import TIMEOUT

PLUGIN = "cellwright.running.pytest_plugin"
SOURCES = str(Path(cellwright.__file__).parents[1])


def run_pytest(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run pytest in a folder; it loads the plugin by its name, however Cellwright is installed."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    environment |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": SOURCES}
    command = [sys.executable, "-m", "pytest", "-p", PLUGIN, "--basetemp", str(folder / "made"), *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=TIMEOUT)
