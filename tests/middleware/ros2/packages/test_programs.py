"""Programs of an installation: their lines as they come, and the last ones of those that fail."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from cellwright.middleware.ros2.packages.programs import clean_environment, run
from cellwright.util.errors import UsageError


def test_lines_of_a_program_arrive_in_order() -> None:
    lines: list[str] = []
    run([sys.executable, "-c", "print('a'); print(); print('b', end='')"], "letters", os.environ, lines.append)
    assert lines == ["a", "", "b"]


def test_failed_program_shows_its_last_lines() -> None:
    program = "print('\\n'.join(map(str, range(99)))); raise SystemExit(1)"
    with pytest.raises(UsageError) as caught:
        run([sys.executable, "-c", program], "osrf_gear", os.environ)
    lines = str(caught.value).splitlines()
    assert lines[0] == f"osrf_gear: {Path(sys.executable).name} failed:"
    assert lines[1:] == [str(number) for number in range(79, 99)]


def test_program_that_cannot_be_started_is_named() -> None:
    with pytest.raises(UsageError, match=r"^pip: /no/such/program: cannot be started: No such file"):
        run(["/no/such/program"], "pip", os.environ)


def test_variables_of_another_ros2_are_left_out() -> None:
    variables = {"LD_LIBRARY_PATH": "/opt", "PYTHONPATH": "/opt", "PATH": "/bin"}
    assert clean_environment(variables) == {"PATH": "/bin"}
