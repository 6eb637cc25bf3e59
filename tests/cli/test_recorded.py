"""Tests of `--record` on all commands that run something."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from cellwright.recording.format.format import COMMAND
from cellwright.recording.format.reader import RecordingFile
from tests.cli.conftest import CommandLine
from tests.support.quick_children import QUICK_AGENTS

SHORT = ("--until", "0.1", "--agent", "none", "--no-picture")
ROBOT = ("teleop", "tandem", "--sim-time", "--speed", "max", "--until", "0.25", "--port", "0")


def test_recorded_run_has_same_state_hash(cellwright: CommandLine) -> None:
    bare = json.loads(cellwright("run", "lesson", *SHORT, "--json", "--vary").out)
    ran = cellwright("run", "lesson", *SHORT, "--json", "--vary", "--record", "a.mcap", "--record", "a.bag")
    document = json.loads(ran.out)
    assert ran.status == 0
    assert document["recordings"] == ["a.mcap", "a.bag"]
    assert document["state_hash"] == bare["state_hash"]
    with RecordingFile("a.mcap") as recording:
        assert recording.end is not None
        assert recording.end["state_hash"] == bare["state_hash"]
        assert recording.header.facts["varied"] is True
        assert list(recording.sources) == recording.header.facts["files"]
    assert "recording   b.mcap\n" in cellwright("run", "lesson", *SHORT, "--record", "b.mcap").out


def test_mcap_library_decodes_every_channel(cellwright: CommandLine) -> None:
    cellwright("run", "lesson", *SHORT, "--record", "cell.mcap")
    cellwright(*ROBOT, "--record", "robot.mcap")
    for name in ("cell.mcap", "robot.mcap"):
        with RecordingFile(name) as recording, Path(name).open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            found = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
            summary = reader.get_summary()
            assert found == recording.counts
            assert summary is not None
            assert {each.topic for each in summary.channels.values()} == set(recording.topics)
            assert all(each.encoding == "ros2msg" and each.data for each in summary.schemas.values())
            if name == "cell.mcap":
                assert found["/tf"] > 0
                assert found["/tf_static"] == 1


@QUICK_AGENTS
@pytest.mark.slow
def test_run_of_remote_agent_is_recorded(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright(
        "run",
        "lesson",
        "--agent",
        f"{agents}:Ends",
        "--over",
        "socket",
        "--lockstep",
        "--no-picture",
        "--record",
        "a.mcap",
    )
    assert ran.status == 0
    with RecordingFile("a.mcap") as recording:
        commands = [(each.name, each.node) for each in recording.commands()]
    assert commands == [("/ariac/start_competition", "/agent"), ("/ariac/end_competition", "/agent")]
    assert COMMAND in recording.topics


def test_served_cell_is_recorded(cellwright: CommandLine) -> None:
    ran = cellwright(
        "serve", "lesson", "--speed", "max", "--until", "0.1", "--port", "0", "--json", "--record", "a.mcap"
    )
    assert json.loads(ran.out)["recordings"] == ["a.mcap"]
    with RecordingFile("a.mcap") as recording:
        assert recording.header.facts["agent"] == "served"
        assert recording.end_time == 100_000_000


def test_robot_node_is_recorded(cellwright: CommandLine) -> None:
    ran = cellwright(*ROBOT, "--max-age", "2", "--json", "--record", "a.mcap", "--record", "a.bag")
    document = json.loads(ran.out)
    assert document["recordings"] == ["a.mcap", "a.bag"]
    with RecordingFile("a.mcap") as recording:
        assert (recording.header.kind, recording.header.name) == ("robot", document["robot"])
        facts = recording.header.facts
        assert (facts["safety"]["max_age"], facts["sim_time"], facts["driver"]) == (2.0, True, False)
        assert facts["files"][0] in recording.sources
        assert len(recording.sources) == 2
        assert recording.counts["/io_teleop/joint_states"] == 25
        assert recording.end == {"outcome": "until", "error": "", "wall": document["wall"]}
    assert "recording   b.mcap\n" in cellwright(*ROBOT, "--record", "b.mcap").out


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        (["a.txt"], "--record a.txt: give a file such as run.mcap"),
        (["a.mcap", "b.mcap"], "b.mcap: only one .mcap file is possible"),
        (["none/a.mcap"], "--record none/a.mcap: there is no folder none"),
    ],
)
def test_invalid_record_file_prints_one_line_and_exits_with_2(
    files: list[str], reason: str, cellwright: CommandLine
) -> None:
    ran = cellwright("run", "lesson", *SHORT, *(word for file in files for word in ("--record", file)))
    assert (ran.status, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert reason in ran.err
    assert not list(Path().glob("*.mcap"))
