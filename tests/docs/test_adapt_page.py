"""The page that leads from a URDF to a moving robot can be followed from its first line to its last."""

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from tests.docs.pages import steps
from tests.docs.robot_pages import at, shell
from tests.docs.session import follow
from tests.ros2.ground import Ground
from tests.ros2.requirement import installation
from tests.support.ports import free_port
from tests.support.processes import Process
from tests.support.warm import WarmStart

pytest_plugins = ["tests.ros2.fixtures"]

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "adapt-a-robot.md"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix" or shutil.which("setsid") is None, reason="needs terminals")
def test_adapt_page_followed_in_terminals_prints_what_it_shows(tmp_path: Path, warm: WarmStart) -> None:
    home, programs = tmp_path / "home", tmp_path / "bin"
    shutil.copytree(ROOT / "docs" / "examples" / "adapt_a_robot", home)
    shutil.copy(ROOT / "examples" / "my_driver.py", home)
    programs.mkdir()
    modules = f"PYTHONPATH={shlex.quote(str(ROOT / 'src'))} exec {shlex.quote(sys.executable)}"
    (programs / "python").write_text(f'#!/bin/sh\n{modules} "$@"\n')
    (programs / "python").chmod(0o755)
    port = free_port()
    with shell(home, programs, warm) as environment:
        follow([at(port, step) for step in steps(PAGE)], home, environment)
    assert (home / "picker.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.ros2
def test_robot_of_page_is_driven_from_ros2(domain: Ground) -> None:
    text = PAGE.read_text(encoding="utf-8")
    (config,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (program,) = re.findall(r"```python\n(import rclpy.*?)```", text, re.DOTALL)
    home = shutil.copytree(ROOT / "docs" / "examples" / "adapt_a_robot", domain.folder / "cell")
    (home / "vr_configs.yml").write_text(config.replace("rol]", "roll]"))
    (home / "wave.py").write_text(program)
    domain.teleop("vr_configs.yml")
    found = installation()
    assert found is not None
    wave = Process([found.python, "wave.py"], domain.environment, home)
    assert wave.finish() == 0, wave.said
    assert wave.out == "turn: 0.80\nturn: -0.80\nturn: 0.40\n"
