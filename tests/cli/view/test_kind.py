"""Tests of the kind of a name to view."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cli.view import TargetKind, kind_of
from cellwright.util.errors import UsageError

TRIAL = "options: {insert_agvs: true}\ntime_limit: 500\n"
ROBOT = "urdf_path: robot.urdf\n"
URDF = '<robot name="r"><link name="a"/></robot>'


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("lesson", TargetKind.TRIAL),
        ("no_such_thing", TargetKind.TRIAL),  # reported as an unknown trial then
        ("qinglong", TargetKind.ROBOT),
        ("run.mcap", TargetKind.RECORDING),
        (f"{'n' * 300}.mcap", TargetKind.RECORDING),
        ("RUN.MCAP", TargetKind.RECORDING),
        ("127.0.0.1:11399", TargetKind.ADDRESS),
        ("lab-pc:8", TargetKind.ADDRESS),
        ("[::1]:11399", TargetKind.ADDRESS),
    ],
)
def test_kind_of_names_and_addresses(word: str, kind: TargetKind) -> None:
    assert kind_of([word]) is kind


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.yaml", TRIAL, TargetKind.TRIAL),
        ("a.yaml", ROBOT, TargetKind.ROBOT),
        ("vr_configs.yml", ROBOT, TargetKind.ROBOT),
        ("r.urdf", URDF, TargetKind.ROBOT),
        ("broken.yaml", "{", TargetKind.TRIAL),
    ],
)
def test_kind_of_file_depends_on_its_content(name: str, text: str, kind: TargetKind, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    assert kind_of([str(tmp_path / name)]) is kind


@pytest.mark.parametrize("name", ["plan.json", "results.jsonl"])
def test_folder_with_results_is_an_evaluation(tmp_path: Path, name: str) -> None:
    folders = [str(tmp_path / each) for each in ("1", "2")]
    for folder in folders:
        Path(folder).mkdir()
        Path(folder, name).touch()
    assert kind_of(folders) is TargetKind.EVALUATION
    with pytest.raises(UsageError, match="cannot be joined"):
        kind_of([folders[0], "lesson"])


def test_folder_is_a_robot(tmp_path: Path) -> None:
    assert kind_of([str(tmp_path)]) is TargetKind.ROBOT


def test_existing_file_with_colon_is_not_an_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trial:1").write_text(TRIAL)
    assert kind_of(["trial:1"]) is TargetKind.TRIAL


def test_only_files_of_a_trial_are_joined() -> None:
    assert kind_of(["final01", "kitter_sensors"]) is TargetKind.TRIAL
    with pytest.raises(UsageError, match="qinglong: cannot be joined"):
        kind_of(["lesson", "qinglong"])
