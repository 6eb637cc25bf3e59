"""Tests of robots as targets of a session."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import cellwright
from cellwright.config.robot.config import RobotConfig
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.robot.node import RobotNode
from cellwright.running.run import Session
from cellwright.running.run.robots import RobotTarget


def test_recording_of_loaded_robot_keeps_its_files_while_they_describe_it(tmp_path: Path) -> None:
    loaded = cellwright.load_robot("tandem")
    named = ["bundled/config/robot/catalogue/tandem/vr_configs.yml"]
    robots: list[tuple[RobotConfig | RobotNode, list[str]]] = [
        (loaded, named),
        (RobotNode(loaded), named),
        (replace(loaded, name="mine"), []),
    ]
    for number, (robot, names) in enumerate(robots):
        file = tmp_path / f"{number}.mcap"
        with Session(robot, record=file) as session:
            session.run(until=0.1)
        with RecordingFile(file) as recording:
            assert recording.header.facts["files"] == names


def test_recording_of_robot_keeps_arguments_of_its_xacro_file(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text('<robot name="r"><link name="$(arg side)_arm"/></robot>')
    load = partial(cellwright.load_robot, tmp_path / "arm.xacro", xacro_arguments={"side": "left"})
    with Session(RobotTarget.of(load, is_real_time=False), record=tmp_path / "robot.mcap") as session:
        session.run(until=0.1)
    with RecordingFile(tmp_path / "robot.mcap") as recording, rebuild(recording) as rebuilt:
        assert isinstance(rebuilt.served, RobotNode)
        assert rebuilt.served.config.robot.root == "left_arm"
