"""The page of the benchmark: its commands print what it shows."""

import glob
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from kitting.clone.agent import FOLDER
from tests.docs.pages import Command, missing, steps

ROOT = Path(__file__).parents[2]
BUILD = "build/kitting"


@pytest.mark.slow
def test_commands_of_page_print_what_it_shows(tmp_path: Path) -> None:
    taken = [step for step in steps(ROOT / "docs" / "kitting.md") if isinstance(step, Command)]
    assert len(taken) == 8
    environment = {name: value for name, value in os.environ.items() if name != FOLDER}
    environment |= {"COLUMNS": "120", "OPENBLAS_NUM_THREADS": "1"}  # two threads wait for each other most of the time
    for step in taken:
        program, *words = shlex.split(step.line.replace(BUILD, str(tmp_path)))
        if program == "python":
            _, name, *words = words
            words += [] if words[0] == "tasks" else ["--out", str(tmp_path)]
        else:
            name = program
            words = [found for word in words for found in (sorted(glob.glob(word)) if "*" in word else [word])]
        # their own processes are started by commands, which are not what is tested
        ran = subprocess.run(
            [sys.executable, "-m", name, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
        )
        assert ran.returncode == 0, ran.stderr
        output = tuple(line.replace(BUILD, str(tmp_path)) for line in step.output)
        assert missing(output, ran.stdout + ran.stderr) is None, f"{step.line}\n{ran.stdout}{ran.stderr}"
