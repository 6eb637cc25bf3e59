from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.middleware.messages.conversions import joint_state
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.format.recorder import Recorder
from cellwright.recording.replay.rebuild import Rebuilt, Stamps
from cellwright.recording.replay.verify import Answer, HashPoint, Step, VerificationResult, recorded_steps, verify
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import RecordingError, RejectedCommandError
from tests.cell.robot_cells import tandem_cell
from tests.recording.replay.made import record, short_work

TICKS = 500  # a second


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record three seconds of work."""
    return record(tmp_path_factory.mktemp("verify") / "run.mcap", short_work)


@pytest.fixture(scope="module")
def taken(path: Path) -> list[Step]:
    """Return its steps."""
    with RecordingFile(path) as recording:
        return list(recorded_steps(recording))


def again(taken: list[Step], cell: Cell | None = None) -> VerificationResult:
    """Return the verdict of these steps in a new cell."""
    return verify(Rebuilt(cell or Cell(cellwright.load_trial("lesson"))), taken)


@pytest.mark.slow
def test_same_commands_give_same_state(taken: list[Step]) -> None:
    times: list[int] = []
    verdict = verify(Rebuilt(Cell(cellwright.load_trial("lesson"))), taken, times.append)

    assert verdict.answer is Answer.EQUAL
    assert verdict.hashes == 4  # one a second, and one at the end
    assert verdict.frames >= 70
    assert verdict.commands == sum(isinstance(step, Command) for step in taken)
    assert verdict.commands >= 3
    assert verdict.equal_until == verdict.reached
    assert verdict.factor > 0.0
    assert times == sorted(times)
    assert times[-1] == verdict.reached.time


def test_other_servo_profile_gives_different_run(taken: list[Step]) -> None:
    verdict = again(taken, Cell(cellwright.load_trial("lesson"), servo="precise"))

    assert verdict.answer is Answer.DIFFERENT
    assert verdict.equal_until is None
    assert verdict.moved is not None
    assert verdict.different is not None
    assert verdict.first_difference == verdict.moved
    assert verdict.moved.tick < verdict.different.tick
    assert verdict.bodies


def test_missing_command_is_found_by_poses(taken: list[Step]) -> None:
    goals = [step for step in taken if isinstance(step, Command) and step.name == "/ariac/arm/command"]

    verdict = again([step for step in taken if step not in goals])

    assert verdict.answer is Answer.DIFFERENT
    assert verdict.moved is not None
    assert goals[0].tick < verdict.moved.tick <= goals[0].tick + TICKS // 10


@pytest.mark.slow
def test_recording_without_state_hash_gives_unknown(taken: list[Step]) -> None:
    verdict = again([step for step in taken if not isinstance(step, HashPoint)])

    assert verdict.answer is Answer.UNKNOWN
    assert verdict.frames >= 70


@pytest.mark.slow
def test_truncated_recording_is_never_different(path: Path, tmp_path: Path) -> None:
    whole = path.read_bytes()
    answers = set()
    for share in (0.5, 0.7, 0.9, 0.99):
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(whole[: int(share * len(whole))])
        with RecordingFile(cut) as recording:
            answers.add(again(list(recorded_steps(recording))).answer)
    assert answers <= {Answer.EQUAL, Answer.UNKNOWN}


def test_unstable_run_is_reported(taken: list[Step]) -> None:
    cell = Cell(cellwright.load_trial("lesson"))
    cell.simulation.data.qvel[0] = np.nan

    verdict = again(taken, cell)

    assert verdict.answer is Answer.DIFFERENT
    assert verdict.fault or verdict.moved is not None


def test_replayed_commands_have_recorded_age(tmp_path: Path) -> None:
    config = cellwright.load_robot("tandem")
    safety = SafetySettings(max_age=0.5)
    node = RobotNode(config, RobotSettings(safety=safety), stamp=time.time_ns)
    recorder = Recorder(node, tmp_path / "run.mcap", RecordingHeader("robot", node.name), stamp=node.message_time)
    joint = config.robot.driven[0].name
    program = InProcess(node, node="/operator")
    program.publish("/io_teleop/joint_cmd", joint_state([joint], [0.2], time=time.time_ns()))
    node.simulation.step_until(100_000_000)
    with pytest.raises(RejectedCommandError, match="old"):
        program.publish("/io_teleop/joint_cmd", joint_state([joint], [0.4], time=time.time_ns() - 10**9))
    node.simulation.step_until(500_000_000)
    recorder.end({})
    state = node.simulation.state_hash()
    node.close()

    with RecordingFile(tmp_path / "run.mcap") as recording:
        taken = list(recorded_steps(recording))
    stamps = Stamps()
    restored = RobotNode(config, RobotSettings(safety=safety), stamp=stamps)
    verdict = verify(Rebuilt(restored, stamps), taken)

    assert verdict.answer is Answer.EQUAL
    assert verdict.commands == 2
    assert restored.simulation.state_hash() == state
    assert restored.refused == 1
    restored.close()


def test_invalid_hash_point_is_refused(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    shutil.copy(path, copy)
    with RecordingFile(copy) as recording:
        message = next(recording.messages(["/cellwright/state_hash"]))

        class Odd:
            def messages(self, *_: object, **__: object) -> list[object]:
                return [message._replace(data=message.data.replace(b"tick", b"tock"))]

        with pytest.raises(RecordingError, match=r"state_hash at .* is invalid"):
            list(recorded_steps(Odd()))  # type: ignore[arg-type]


def test_invalid_command_is_reported(taken: list[Step]) -> None:
    command = next(step for step in taken if isinstance(step, Command))

    with pytest.raises(RecordingError, match=r"is invalid|invalid command"):
        again([replace(command, type="osrf_gear/Nonsense")])


class Lift:
    """Program that raises a robot."""

    def run(self, client: Client) -> None:
        client.publish("/left/joint_cmd", joint_state(["lift"], [0.2], time=0))
        client.sleep(0.5)


def test_commands_to_a_robot_in_a_cell_are_repeated(tmp_path: Path) -> None:
    run_cell(Cell(tandem_cell()), Lift(), RunOptions(ends_when_done=False), record=tmp_path / "run.mcap")
    with RecordingFile(tmp_path / "run.mcap") as recording:
        verdict = verify(Rebuilt(Cell(tandem_cell())), list(recorded_steps(recording)))
    assert (verdict.answer, verdict.commands) == (Answer.EQUAL, 1)
