from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import cellwright
from cellwright.middleware.messages.conversions import joint_state
from cellwright.recording.opened import Recording
from cellwright.util.errors import RecordingError, UnknownNameError
from tests.recording.replay.made import record, short_work

STATES, GRIPPER = "/ariac/joint_states", "vacuum_gripper_link"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("opened") / "run.mcap", short_work)


@pytest.fixture
def run(path: Path) -> Iterator[Recording]:
    with cellwright.open_recording(path) as opened:
        yield opened


def test_recording_has_kind_name_times_and_result(run: Recording) -> None:
    assert (run.kind, run.name, run.is_complete) == ("cell", "lesson", True)
    assert run.header["versions"]["numpy"] == np.__version__
    assert run.begin == 0.0
    assert run.end == pytest.approx(3.0, abs=0.1)
    assert run.topics[STATES] == "sensor_msgs/JointState"
    assert "/cellwright/frame" not in run.topics
    assert run.result == {"outcome": "done"}
    assert run.score is None


def test_messages_are_filtered_by_topic_and_time(run: Recording) -> None:
    found = list(run.messages(STATES, "/ariac/orders", start=0.0, until=1.0))

    times = [each.time for each in found]
    assert times == sorted(times)
    assert max(times) < 1.0
    assert {each.topic for each in found} == {STATES, "/ariac/orders"}
    order = next(each.message for each in found if each.topic == "/ariac/orders")
    assert order.order_id == "order_0"
    assert sum(1 for _ in run.messages(until=0.1)) > 200, "of all topics"


def test_arrays_of_joint_states_have_row_per_message(run: Recording) -> None:
    time, position, effort = run.arrays(STATES, "position", "effort", start=1.0)

    assert time[0] == pytest.approx(1.0)
    assert position.shape == effort.shape == (len(time), len(next(run.messages(STATES)).message.name))
    assert np.ptp(position, axis=0).max() > 0.1, "the arm moved"


def test_arrays_of_nested_field_are_read(run: Recording) -> None:
    time, stamp = run.arrays(STATES, "header.stamp.nanosec")

    assert stamp == pytest.approx((time % 1.0) * 1e9, abs=2.0)


def test_path_of_tool_has_pose_per_frame(run: Recording) -> None:
    time, pose = run.path(GRIPPER)

    assert pose.shape == (len(time), 7)
    assert np.diff(time) == pytest.approx(0.04, abs=0.04)
    assert np.linalg.norm(pose[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-5)
    assert np.linalg.norm(pose[-1, :3] - pose[0, :3]) > 0.05
    late, same = run.path(GRIPPER, start=1.5, until=2.5)
    chosen = (time >= 1.5) & (time < 2.5)
    assert late.tolist() == time[chosen].tolist()
    assert same.tolist() == pose[chosen].tolist()


def test_frames_commands_and_events_are_yielded(run: Recording) -> None:
    assert all(len(frame.poses) == len(run.scene.bodies) for frame in run.frames())
    assert next(run.commands()).name == "/ariac/start_competition"
    assert list(run.events()) == []


def test_dataset_has_what_is_measured_at_the_times_of_messages(tmp_path: Path) -> None:
    """Frames are instants of the run; joint states of a cell have noise."""
    with cellwright.Session("tandem", record=tmp_path / "run.mcap") as session:
        client = session.client("/operator")
        client.sleep(0.1)
        client.publish("/io_teleop/joint_cmd", joint_state(["lift"], [0.2]))
        client.sleep(0.4)
    with cellwright.open_recording(tmp_path / "run.mcap") as run:
        data = run.dataset(20)
        time, position = run.arrays("/io_teleop/joint_states", "position")
        lift = next(run.messages("/io_teleop/joint_states")).message.name.index("lift")
    assert data.time.tolist() == pytest.approx(np.arange(10) / 20)
    state = data.column("observation.state")
    assert (state.names[0], state.units[0]) == ("lift", "m")
    assert np.ptp(state.values[:, 0]) > 0.01
    expected = np.interp(data.time[1:], time, position[:, lift])
    assert state.values[1:, 0] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    "ask",
    [
        lambda run: run.messages("/ariac/joint_state"),
        lambda run: run.arrays(STATES, "positions"),
        lambda run: run.path("vacuum_gripper"),
    ],
)
def test_unknown_name_is_refused_with_suggestion(run: Recording, ask: object) -> None:
    with pytest.raises(UnknownNameError, match="did you mean"):
        ask(run)  # type: ignore[operator]


def test_arrays_of_text_field_are_refused(run: Recording) -> None:
    with pytest.raises(RecordingError, match="fields must be numeric"):
        run.arrays("/ariac/competition_state", "data")


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read"):
        cellwright.open_recording(tmp_path / "no.mcap")
