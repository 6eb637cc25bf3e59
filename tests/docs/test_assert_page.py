"""The page about assertions: its tests pass under pytest, and its program prints what it finds."""

import shlex
from pathlib import Path

import pytest

from tests.docs.pages import Command, File, Program, missing, steps
from tests.running.pytest_project import run_pytest
from tests.support.warm import WarmStart

PAGE = Path(__file__).parents[2] / "docs" / "assert.md"


@pytest.mark.slow
def test_page_followed_prints_what_it_shows(tmp_path: Path, warm: WarmStart) -> None:
    taken = steps(PAGE)
    assert [type(step) for step in taken] == [File, Command, File, Command, Program]
    for step in taken:
        match step:
            case File(name, text):
                (tmp_path / name).write_text(text, encoding="utf-8")
            case Command(line, output, status):
                command, *arguments = shlex.split(line)
                assert command == "pytest"
                done = run_pytest(tmp_path, *arguments, is_fresh=True)
                assert (done.returncode, missing(output, done.stdout)) == (status, None), done.stdout
            case Program(text):
                ran = warm.run(text, folder=tmp_path)
                assert ran.returncode == 0, ran.stderr
                assert "bin7|piston_rod_part_5: 2.60 to 5.70 s" in ran.stdout
