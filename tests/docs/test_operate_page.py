"""The page about operators can be followed from its first line to its last."""

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tests.docs.pages import Command, Program, Step, steps
from tests.docs.session import follow
from tests.ports import free_port
from tests.waiting import TIMEOUT

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "operate.md"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix" or shutil.which("setsid") is None, reason="needs terminals")
def test_the_page_can_be_followed(tmp_path: Path) -> None:
    home, programs = tmp_path / "home", tmp_path / "bin"
    home.mkdir()
    programs.mkdir()
    modules = f"PYTHONPATH={shlex.quote(str(ROOT / 'src'))} exec {shlex.quote(sys.executable)}"
    (programs / "cellwright").write_text(f'#!/bin/sh\n{modules} -m cellwright "$@"\n')
    (programs / "cellwright").chmod(0o755)
    environment = {"PATH": f"{programs}:{os.environ['PATH']}", "HOME": str(home), "COLUMNS": "100", "LANG": "C.UTF-8"}
    port = free_port()
    follow([_at(step, port) for step in steps(PAGE)], home, environment)


def _at(step: Step, port: int) -> Step:
    """A step with a port of the test's own in place of the one that a single robot has."""
    if not isinstance(step, Command):
        return step
    more = {"cellwright teleop": f" --port {port}", "cellwright operate": f" --connect 127.0.0.1:{port}"}
    return replace(
        step, line=step.line + next((what for start, what in more.items() if step.line.startswith(start)), "")
    )


@pytest.mark.slow
def test_its_program_runs() -> None:
    (program,) = [step for step in steps(PAGE) if isinstance(step, Program)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    ran = subprocess.run(
        [sys.executable, "-c", program.text],
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.endswith(" ms late\n")
    assert 30 <= int(ran.stdout.split()[0]) <= 60
