"""Tests of `cellwright replay`: its listing, its playback, and its refusals."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.rosbag1 import Reader

import cellwright as package
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.recording.format import format as names
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from tests.cli.conftest import CommandLine
from tests.recording.replay.made import record, short_work
from tests.support.processes import Process
from tests.support.warm import warm_start

LENGTH = 3.0  # [s], approximate, of the recording


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("cli_replay") / "run.mcap", short_work)


def test_content_is_printed_as_table(cellwright: CommandLine, path: Path) -> None:
    ran = cellwright("replay", str(path))

    assert (ran.status, ran.err) == (0, "")
    assert ran.out.startswith(f"cell lesson, recorded in {path}\n")
    assert re.search(
        r"^/ariac/joint_states +out +1\d\d +(50|49\.\d|50\.\d) +sensor_msgs/JointState *$", ran.out, re.MULTILINE
    )
    assert re.search(r"^/ariac/arm/command +in +1 +trajectory_msgs/JointTrajectory *$", ran.out, re.MULTILINE)
    assert "/cellwright/frame" not in ran.out
    assert re.search(r"^ended +complete: done$", ran.out, re.MULTILINE)
    assert re.search(r"^versions +cellwright ", ran.out, re.MULTILINE)
    assert re.search(r"^verify +\d+ state hash", ran.out, re.MULTILINE)


def test_content_is_printed_as_json(cellwright: CommandLine, path: Path) -> None:
    ran = cellwright("replay", str(path), "--json")

    contents = json.loads(ran.out)
    assert (ran.status, ran.err) == (0, "")
    assert (contents["kind"], contents["name"], contents["complete"]) == ("cell", "lesson", True)
    assert contents["duration"] == pytest.approx(LENGTH, abs=0.2)
    assert contents["header"]["versions"]["mujoco"]
    assert contents["commands"] >= 3
    assert contents["state_hashes"] in (3, 4)
    topics = {topic["name"]: topic for topic in contents["topics"]}
    assert topics["/ariac/joint_states"]["measured"] == pytest.approx(50, abs=1)
    assert topics["/ariac/orders"]["latch"]
    assert topics["/cellwright/command"]["own"]


def test_truncated_file_is_reported(cellwright: CommandLine, path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: 2 * len(data) // 3])

    ran = cellwright("replay", str(cut))

    assert ran.status == 0
    assert re.fullmatch(rf"warning: {re.escape(str(cut))}: cut short; ends at \d+\.\d{{3}} s\n", ran.err)
    assert re.search(r"^ended +cut short", ran.out, re.MULTILINE)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["no.mcap"], "no.mcap: cannot be read: No such file or directory"),
        (["."], ".: cannot be read"),
        (["text.mcap"], "text.mcap: not an MCAP file"),
        (["PATH", "--serve", "--speed", "0"], "--speed 0: give a factor above 0"),
        (["PATH", "--serve", "--port", "70000"], "port must be from 0 to 65535"),
        (["PATH", "--serve", "--start", "-1"], "--start -1: give a time from 0 s"),
        (["PATH", "--serve", "--start", "500"], "--start 500: PATH ends at "),
        (["PATH", "--view", "--start", "0.2", "--until", "0.1"], "--until 0.1: is before --start 0.2"),
        (["PATH", "--video", "run.mp4", "--start", "500"], "--start 500: PATH ends at "),
        (["PATH", "--loop"], "--loop requires --view, --serve, --ros1 or --ros2"),
        (["PATH", "--start", "1"], "--start requires --view, --serve, --ros1 or --ros2, or --bag"),
        (["PATH", "--bag", "run.bag", "--start", "1000"], "--start 1000: PATH ends at "),
        (["PATH", "--verify", "--view"], "--verify plays nothing"),
        (["PATH", "--bag", "run.txt"], "--bag run.txt: give a file whose name ends in .bag"),
        (["PATH", "--bag", "no/run.bag"], "--bag no/run.bag: there is no folder no"),
        (["PATH", "--mcap", "run.txt"], "--mcap run.txt: give a file whose name ends in .mcap"),
        (["PATH", "--mcap", "PATH"], "is the recording itself"),
        (["PATH", "--mcap", "out.mcap", "--start", "100"], "--start 100: PATH ends at "),
        (["PATH", "--view-port", "8080"], "--view-port requires --view"),
        (["PATH", "--serve", "--loop", "--hold"], "--loop and --hold: give one of them"),
    ],
)
def test_invalid_input_prints_one_line(
    arguments: list[str], reason: str, cellwright: CommandLine, path: Path, tmp_path: Path
) -> None:
    (tmp_path / "text.mcap").write_text("kind: trial\n" * 100)

    ran = cellwright("replay", *(str(path) if each == "PATH" else each for each in arguments))

    assert (ran.status, ran.out) == (2, "")
    assert reason.replace("PATH", str(path)) in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.slow
def test_client_on_socket_receives_recorded_messages(path: Path) -> None:
    command = [sys.executable, "-m", "cellwright", "replay", str(path), "--serve", "--hold", "--port", "0"]
    player = Process(command, os.environ, path.parent, warm=warm_start())
    try:
        address = player.wait_for("^.+$")[0].split()[3].rstrip(",")
        client = package.Client.connect(address, node="/me")
        client.wait_until(lambda: client.time > LENGTH / 2)
        newest, orders = client.joint_states.message, [order.order_id for order in client.orders]
        with pytest.raises(package.errors.CellwrightError, match="a recording is read-only"):
            client.control_gripper(True)
        client.close()
        player.signal(signal.SIGTERM)
        status = player.finish()
    finally:
        player.kill()

    assert status == 0
    assert orders == ["order_0"]
    with RecordingFile(path) as recording:
        recorded = [recording.decode(each) for each in recording.messages(["/ariac/joint_states"])]
    assert TYPES.to_cdr(newest) in [TYPES.to_cdr(each) for each in recorded]


@pytest.mark.slow
def test_bag_contains_recorded_messages(cellwright: CommandLine, path: Path) -> None:
    ran = cellwright("replay", str(path), "--bag", "run.bag")

    assert (ran.status, ran.out, ran.err) == (0, "bag         run.bag\n", "")
    with Reader("run.bag") as bag, RecordingFile(path) as recording:
        counts = {each.topic: each.msgcount for each in bag.connections}
        assert counts["/ariac/joint_states"] == recording.counts["/ariac/joint_states"] > 100


def test_bag_of_time_range_contains_only_that_range(cellwright: CommandLine, path: Path) -> None:
    ran = cellwright("replay", str(path), "--bag", "run.bag", "--start", "0.2", "--until", "0.4")

    assert (ran.status, ran.out, ran.err) == (0, "bag         run.bag\n", "")
    with Reader("run.bag") as bag, RecordingFile(path) as recording:
        times = [time for _, time, _ in bag.messages()]
        found = sum(each.msgcount for each in bag.connections if each.topic == "/ariac/joint_states")
        recorded = recording.messages(["/ariac/joint_states"], start=200_000_000, until=400_000_001)
        assert found == len(list(recorded)) > 5
    assert min(times) >= 200_000_000
    assert max(times) <= 400_000_000


def test_mcap_of_time_range_contains_only_that_range(cellwright: CommandLine, path: Path) -> None:
    ran = cellwright("replay", str(path), "--mcap", "seen.mcap", "--start", "1", "--until", "1.5")

    assert (ran.status, ran.out, ran.err) == (0, "mcap        seen.mcap\n", "")
    with Path("seen.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (
        1_000_000_000,
        1_500_000_000,
    )
    assert {"/cellwright/markers", "/cellwright/tf"} <= {each.topic for each in summary.channels.values()}


def test_control_characters_of_hostile_recording_are_escaped(cellwright: CommandLine) -> None:
    bad = "go\x1b[2J\nof"
    with McapFile(Path("a.mcap")) as file:
        facts = {"agent": bad, "seed": bad, "versions": {bad: bad}}
        file.describe(names.METADATA, RecordingHeader("cell", bad, facts).metadata())
        talk = file.channel(RecordedTopic(f"/{bad}", "std_msgs/String", node=bad))
        end = file.channel(RecordedTopic(names.END, names.TEXT))
        file.add(talk, 0, TYPES.to_cdr(String(bad)))
        file.add(end, 10**9, TYPES.to_cdr(String(json.dumps({"outcome": bad}))))

    ran = cellwright("replay", "a.mcap")

    assert (ran.status, ran.err) == (0, "")
    lines = ran.out.split("\n")
    assert lines[0] == r"cell go\x1b[2J of, recorded in a.mcap"
    assert all(map(str.isprintable, lines))
    assert [line.partition(" ")[0] for line in lines if line.startswith(("/", "ended", "agent"))] == [
        r"/go\x1b[2J",
        "ended",
        "agent",
    ]
