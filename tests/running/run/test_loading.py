"""Tests of trials and robots in one line each, and of the words for a target."""

from __future__ import annotations

from pathlib import Path

import pytest

import cellwright
from cellwright.config.trial.catalogue import find_trial
from cellwright.running.run import DescriptionWarning, Session
from cellwright.util.errors import DescriptionError, UnknownNameError, UsageError

UNKNOWN_OPTION = "arm: {type: ur10}\noptions: {insert_agv: true}\n"


def test_load_trial_takes_name_path_or_text() -> None:
    by_name = cellwright.load_trial("lesson")
    assert by_name == cellwright.load_trial(find_trial("lesson"))
    assert by_name == cellwright.load_trial(str(find_trial("lesson")))
    assert by_name.orders
    assert cellwright.load_trial(text="time_limit: 7").time_limit == 7.0


def test_load_trial_joins_several_files() -> None:
    assert not cellwright.load_trial("final01").has_arm
    assert cellwright.load_trial("final01", "kitter_sensors").has_arm


def test_invalid_trial_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="lesson"):
        cellwright.load_trial("leson")
    with pytest.raises(UsageError):
        cellwright.load_trial()
    with pytest.raises(UsageError):
        cellwright.load_trial("lesson", text="")
    with pytest.raises(DescriptionError, match="arm"):
        cellwright.load_trial(text="arm: 3")


def test_notes_for_author_are_warnings_at_caller(tmp_path: Path) -> None:
    file = tmp_path / "trial.yaml"
    file.write_text(UNKNOWN_OPTION)
    with pytest.warns(DescriptionWarning, match="insert_agvs") as warned:
        cellwright.load_trial(file)
    assert warned[0].filename == __file__
    with pytest.warns(DescriptionWarning, match="insert_agvs") as warned:
        cellwright.run_trial(file, None, options=cellwright.RunOptions(until=0.01))
    assert warned[0].filename == __file__


def test_load_robot_takes_name_or_file(tmp_path: Path) -> None:
    config = cellwright.load_robot("tandem")
    assert config.name == "tandem"
    file = tmp_path / "vr_configs.yml"
    file.write_text(f"urdf_path: {config.urdf_path.as_posix()}\nroboname: x\n")
    with pytest.warns(DescriptionWarning, match="robot_name") as warned:
        assert cellwright.load_robot(file).name == "tandem"
    assert warned[0].filename == __file__
    with pytest.raises(UnknownNameError, match="tandem"):
        cellwright.load_robot("tandm")


def test_unknown_target_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="lesson"):
        Session("leson").run(until=0.1)
