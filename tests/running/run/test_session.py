"""Tests of the session: it runs, serves, records and films; and few calls lie before an agent's start."""

from __future__ import annotations

import itertools
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import FrozenInstanceError, replace
from functools import partial
from pathlib import Path

import pytest

import cellwright
from cellwright.cell.interface.rows import SIMULATOR
from cellwright.cli.main import main
from cellwright.clients.client import Client
from cellwright.config.robot.config import RobotConfig
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.ros1.host import ros1
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.robot.node import RobotNode
from cellwright.running.run import Outcome, RunOptions, RunResult, ServerOptions, Session, run_cell
from cellwright.running.run.robots import RobotTarget
from cellwright.util.errors import RunEndedError, UnknownNameError, UsageError
from cellwright.util.files import read_json_lines
from tests.support.cells import BARE, KITTING
from tests.support.waiting import TIMEOUT

FRAMES = 7
"""Maximum of our calls on the stack when an agent starts, including main() and the agent itself."""


class Ends:
    """Ends the competition after a while."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(0.3)
        client.end_competition()


def test_run_cell_and_session_give_same_state() -> None:
    with Session(cellwright.Cell(KITTING)) as session:
        result = session.run(Ends())
    assert result.state_hash == run_cell(cellwright.Cell(KITTING), Ends()).state_hash
    assert result is session.result


def test_second_run_writes_own_files(tmp_path: Path) -> None:
    with Session(KITTING, record=[tmp_path / "a.mcap", tmp_path / "a.jsonl"]) as session:
        first, second = session.run(Ends), session.run(Ends)
    assert first.state_hash == second.state_hash
    assert (first.recordings, second.recordings) == ((tmp_path / "a.mcap",), (tmp_path / "a_2.mcap",))
    assert [line["kind"] for line in read_json_lines(tmp_path / "a_2.jsonl")][-1] == "result"


def test_run_without_program_clients_or_end_is_refused() -> None:
    with Session(BARE) as session, pytest.raises(UsageError, match="until: a run without an agent needs an end"):
        session.run()
    assert Session(BARE).run(until=0.25).steps == 125


def test_stop_request_ends_agent() -> None:
    class Waits:
        def run(self, client: Client) -> None:
            client.subscribe("/clock", lambda _: session.stop.request("enough"))
            with pytest.raises(RunEndedError, match="enough"):
                client.sleep(10.0)
            client.sleep(1.0)

    with Session(BARE) as session:
        assert session.run(Waits()).outcome is Outcome.UNTIL


def test_client_advances_time_and_observers_follow() -> None:
    seen: list[str] = []

    @contextmanager
    def observer(session: Session) -> Iterator[None]:
        seen.append("begun")
        yield
        assert session.result is not None
        seen.append(f"{session.result.simulated:g} s")

    with Session(cellwright.Cell(KITTING), options=RunOptions(observers=[observer])) as session:
        client = session.client()
        assert isinstance(client, Client)
        client.sleep(0.5)
        assert seen == ["begun"]
    assert seen == ["begun", "0.5 s"]


def test_slow_observer_does_not_speed_up_run() -> None:
    @contextmanager
    def dawdle(_: Session) -> Iterator[None]:
        threading.Event().wait(0.4)
        yield

    with Session(cellwright.Cell(BARE), rate=2.0, options=RunOptions(observers=[dawdle])) as session:
        result = session.run(until=0.4)
    assert result.real_time_factor < 2.1  # a slow machine falls behind, none runs ahead


def test_client_over_socket_works_served_session() -> None:
    with Session(cellwright.Cell(KITTING), serve=ServerOptions(port=0, lockstep=True)) as session:

        def work() -> None:
            client = Client.connect(session.address or ("", 0))
            client.sleep(0.2)
            client.close()
            session.stop.request()

        thread = threading.Thread(target=work)
        thread.start()
        result = session.run()
        thread.join(TIMEOUT)
    assert isinstance(result, RunResult)
    assert (result.simulated, result.pace) == (0.2, None)


def test_robot_is_recorded_and_recording_is_played(tmp_path: Path) -> None:
    with Session("tandem", record=tmp_path / "robot.mcap") as session:
        client = session.client("/operator")
        assert not isinstance(client, Client)
        with pytest.raises(UsageError, match="program: an agent needs a cell"):
            session.run(Ends())
        client.sleep(0.3)
    with Session(tmp_path / "robot.mcap") as played:
        result = played.run()
    assert result.outcome == "until"
    assert result.simulated == pytest.approx(0.3, abs=0.01)


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


@pytest.mark.parametrize("option", ["record", "video"])
def test_recording_cannot_be_recorded_or_filmed(option: str, tmp_path: Path) -> None:
    with Session("tandem", record=tmp_path / "robot.mcap") as session:
        session.run(until=0.1)
    file = tmp_path / f"again.{'mcap' if option == 'record' else 'mp4'}"
    with pytest.raises(UsageError, match=f"^{option}: "):
        Session(tmp_path / "robot.mcap", record=file).run()
    assert not file.exists()


def test_unknown_target_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="lesson"):
        Session("leson").run(until=0.1)


def test_log_of_robot_is_refused(tmp_path: Path) -> None:
    with (
        Session("tandem", record=tmp_path / "a.jsonl") as session,
        pytest.raises(UsageError, match="log: only a cell has a log"),
    ):
        session.run(until=0.1)


def test_few_stack_frames_lie_between_command_line_and_agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "counts.py").write_text(
        "import sys, traceback\n"
        "class Counts:\n"
        "    def run(self, client):\n"
        "        self.__class__.frames.extend(each.filename for each in traceback.extract_stack())\n"
        "    frames = sys.modules.setdefault('frames_of_the_agent', [])\n"
    )
    monkeypatch.chdir(tmp_path)
    frames: list[str] = []
    monkeypatch.setitem(sys.modules, "frames_of_the_agent", frames)
    assert main(["run", "lesson", "--agent", "counts.py:Counts", "--no-picture"]) == 1, "it gives up at once"
    ours = [each for each in frames if "/cellwright/" in each.replace("\\", "/") or each.endswith("counts.py")]
    assert 4 <= len(ours) <= FRAMES, ours


def test_run_options_apply_to_session(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    options = RunOptions(until=0.2, listen=["/clock"], checkpoints=[])
    result = Session(cellwright.Cell(BARE), options=options).run()
    assert isinstance(result, RunResult)
    assert result.heard["/clock"] == 100
    assert not file.exists()


def test_recording_of_robot_keeps_arguments_of_its_xacro_file(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text('<robot name="r"><link name="$(arg side)_arm"/></robot>')
    load = partial(cellwright.load_robot, tmp_path / "arm.xacro", xacro_arguments={"side": "left"})
    with Session(RobotTarget.of(load, is_real_time=False), record=tmp_path / "robot.mcap") as session:
        session.run(until=0.1)
    with RecordingFile(tmp_path / "robot.mcap") as recording, rebuild(recording) as rebuilt:
        assert isinstance(rebuilt.served, RobotNode)
        assert rebuilt.served.config.robot.root == "left_arm"


@pytest.mark.parametrize("target", [BARE, "tandem"])
def test_reset_under_way_keeps_end_of_run(target: cellwright.Trial | str) -> None:
    tempo, polls = RateControl(1.0), itertools.count(1)

    def poll() -> None:
        if next(polls) == 2:
            session.reset()
            tempo.set_speed(None)
        elif session.node.simulation.time > 1.0:
            session.stop.request("it has no end")

    with Session(target, serve=ServerOptions(port=0), rate=tempo) as session:
        session.on_poll.append(poll)
        result = session.run(until=0.4)
    assert result.simulated == pytest.approx(0.4, abs=0.005)
    assert session.number == 1, "the same run"


def test_session_that_is_a_node_of_ros_serves_and_joins(monkeypatch: pytest.MonkeyPatch) -> None:
    joined: list[tuple[str, int]] = []

    class Ros(ExitStack):
        identity = SIMULATOR

        def __init__(self, *_: object, **__: object) -> None:
            super().__init__()

        def prepare(self) -> None:
            pass

        def poll(self) -> None:
            pass

        def join(self, address: tuple[str, int], *_: object) -> bool:
            joined.append(address)
            return True

    monkeypatch.setattr(ros1, "Ros1", Ros)
    with Session(BARE, serve=ServerOptions(port=0, ros1=True)) as session:
        session.run(until=0.1)
        session.run(until=0.1)
        assert joined == [session.address], "once"


@pytest.mark.parametrize("target", [BARE, "tandem"])
def test_closed_session_is_refused(target: cellwright.Trial | str) -> None:
    session = Session(target)
    with pytest.raises(UsageError, match="client: the session is not open"):
        session.client()
    session.run(until=0.1)
    for call in (partial(session.run, until=0.1), session.client, session.reset, session.__enter__):
        with pytest.raises(UsageError, match="the session is closed"):
            call()
    assert session.number == 1


def test_file_names_say_what_is_written(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"b\.jsonl: a\.jsonl is of this kind already"):
        Session(BARE, record=["a.jsonl", "b.jsonl"])
    with Session(BARE, record=[tmp_path / "a.jsonl", tmp_path / "a.bag"]) as session:
        result = session.run(until=0.1)
    assert result.recordings == (tmp_path / "a.bag",)
    assert {each.name for each in tmp_path.iterdir()} == {"a.jsonl", "a.bag"}


def test_result_is_frozen() -> None:
    result = Session(BARE).run(until=0.1)
    with pytest.raises(FrozenInstanceError):
        result.error = "none"  # type: ignore[misc]
