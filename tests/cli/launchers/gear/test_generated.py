"""Tests of the files that describe the started cell."""

import os
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from cellwright.cell.interface.parameters import robot_description
from cellwright.cli.launchers.gear.launcher import launch_files, parse, resolved_text, write_launch_files
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import Loaded, load_trial, resolved
from cellwright.util.errors import UsageError


@pytest.fixture(scope="module")
def sample() -> Loaded:
    return load_trial([find_trial("sample")])


def test_launch_files_have_names_and_content_of_original(sample: Loaded) -> None:
    files = launch_files(sample, "time_limit: -1\n", competition=True)
    assert list(files) == ["config.yaml", "gear.yaml", "gear.urdf", "gear.launch"]
    assert files["config.yaml"] == "time_limit: -1\n"
    assert files["gear.urdf"] == robot_description(sample.trial)


def test_resolved_configuration_is_complete(sample: Loaded) -> None:
    facts = yaml.safe_load(resolved_text(sample))
    expected = resolved(sample)
    assert {key: facts[key] for key in expected} == yaml.safe_load(yaml.safe_dump(expected))
    assert facts["arm"] is True
    camera = facts["sensors"]["logical_camera_over_agv1"]
    assert camera["type"] == "logical_camera"
    assert camera["xyz"] == [0.3, 3.15, 1.5]
    assert camera["rpy"] == pytest.approx([0.0, 1.5707963, 0.0], abs=1e-6)


def test_resolved_empty_cell_has_no_arm_and_sensors() -> None:
    facts = yaml.safe_load(resolved_text(load_trial(text="")))
    assert (facts["arm"], facts["sensors"], facts["models"]) == (False, {}, [])


@pytest.mark.parametrize("competition", [True, False])
@pytest.mark.parametrize("verbose", [True, False])
def test_launch_file_repeats_the_options(sample: Loaded, *, competition: bool, verbose: bool) -> None:
    files = launch_files(sample, "", competition=competition, verbose=verbose)
    (node,) = ET.fromstring(files["gear.launch"]).iter("node")
    assert (node.get("pkg"), node.get("type")) == ("osrf_gear", "gear.py")
    arguments = node.get("args", "").replace("$(dirname)", "/there").split()
    again = parse(arguments, {})
    assert again.file == ["/there/config.yaml"]
    assert (again.competition, again.verbose) == (competition, verbose)


def test_launch_files_replace_older_ones(tmp_path: Path) -> None:
    write_launch_files({"a": "one\n"}, tmp_path / "deep" / "down")
    write_launch_files({"a": "two\n"}, tmp_path / "deep" / "down")
    assert (tmp_path / "deep" / "down" / "a").read_text() == "two\n"


def test_unwritable_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match=f"^{tmp_path}{os.sep}file: cannot be written: "):
        write_launch_files({"a": ""}, tmp_path / "file")
