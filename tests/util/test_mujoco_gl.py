"""MUJOCO_GL never breaks Cellwright, whatever its value."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cellwright.util import mujoco_gl
from tests.support.waiting import TIMEOUT


@pytest.mark.slow
@pytest.mark.parametrize("value", ["osmesa", "bogus", "", "Disable"])
def test_missing_gl_backend_does_not_break_import(value: str) -> None:
    program = "import cellwright; print(cellwright.Cell.__name__)"
    ran = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "MUJOCO_GL": value},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "Cell\n", "")


@pytest.mark.skipif(sys.platform != "linux", reason="other libraries there")
@pytest.mark.parametrize(
    ("value", "found", "settled"),
    [("EGL", "libEGL.so.1", "EGL"), ("egl", None, "disable"), ("glfw", None, "glfw"), ("cgl", None, "disable")],
)
def test_gl_value_stays_if_its_library_exists(
    monkeypatch: pytest.MonkeyPatch, value: str, found: str | None, settled: str
) -> None:
    monkeypatch.setenv("MUJOCO_GL", value)
    monkeypatch.setattr(mujoco_gl, "find_library", {"EGL": found}.get)
    mujoco_gl.settle()
    assert os.environ["MUJOCO_GL"] == settled
