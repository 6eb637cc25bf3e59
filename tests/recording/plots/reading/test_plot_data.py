"""Plot data of a cell at work, of a robot, and of truncated or damaged files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright import Client, run_trial
from cellwright.cell.cell import Cell
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.standard import Header, JointState, Time
from cellwright.middleware.messages.std_srvs import SetBoolRequest
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.format.recorder import Recorder
from cellwright.recording.plots.reading.plot_data import load_plot_data
from cellwright.recording.plots.tracks import PlotData
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RecordingError
from cellwright.viewer.services.robot_panel import RobotPanel
from tests.cell.arm_cells import TWO_UR5, ur5_cell
from tests.cell.robot_cells import tandem_cell
from tests.clients.operators.nodes import robot
from tests.support.cells import INITIAL, WHOLE, publish, run, start, way

AHEAD = (0.5, *INITIAL[1:])


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a cell whose arm moves and whose AGV leaves."""
    path = tmp_path_factory.mktemp("recordings") / "cell.mcap"
    served = Cell(WHOLE)
    recorder = Recorder(served, path, RecordingHeader("cell", "whole", {"seed": 3, "agent": "hand"}))
    recorder.event({"kind": "run", "best": 12.0, "reachable": 8.0})
    start(served)
    publish(served, "arm/command", way(AHEAD))
    run(served, 2.0)
    served.bus.call("/ariac/agv1", AGVControlRequest(kit_type="order_0_kit_0"))
    run(served, 0.5)
    recorder.event({"kind": "result", "time": 2.5, "outcome": "stopped"})
    recorder.end({})
    return path


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a robot that moves one joint, and is switched off at the end."""
    path = tmp_path_factory.mktemp("recordings") / "robot.mcap"
    node = RobotNode(robot())
    panel = RobotPanel(node)
    recorder = Recorder(node, path, RecordingHeader("robot", node.name, {}), panel=lambda: panel.state({}))
    joint = node.driver.joints[0]
    header = Header(stamp=Time(sec=0, nanosec=0), frame_id="")
    nothing = np.zeros(0)
    target = JointState(header=header, name=[joint], position=np.array([0.2]), velocity=nothing, effort=nothing)
    node.bus.publish("/io_teleop/joint_cmd", target, node="/hand")
    for tick in range(480):
        if tick == 240:
            node.bus.call("/io_teleop/set_enabled", SetBoolRequest(data=False), node="/hand")
        node.simulation.step()
    recorder.end({})
    return path


def loaded(path: Path) -> PlotData:
    with RecordingFile(path) as recording:
        return load_plot_data(recording)


def test_recording_of_cell_gives_plot_data(cell: Path) -> None:
    found = loaded(cell)
    assert (found.title, found.warning) == ("whole", "")
    assert found.note.startswith("hand   seed 3   0 of 12 points   2.")
    assert found.note.endswith("stopped")
    (arm,) = found.joints.values()
    rail = next(track for track in arm if track.name == "rail")
    assert (len(arm), rail.unit) == (7, "m")
    assert rail.positions[-1] == pytest.approx(AHEAD[0], abs=0.05) == rail.targets[-1]
    (tool,) = found.tools
    assert tool.positions[-1, 1] == pytest.approx(AHEAD[0] + tool.positions[0, 1] - INITIAL[0], abs=0.5)
    assert np.ptp(tool.positions, axis=0).max() > 0.1
    assert [track.name for track in found.commands][-1] == "/ariac/agv1"
    assert [span.label for span in found.states["competition"]][-1] == "go"
    assert found.score is not None
    assert found.score.best == 8.0


@pytest.fixture(scope="module")
def two_arms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a cell of two arms, of which the second has no tool and moves."""
    path = tmp_path_factory.mktemp("recordings") / "two.mcap"
    trial = ur5_cell(TWO_UR5.replace("names: prefixed", "tool: {{kind: none}}"))

    class Mover:
        def run(self, client: Client) -> None:
            client.start_competition()
            client.arm("arm1").control_gripper(True)
            joints = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
            client.arm("arm2").move_arm(
                [(0.6, -1.2, 1.6, -2.0, -1.57, 0.0)], [1.0], joints=[f"{joint}_joint" for joint in joints]
            )

    run_trial(trial, Mover, record=path)
    return path


def test_each_arm_has_its_joints_and_the_path_of_its_tool(two_arms: Path) -> None:
    found = loaded(two_arms)
    assert [(name, len(tracks)) for name, tracks in found.joints.items()] == [("Arm1", 6), ("Arm2", 6)]
    still, moved = found.tools
    assert (still.name, moved.name) == ("arm1", "arm2")
    assert [span.label for span in still.on] == ["on"]
    assert not moved.on
    assert np.ptp(still.positions, axis=0).max() < 0.01 < 0.2 < np.ptp(moved.positions, axis=0).max()
    # without a cup it is the tip, 0.1 m behind the face of one
    assert moved.positions[0, 2] == pytest.approx(still.positions[0, 2] + 0.1, abs=0.03)


@pytest.mark.parametrize("arms", [None, [], {"arm": None}, {"arm": {"namespace": 5, "tool": "x"}}])
def test_arms_that_a_header_does_not_name_are_that_of_2017(arms: object, tmp_path: Path) -> None:
    path = tmp_path / "cell.mcap"
    served = Cell(WHOLE)
    recorder = Recorder(served, path, RecordingHeader("cell", "whole", {"arms": arms}))
    run(served, 0.1)
    recorder.end({})
    (tool,) = loaded(path).tools
    assert tool.name == "vacuum gripper"


def test_robot_of_a_cell_has_its_joints(tmp_path: Path) -> None:
    class Lift:
        def run(self, client: Client) -> None:
            client.publish("/left/joint_cmd", joint_state(["lift"], [0.05], time=0))
            client.sleep(0.5)

    run_trial(tandem_cell(), Lift, record=tmp_path / "lift.mcap")
    tracks = {track.name: track for track in loaded(tmp_path / "lift.mcap").joints["Tandem"]}
    assert (tracks["lift"].unit, tracks["right_elbow"].unit) == ("m", "rad")
    assert tracks["lift"].positions[-1] == pytest.approx(0.05, abs=1e-3)
    assert tracks["lift"].targets[-1] == pytest.approx(0.05)


@pytest.mark.parametrize("robots", [None, [], {"tandem": None}, {"tandem": {"namespace": "left"}}])
def test_robots_that_a_header_does_not_describe_have_no_joints(robots: object, tmp_path: Path) -> None:
    path, served = tmp_path / "cell.mcap", Cell(tandem_cell())
    recorder = Recorder(served, path, RecordingHeader("cell", "cell", {"robots": robots}))
    run(served, 0.1)
    recorder.end({})
    assert "Tandem" not in loaded(path).joints


def test_recording_of_robot_gives_plot_data(wave: Path) -> None:
    found = loaded(wave)
    joints = [track for group in found.joints.values() for track in group]
    moved = next(track for track in joints if track.travel > 0.1)
    assert moved.positions[-1] == pytest.approx(0.2, abs=0.01) == moved.targets[-1]
    assert [span.label for span in found.states["safety"]] == ["takes commands", "disabled"]
    assert {track.name: len(track.times) for track in found.commands} == {
        "/io_teleop/joint_cmd": 1,
        "/io_teleop/set_enabled": 1,
    }
    assert found.tools
    grippers = [track.name for track in found.joints.get("Grippers", [])]
    assert grippers == ["right gripper", "left gripper"]


@pytest.fixture
def cut(tmp_path: Path, cell: Path) -> Path:
    path = tmp_path / "cut.mcap"
    data = cell.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    return path


def test_truncated_recording_gives_data_and_warning(cut: Path, cell: Path) -> None:
    found, whole = loaded(cut), loaded(cell)
    assert found.note.endswith("cut short")
    assert found.warning == f"{cut}: cut short; plotted as far as it goes"
    assert 0.0 < found.end < whole.end
    (arm,), (all_of_it,) = found.joints.values(), whole.joints.values()
    assert np.array_equal(arm[0].positions, all_of_it[0].positions[: len(arm[0].positions)])


@settings(max_examples=15)
@given(st.floats(0.05, 1.0), st.integers(0, 255), st.floats(0.1, 1.0))
def test_damaged_recording_is_skipped_or_refused(cell: Path, place: float, value: int, length: float) -> None:
    data = bytearray(cell.read_bytes())
    data[round(place * (len(data) - 1))] = value
    path = cell.with_name("damaged.mcap")
    path.write_bytes(data[: round(length * len(data))])
    try:
        found = loaded(path)
    except RecordingError:
        return
    assert found.begin <= found.end
