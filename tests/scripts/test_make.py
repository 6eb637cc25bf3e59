"""Tests of the Makefile where `python3` is not the Python that it needs."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(os.name != "posix" or not shutil.which("make"), reason="needs make and a shell")


def make(folder: Path, version: str) -> subprocess.CompletedProcess[str]:
    """Run `make` with a Python that claims to be of this version, and that creates no environment."""
    python = folder / "python"
    claim = f"import sys; sys.version_info = ({version})"
    python.write_text(f'#!/bin/sh\n[ "$1" = -m ] && exit 77\nexec "{sys.executable}" -c "{claim}\n$2"\n')
    python.chmod(0o755)
    shutil.copy(ROOT / "Makefile", folder)
    (folder / "pyproject.toml").touch()
    command = ["make", ".venv/.installed", f"PYTHON={python}"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def test_old_python_is_refused_before_environment_is_made(tmp_path: Path) -> None:
    done = make(tmp_path, "3, 10, 4")
    said = "Python 3.11 or newer is needed, and this is 3.10; name another: make PYTHON=python3.12"
    assert done.returncode != 0
    assert done.stderr.splitlines()[0] == said
    assert "-m venv" not in done.stdout


@pytest.mark.parametrize("version", ["3, 11, 0", "3, 14, 1"])
def test_new_enough_python_makes_environment(tmp_path: Path, version: str) -> None:
    done = make(tmp_path, version)
    assert "needed" not in done.stderr
    assert "Error 77" in done.stderr
