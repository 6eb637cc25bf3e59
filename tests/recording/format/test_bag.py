"""ROS 1 bag of a recording."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from rosbags.rosbag1 import Reader

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.middleware.ros1.host.installation import find_system
from cellwright.middleware.ros1.packages.tree import ensure_tree, variables
from cellwright.recording.format.bag import write_bag
from cellwright.recording.format.format import END, TEXT, RecordedTopic
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.run import Session
from cellwright.util.errors import RecordingError, UsageError
from tests.clients.client.test_pictures import TRIAL as SEEING
from tests.recording.format.files import TALK, text, write
from tests.ros1.requirement import system_path
from tests.support.waiting import TIMEOUT


def test_bag_has_all_messages_of_recording(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 40)
    (tmp_path / "a.bag").write_text("an older one")
    assert write_bag(tmp_path / "a.mcap", tmp_path / "a.bag") == []
    with Reader(tmp_path / "a.bag") as bag:
        topics = {each.topic: each for each in bag.connections}
        assert {name: (each.digest, each.ext.latching) for name, each in topics.items()} == {  # type: ignore[union-attr]
            "/talk": (TYPES.md5("std_msgs/String"), 1),
            "/shout": (TYPES.md5("std_msgs/String"), 0),
        }
        found = [(each.topic, time, TYPES.from_ros1(data, String).data) for each, time, data in bag.messages()]
    with RecordingFile(tmp_path / "a.mcap") as recording:
        expected = [(each.topic, max(1, each.time), recording.decode(each).data) for each in recording.messages()]
    assert found == expected
    assert found[0][1] == 1, "rosbag play skips messages at time 0"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.bag", "a.mcap"]


@pytest.mark.parametrize(("begin", "latched"), [(11, ["/talk"]), (10, []), (0, [])])
def test_bag_of_time_range_begins_with_latched_messages(begin: int, latched: list[str], tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 40)
    with RecordingFile(tmp_path / "a.mcap") as recording:
        every = [(each.topic, max(1, each.time)) for each in recording.messages()]
    first, last = every[begin][1], every[20][1]
    progress: list[float] = []
    write_bag(tmp_path / "a.mcap", tmp_path / "a.bag", start=first, until=last, on_progress=progress.append)
    with Reader(tmp_path / "a.bag") as bag:
        found = [(each.topic, time) for each, time, _ in bag.messages()]
    assert found == [*((topic, first) for topic in latched), *(each for each in every if first <= each[1] <= last)]
    assert progress[0] == 0.0


@pytest.mark.parametrize(("start", "until"), [(10**12, None), (None, -1), (200, 100)])
def test_bag_of_empty_time_range_is_refused(start: int | None, until: int | None, tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 40)
    with pytest.raises(UsageError, match="no messages in this time range"):
        write_bag(tmp_path / "a.mcap", tmp_path / "a.bag", start=start, until=until)
    assert [each.name for each in tmp_path.iterdir()] == ["a.mcap"]


def test_bag_leaves_out_types_unknown_in_ros1_and_own_topics(tmp_path: Path) -> None:
    with McapFile(tmp_path / "a.mcap") as file:
        file.describe("cellwright", {"format": "1", "kind": "cell", "name": "", "header": "{}"})
        for topic in (TALK, RecordedTopic("/marker", "visualization_msgs/Marker"), RecordedTopic(END, TEXT)):
            file.channel(topic)
        file.add(3, 1, text("{}"))
    assert write_bag(tmp_path / "a.mcap", tmp_path / "a.bag") == ["/marker"]
    with Reader(tmp_path / "a.bag") as bag:
        assert list(bag.topics) == ["/talk"]


def test_bag_with_invalid_path_or_source_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 3)
    with pytest.raises(UsageError, match="cannot be written"):
        write_bag(tmp_path / "a.mcap", tmp_path / "none" / "a.bag")
    with pytest.raises(RecordingError):
        write_bag(tmp_path / "none.mcap", tmp_path / "a.bag")
    assert [each.name for each in tmp_path.iterdir()] == ["a.mcap"]


@pytest.mark.ros1
def test_rosbag_reads_bag(tmp_path: Path) -> None:
    rosbag = shutil.which("rosbag") or "/usr/bin/rosbag"
    write(tmp_path / "a.mcap", 40)
    write_bag(tmp_path / "a.mcap", tmp_path / "a.bag")
    command = [rosbag, "info", "--yaml", str(tmp_path / "a.bag")]
    printed = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=True).stdout
    assert "messages: 40\n" in printed
    assert f"md5: {TYPES.md5('std_msgs/String')}" in printed
    assert "topic: /shout" in printed


@pytest.mark.ros1
def test_rosbag_check_finds_nothing_to_migrate(tmp_path: Path) -> None:
    """In the shell of `cellwright ros1-env`, of a whole cell with cameras, and of a robot."""
    ros = find_system()
    shell = variables(ensure_tree(ros, tmp_path / "cache"), ros, {"PATH": system_path()})
    with Session(SEEING, record=tmp_path / "cell.bag") as session:
        session.client().sleep(0.25)
    with Session("tandem", record=tmp_path / "robot.bag") as session:
        session.client("/operator").sleep(0.1)
    for name in ("cell", "robot"):
        command = ["/usr/bin/python3", "/usr/bin/rosbag", "check", str(tmp_path / f"{name}.bag")]
        ran = subprocess.run(command, env=shell, capture_output=True, text=True, timeout=TIMEOUT, check=True)
        assert ran.stdout.strip() == "Bag file does not need any migrations."
