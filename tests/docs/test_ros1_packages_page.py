"""The page on ROS 1 packages: its options, files and launch file are the launcher's."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from cellwright.cli.launchers.gear.launcher import launch_files, parse
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.ros1.packages.contents import PACKAGES, package_files

PAGE = (Path(__file__).parents[2] / "docs" / "ros1-packages.md").read_text(encoding="utf-8")


def test_table_of_options_equals_launcher_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["--help"], {})
    taken = set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out)) - {"--help"}
    table = PAGE[PAGE.index("| option |") : PAGE.index("A configuration that cannot be used")]
    assert set(re.findall(r"--[a-z][a-z-]+", table)) == taken


def test_table_of_files_equals_written_files() -> None:
    table = PAGE[PAGE.index("| file |") : PAGE.index("The score goes to")]
    names = re.findall(r"^\| `([^`]+)`", table, re.MULTILINE)
    assert names == list(launch_files(load_trial(text=""), "", competition=True))


def test_launch_file_of_page_starts_existing_program() -> None:
    found = re.search(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    assert found
    (node,) = ET.fromstring(found[1]).iter("node")
    files = package_files(str(node.get("pkg")), Path("bin"))
    assert f"script/{node.get('type')}" in files
    arguments = parse(str(node.get("args")).split(), {})
    assert not arguments.competition
    # `$(find osrf_gear)/config/sample.yaml` is in two words here, as roslaunch has not replaced it
    assert f"config/{Path(arguments.file[-1]).name}" in files


def test_named_packages_and_files_exist() -> None:
    for package in ("osrf_gear", "control_msgs", "ariac_example"):
        assert f"`{package}`" in PAGE
        assert package in PACKAGES
    example = package_files("ariac_example", Path("bin"))
    for path in re.findall(r"`ariac_example/(\S+?)`", PAGE):
        assert path in example, path
