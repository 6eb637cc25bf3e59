"""Tests of episodes of ROS bags: newest states and commands at one rate, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.recording.dataset.bagged import bag_episode
from cellwright.recording.dataset.episode import Episode
from cellwright.recording.dataset.export import export_recordings
from cellwright.recording.dataset.read import DataSet
from cellwright.recording.dataset.recorded import recorded_episode
from cellwright.recording.format.bag import write_bag
from cellwright.util.errors import RecordingError, UsageError
from tests.recording.dataset.bags import APPLIED, COMMANDS, GRIPPER_STATES, GRIPPERS, KINDS, STATES, Message, bag
from tests.recording.dataset.made import kitted

SENTENCE = "Lift it."
MOVES: list[Message] = [
    *((STATES, 10.0 + k / 100, {"lift": k / 100, "head": 0.5}) for k in range(101)),
    *((COMMANDS, 10.1 + k / 4, {"lift": 1.0 + k}) for k in range(3)),
]
"""Joint states for a second at 100 Hz, and a command each quarter of a second from 0.1 s on."""


def in_order(messages: list[Message]) -> list[Message]:
    return sorted(messages, key=lambda each: each[1])


def values(episode: Episode) -> dict[str, Any]:
    return {column.name: column.values for column in episode.columns}


@pytest.mark.parametrize("kind", KINDS)
def test_frame_has_the_newest_state_of_its_begin_and_command_of_its_end(kind: str, tmp_path: Path) -> None:
    episode = bag_episode(bag(tmp_path, in_order(MOVES), kind), 20, sentence=SENTENCE)
    assert (episode.robot, episode.sentence, episode.rate, episode.is_success) == ("io_teleop", SENTENCE, 20, False)
    assert [column.names for column in episode.columns[:2]] == [("lift", "head"), ("lift",)]
    found = values(episode)
    # it begins at once: until its first command a joint has its measured position
    np.testing.assert_allclose(found["observation.state"][:, 0], np.arange(20) * 0.05, atol=0.011)
    ends = (np.arange(20) + 1) * 0.05
    expected = [end if end < 0.1 else 1.0 + (end - 0.1 + 1e-9) // 0.25 for end in ends]
    np.testing.assert_allclose(found["action"][:, 0], np.minimum(expected, 3.0), atol=0.011)
    assert found["next.done"].tolist() == found["next.truncated"].tolist() == [False] * 19 + [True]
    assert {*found} == {"observation.state", "action", "next.done", "next.truncated"}


def test_executed_targets_are_taken_before_commands_and_grippers_by_their_order(tmp_path: Path) -> None:
    messages = [
        *MOVES,
        *((APPLIED, 10.0 + k / 100, {"lift": -1.0, "head": 0.25}) for k in range(101)),
        *((GRIPPER_STATES, 10.0 + k / 100, {"gripper_0": 0.5, "gripper_1": 0.0}) for k in range(101)),
        (GRIPPERS, 10.0, {"": 1.0}),
    ]
    episode = bag_episode(bag(tmp_path, in_order(messages)), 10, sentence=SENTENCE)
    state, action = episode.columns[:2]
    assert (episode.begin, len(episode.sha256)) == (10.0, 64)
    assert state.names == ("lift", "head", "gripper_right", "gripper_left")
    assert state.values[0].tolist() == [0.0, 0.5, 0.5, 0.0]
    assert action.names == ("lift", "head", "gripper_right")
    assert action.values.tolist() == [[-1.0, 0.25, 1.0]] * 10


def test_bag_of_a_cell_is_nearly_its_repeated_run(tmp_path: Path) -> None:
    path = kitted(tmp_path / "run.mcap", until=6.0)
    write_bag(path, tmp_path / "run.bag")
    repeated = recorded_episode(path, 20)
    episode = bag_episode(tmp_path / "run.bag", 20, sentence=SENTENCE)
    assert episode.robot == "ariac"
    exact, found = values(repeated), values(episode)
    names = repeated.columns[0].names
    places = [episode.columns[0].names.index(name) for name in names]
    count = min(len(exact["action"]), len(found["action"])) - 2
    states = found["observation.state"][:count, places]
    # messages are up to 20 ms old, the arm moves at most 3 rad/s, and the episode begins some ticks later
    np.testing.assert_allclose(states[:, :-1], exact["observation.state"][:count, :-1], atol=0.25)
    assert np.abs(states[:, :-1] - exact["observation.state"][:count, :-1]).mean() < 0.01
    assert 0.0 < states[:, -1].mean() < 1.0
    commanded = found["action"][:count, [episode.columns[1].names.index(name) for name in names]]
    assert np.abs(commanded - exact["action"][:count]).mean() < 0.02


def test_export_takes_bags_and_goes_on_from_them(tmp_path: Path) -> None:
    paths = []
    for number, kind in enumerate(("ros1", "file", "mcap")):
        (tmp_path / str(number)).mkdir()
        paths.append(bag(tmp_path / str(number), in_order(MOVES), kind))
    export_recordings(paths, tmp_path / "set", sentence=SENTENCE)
    read = DataSet(tmp_path / "set")
    assert len(read) == 3
    for number in (1, 2):
        np.testing.assert_array_equal(read.columns(number)["action"], read.columns(0)["action"])
    (tmp_path / "other.mcap").write_bytes(b"nothing")
    with pytest.raises(RecordingError, match=r"other\.mcap"):
        export_recordings([tmp_path / "other.mcap"], tmp_path / "again", sentence=SENTENCE)


@pytest.mark.parametrize(
    ("messages", "text"),
    [
        (MOVES[:101], r"has joint states, but nothing says what was executed \(got no /io_teleop/applied_joint_cmd, "),
        (MOVES[101:], r"has no joint states on /ariac/joint_states or .* \(got the topics /io_teleop/joint_cmd\)"),
        ([(STATES, 10.0, {"lift": 0.0}), (COMMANDS, 10.0, {"lift": 0.0})], r"has no whole frame in which all topics"),
        (
            [(STATES, 10.0, np.zeros((2, 2, 3), np.uint8)), *MOVES[101:]],
            r"must have a type of .* \(got sensor_msgs/msg/Im",
        ),
        (
            [(STATES, 10.0, {"lift": np.nan}), *MOVES[101:]],
            r"on /io_teleop/joint_states at 10\.000 s needs a finite pos",
        ),
    ],
    ids=["no-commands", "no-states", "short", "another-type", "nan"],
)
def test_bag_without_what_a_frame_needs_is_refused(messages: list[Message], text: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=rf"session\.bag: .*{text}"):
        bag_episode(bag(tmp_path, in_order(messages)), 20, sentence=SENTENCE)


def test_bag_without_sentence_or_with_odd_rate_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path, in_order(MOVES))
    with pytest.raises(UsageError, match=r"session\.bag: sentence: a bag has no task that says one; give the task"):
        bag_episode(path, 20, sentence="")
    with pytest.raises(UsageError, match=r"^hz: must be whole, from 1 to 1000 Hz \(got 0\)$"):
        bag_episode(path, 0, sentence=SENTENCE)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(UsageError, match="cannot be read as a bag"):
        bag_episode(path, 20, sentence=SENTENCE)
