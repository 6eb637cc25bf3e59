"""The page about operators can be followed from its first line to its last."""

import os
import shutil
from pathlib import Path

import pytest

from tests.docs.pages import Program, steps
from tests.docs.robot_pages import at, shell
from tests.docs.session import follow
from tests.support.ports import free_port
from tests.support.warm import WarmStart

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "operate.md"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix" or shutil.which("setsid") is None, reason="needs terminals")
def test_operate_page_followed_in_terminals_prints_what_it_shows(tmp_path: Path, warm: WarmStart) -> None:
    home = tmp_path / "home"
    home.mkdir()
    port = free_port()
    with shell(home, tmp_path / "bin", warm) as environment:
        follow([at(port, step) for step in steps(PAGE)], home, environment)


@pytest.mark.slow
def test_program_of_page_prints_measured_delay(tmp_path: Path, warm: WarmStart) -> None:
    (program,) = [step for step in steps(PAGE) if isinstance(step, Program)]
    ran = warm.run(program.text, folder=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.endswith(" ms late\n")
    assert 30 <= int(ran.stdout.split()[0]) <= 60
