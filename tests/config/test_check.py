"""Report on files, for people and for programs."""

import json
import os
import re
from pathlib import Path

import pytest

from cellwright.config.check import check
from cellwright.config.parsing.overrides import Override
from cellwright.config.robot.robots import find_robot
from cellwright.config.trial.catalogue import bundled, bundled_sensors, find_trial
from cellwright.util.errors import UnknownNameError, UsageError

WARNED = {"comp_conf1": 1, "comp_conf2": 2}
"""Sections without effect in the public trial too, which stay for the part numbers that they use."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*bundled(), *bundled_sensors()])
def test_bundled_files_give_only_known_warnings(name: str) -> None:
    report = check([find_trial(name)])
    assert report.ok
    assert len(report.warnings) == WARNED.get(name, 0)
    assert all("models_to_spawn" in warning for warning in report.warnings)


def test_warning_is_in_lines_and_data(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("options:\n  insert_agv: true\n")
    report = check([path])
    text = f"{path}:2: options.insert_agv: unknown option, ignored; did you mean insert_agvs"
    assert report.lines() == [f"warning: {text}", "ok"]
    data = json.loads(json.dumps(report.as_dict()))
    assert data["ok"] is True
    assert (data["errors"], data["warnings"]) == ([], [text])
    assert data["resolved"]["time_limit"] == 500


def test_errors_come_before_warnings_and_count(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("option: {}\noptions: {insert_agv: 1}\ntime_limit: x\n")
    report = check([path])
    assert not report.ok
    assert report.lines() == [
        f"error: {path}:1: option: unknown top-level entry; did you mean options",
        f"error: {path}:3: time_limit: must be a number (got the text 'x')",
        f"warning: {path}:2: options.insert_agv: unknown option, ignored; did you mean insert_agvs",
        "2 errors",
    ]
    assert report.as_dict()["resolved"] is None


def test_missing_file_is_one_error(tmp_path: Path) -> None:
    assert check([tmp_path / "no.yaml"]).lines()[-1] == "1 error"


def test_find_trial_prefers_path_and_suggests_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "lesson" in bundled()
    assert find_trial("lesson").name == "lesson.yaml"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lesson").write_text("{}")
    assert find_trial("lesson") == Path("lesson")
    with pytest.raises(UnknownNameError, match="unknown trial 'leson'; did you mean lesson"):
        find_trial("leson")


def test_overrides_are_resolved_and_refused_for_a_robot() -> None:
    override = Override.read("time_limit=60", "--set")
    report = check([find_trial("lesson")], [override])
    assert report.resolved is not None
    assert report.resolved["time_limit"] == 60
    with pytest.raises(UsageError, match=r"^--set: .* is a robot's; give the files of a trial$"):
        check([find_robot("tandem")], [override])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
@pytest.mark.parametrize("name", ["robot", "robot.yaml", "robot.urdf", "robot.xacro"])
def test_named_pipe_is_an_error_without_waiting(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    report = check([tmp_path / name])
    assert not report.ok
    assert re.search("it is a named pipe, not a file|not a regular file", report.lines()[0])


@pytest.mark.parametrize("content", ["", "\n\n", "# nothing yet\n", "---\n# nothing\n...\n", "\ufeff"])
def test_file_without_content_is_an_error(tmp_path: Path, content: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(content, encoding="utf-8")
    message = "the file is empty, or has comments only; write the sections of a trial, or {} for an empty cell"
    assert check([path]).lines() == [f"error: {path}: {message}", "1 error"]
    path.write_text("{}")
    assert check([path]).ok


@pytest.mark.parametrize("name", ["final01", "final13", "sample", "qual3b"])
def test_trial_without_indentation_is_one_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.yaml"
    lines = find_trial(name).read_text().splitlines()
    path.write_text("\n".join(line.lstrip() for line in lines))
    (error,) = check([path]).errors
    assert error.endswith("below it is no section; indent the entries of each section")


def test_empty_section_before_unknown_one_is_reported_as_such(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("options:\ntime_limt: 3\n")
    assert len(check([path]).errors) == 2


def test_git_lfs_pointer_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    message = "a Git LFS pointer, not the file itself; fetch the file with: git lfs pull"
    assert check([path]).lines() == [f"error: {path}: {message}", "1 error"]


def test_xacro_arguments_are_used_and_refused_for_a_trial(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    path.write_text('<robot name="r"><link name="$(arg side)_arm"/></robot>')
    assert check([path], arguments={"side": "left"}).ok
    assert check([path]).errors[0].endswith("give one as side:=VALUE")
    with pytest.raises(UsageError, match=r"^side:=left: only a robot's xacro file has arguments$"):
        check([find_trial("lesson")], arguments={"side": "left"})
