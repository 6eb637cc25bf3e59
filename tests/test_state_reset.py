"""Tests of a reset of the state alone: the run begins again, and message time goes on."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.config.trial.catalogue import find_trial
from cellwright.engine.clock import NANOSECONDS, nanoseconds
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.messages.control_msgs import QueryTrajectoryStateRequest
from cellwright.middleware.messages.conversions import joint_state, joint_trajectory, stamp, trajectory_point
from cellwright.middleware.messages.standard import JointTrajectory
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.playback import Recorded
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, recorded_steps, verify
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.robot.services import RobotServices
from cellwright.running.run import CellTarget, RunOptions, ServerOptions, Session
from cellwright.running.run.robots import RobotTarget
from cellwright.util.errors import RejectedCommandError, ServiceFailedError
from cellwright.viewer.services.simulation_requests import OK, STATE, TIME
from tests.cell.interface.goals import ACTION, goal
from tests.clients.operators import nodes as robots
from tests.support.cells import INITIAL, JOINTS, WHOLE, Ear, call, publish, run, run_to, stamp_of
from tests.support.waiting import TIMEOUT, wait_until

Result = TypeVar("Result")
NEAR = tuple(value + 0.1 for value in INITIAL)
STAMPED = ("/ariac/joint_states", "/ariac/arm/state", "/ariac/break_beam_1", "/ariac/laser_profiler_1")


def begun(cell: Cell, *, keeps_clock: bool) -> Cell:
    """Return a cell after work of half a second and a reset."""
    start = cell.simulation.clock.message_time()
    publish(cell, f"{ACTION}/goal", goal(motion(start), "before"))
    call(cell, "start_competition")
    run(cell, 0.5)
    cell.reset(keeps_clock=keeps_clock)
    return cell


def motion(start: int, positions: tuple[float, ...] = NEAR) -> JointTrajectory:
    """Return a motion of half a second that begins at a time [ns]."""
    return joint_trajectory(JOINTS, [trajectory_point(positions, time_from_start=NANOSECONDS // 2)], time=start)


def hashes(cell: Cell) -> list[str]:
    """Work a second with commands that have stamps; return the state hash every 0.1 s."""
    found = [cell.state_hash()]
    start = cell.simulation.clock.message_time()
    call(cell, "start_competition")
    for tenth in range(1, 11):
        if tenth == 2:
            publish(cell, f"{ACTION}/goal", goal(motion(start + NANOSECONDS // 4), "first", given=start + 1))
        run_to(cell, tenth / 10)
        found.append(cell.state_hash())
    return found


def test_state_evolves_as_from_the_start() -> None:
    expected = hashes(Cell(WHOLE))
    assert len(set(expected)) == len(expected)
    for keeps_clock in (False, True):
        cell = begun(Cell(WHOLE), keeps_clock=keeps_clock)
        assert cell.simulation.clock.message_time() == NANOSECONDS // 2 * keeps_clock
        assert hashes(cell) == expected
    cell = begun(begun(Cell(WHOLE), keeps_clock=True), keeps_clock=True)
    assert cell.simulation.clock.offset == NANOSECONDS
    assert hashes(cell) == expected


def test_state_of_robot_evolves_as_from_the_start() -> None:
    def work() -> list[str]:
        found = [node.simulation.state_hash()]
        program = InProcess(node, node="/operator")
        node.simulation.step()
        for place in (0.1, 0.2, 0.3):
            program.publish("/io_teleop/joint_cmd", joint_state(["right_1"], [place], time=program.now()))
            program.advance(program.now() + NANOSECONDS // 10)
            found.append(node.simulation.state_hash())
        services.move_tip({"arm": 0, "pose": [[0.3, -0.2, 0.9], [0.0, 0.0, 0.0, 1.0]]})
        program.advance(program.now() + NANOSECONDS // 10)
        return [*found, node.simulation.state_hash()]

    node = RobotNode(robots.robot(), RobotSettings(sim_time=True, safety=SafetySettings(max_age=0.05)))
    services = RobotServices(node)
    expected = work()
    assert len(set(expected)) == len(expected)
    node.simulation.reset(keeps_clock=True)
    assert node.message_time() > NANOSECONDS // 3
    assert work() == expected
    assert node.refused == 0
    node.close()


def test_stamps_of_requests_are_in_time_that_goes_on() -> None:
    cell = begun(Cell(WHOLE), keeps_clock=True)
    start = cell.simulation.clock.message_time()
    results = Ear(cell, f"{ACTION}/result")
    with pytest.raises(RejectedCommandError, match="lie in the past"):
        publish(cell, f"{ACTION}/goal", goal(motion(start - NANOSECONDS), "old"))
    publish(cell, f"{ACTION}/goal", goal(motion(start + NANOSECONDS // 5), "new"))
    desired = call(cell, "arm/query_state", QueryTrajectoryStateRequest(stamp(start + NANOSECONDS)))
    assert desired.position == pytest.approx(NEAR)
    run(cell, 0.1)
    with pytest.raises(ServiceFailedError, match="before the stored motion"):
        call(cell, "arm/query_state", QueryTrajectoryStateRequest(stamp(start - 1)))
    run(cell, 0.9)
    assert [each.status.goal_id.id for each in results.messages] == ["old", "new"]
    assert all(stamp_of(each) >= start for each in results.messages)
    assert stamp_of(results.messages[-1]) >= start + NANOSECONDS * 7 // 10


def served(
    target: Any, work: Callable[[SocketTransport], Result], *, lockstep: bool = False, **more: Any
) -> tuple[Result, Any]:
    """Serve a target while a client in another thread works; return what it found, and the session's result."""
    made = (
        target
        if isinstance(target, Session)
        else Session(target, serve=ServerOptions(port=0, lockstep=lockstep), **more)
    )
    with made as session, ThreadPoolExecutor(1) as pool:
        assert session.address is not None
        address = session.address

        def connect() -> Result:
            transport = SocketTransport(address)
            try:
                return work(transport)
            finally:
                transport.close()
                session.stop.request()

        found = pool.submit(connect)
        result = session.run()
        return found.result(TIMEOUT), result


def development_cell() -> CellTarget:
    """Return the target of a cell in development mode, with the file that a recording needs."""
    return CellTarget(lambda: Cell(cellwright.load_trial("lesson"), competition=False), lambda: [find_trial("lesson")])


def keep_stamp(stamps: list[int], message: Any) -> None:
    """Append the stamp of a message [ns]."""
    stamps.append(stamp_of(message))


def reset_state(transport: SocketTransport) -> None:
    """Reset the state alone."""
    answer = transport.ask_server("simulation/ResetSimulation", {"scope": STATE})
    assert answer["result"]["result"] == OK, answer


def test_client_over_socket_sees_time_go_on() -> None:
    def work(client: SocketTransport) -> tuple[list[int], dict[str, list[int]], list[str], int]:
        times: list[int] = []
        stamps: dict[str, list[int]] = {"/clock": []}
        orders: list[str] = []

        def on_clock(message: Any) -> None:
            stamps["/clock"].append(message.clock.sec * NANOSECONDS + message.clock.nanosec)
            times.append(client.now())

        client.subscribe("/clock", on_clock)
        for topic in STAMPED:
            stamps[topic] = []
            client.subscribe(topic, partial(keep_stamp, stamps[topic]))
        client.subscribe("/ariac/orders", lambda message: orders.append(message.order_id))
        client.call("/ariac/start_competition", TriggerRequest())
        client.advance(NANOSECONDS)
        reset_state(client)
        at_reset = client.now()
        client.call("/ariac/start_competition", TriggerRequest())
        client.advance(at_reset + NANOSECONDS)
        return times, stamps, orders, at_reset

    cell = Cell(WHOLE, competition=False)
    (times, stamps, orders, at_reset), _ = served(cell, work, lockstep=True)
    assert times == sorted(times)
    assert len(set(stamps["/clock"])) == len(stamps["/clock"]) == 1000
    for topic, found in stamps.items():
        assert found == sorted(found), topic
        assert sum(each > at_reset for each in found) >= 5, topic
        assert sum(each <= at_reset for each in found) >= 5, topic
    assert orders == ["order_0", "order_0"]
    assert (at_reset, cell.simulation.now) == (NANOSECONDS, NANOSECONDS)


def test_wait_of_lockstep_client_lasts_over_reset() -> None:
    rate = RateControl(None)
    rate.pause()
    cell = Cell(WHOLE, competition=False)

    def work(client: SocketTransport) -> int:
        assert session.address is not None
        waiting = SocketTransport(session.address, node="/waiting")
        with ThreadPoolExecutor(1) as pool:
            done = pool.submit(waiting.advance, NANOSECONDS)
            client.ask_server("cellwright/control", {"action": "step", "ticks": 100})
            wait_until(lambda: client.ask_server("cellwright/panel")["clock"]["tick"] == 100, "pause after the steps")
            reset_state(client)
            assert not done.done()
            client.ask_server("cellwright/control", {"action": "resume"})
            done.result(TIMEOUT)
        now = waiting.now()
        waiting.close()
        client.advance(0)
        return now

    session = Session(cell, serve=ServerOptions(port=0, lockstep=True), rate=rate)
    now, _ = served(session, work)
    assert (now, cell.simulation.now) == (NANOSECONDS, nanoseconds(0.8))


def test_recording_with_reset_is_verified_and_played(tmp_path: Path) -> None:
    def work(client: SocketTransport) -> int:
        client.call("/ariac/start_competition", TriggerRequest())
        client.advance(NANOSECONDS // 2)
        reset_state(client)
        client.call("/ariac/start_competition", TriggerRequest())
        client.publish("/ariac/arm/command", motion(client.now() + NANOSECONDS // 5))
        client.advance(client.now() + NANOSECONDS)
        return client.now()

    path = tmp_path / "run.mcap"
    now, result = served(development_cell(), work, lockstep=True, record=path)
    assert now == NANOSECONDS * 3 // 2
    assert result.simulated == 1.0
    for file, offset in ((path, 0), (path.with_stem("run_2"), NANOSECONDS // 2)):
        with RecordingFile(file) as recording:
            assert recording.header.clock_offset == offset
            assert recording.begin == 0
            steps = list(recorded_steps(recording))
            assert any(isinstance(step, Command) for step in steps)
            with rebuild(recording) as rebuilt:
                verdict = verify(rebuilt, steps)
            assert verdict.answer is Answer.EQUAL
            assert verdict.hashes >= 1
            played = Recorded(recording)
            player = InProcess(played)
            stamps: list[int] = []
            player.subscribe("/ariac/joint_states", partial(keep_stamp, stamps))
            player.advance(offset + NANOSECONDS // 10)
            assert stamps
            assert all(offset < each <= player.now() for each in stamps)
    with RecordingFile(path.with_stem("run_2")) as recording, rebuild(recording) as rebuilt:
        rebuilt.served.simulation.clock.offset = 0
        assert verify(rebuilt, recorded_steps(recording)).answer is Answer.DIFFERENT


def test_recording_with_kept_part_and_time_of_its_own_is_verified(tmp_path: Path) -> None:
    at = {"pose": {"position": {"x": -0.3, "y": 0.23, "z": 1.2}}}

    def work(client: SocketTransport) -> str:
        answer = client.ask_server("simulation/SpawnEntity", {"uri": "gear_part", "initial_pose": at})
        client.advance(NANOSECONDS // 2)
        for scope in (TIME | STATE, TIME):
            answer |= client.ask_server("simulation/ResetSimulation", {"scope": scope})
            assert answer["result"]["result"] == OK, answer
            client.publish("/ariac/arm/command", motion(NANOSECONDS // 5))
            client.advance(client.now() + NANOSECONDS // 2)  # it hears of the new time with the answer
        assert answer["entity_name"] in client.ask_server("simulation/GetEntities")["entities"]
        return str(answer["entity_name"])

    path = tmp_path / "run.mcap"
    name, result = served(development_cell(), work, lockstep=True, record=path)
    assert result.simulated == 2.5
    for file, time in ((path, 0.5), (path.with_stem("run_2"), 1.5)):
        with RecordingFile(file) as recording:
            steps = list(recorded_steps(recording))
            with rebuild(recording) as rebuilt:
                assert verify(rebuilt, steps).answer is Answer.EQUAL
                assert isinstance(rebuilt.served, Cell)
                assert name in rebuilt.served.parts.in_play
                assert rebuilt.served.simulation.clock.message_time() == nanoseconds(time)
            if time > 1.0:
                without = [step for step in steps if not (isinstance(step, Command) and "Reset" in step.name)]
                with rebuild(recording) as rebuilt:
                    assert verify(rebuilt, without).answer is Answer.DIFFERENT


def test_served_robot_begins_again_and_its_clock_goes_on() -> None:
    def work(client: SocketTransport) -> tuple[list[int], list[float]]:
        stamps: list[int] = []
        places: list[float] = []

        def on_states(message: Any) -> None:
            stamps.append(stamp_of(message))
            places.append(message.position[message.name.index("right_1")])

        client.subscribe("/io_teleop/joint_states", on_states)
        client.publish("/io_teleop/joint_cmd", joint_state(["right_1"], [0.5], time=0))
        client.advance(NANOSECONDS // 2)
        before = len(places)
        reset_state(client)
        client.advance(client.now() + NANOSECONDS // 10)
        client.publish("/io_teleop/joint_cmd", joint_state(["right_1"], [0.2], time=client.now()))
        client.advance(client.now() + NANOSECONDS // 2)
        return stamps, [places[before - 1], places[before], places[-1]]

    node = RobotNode(robots.robot(), RobotSettings(sim_time=True, safety=SafetySettings(max_age=0.2)))
    home = float(node.driver.read().positions[node.commander.numbers["right_1"]])
    (stamps, places), _ = served(RobotTarget.of(node, is_real_time=False), work, lockstep=True)
    assert stamps == sorted(stamps)
    assert stamps[-1] > NANOSECONDS
    assert places == pytest.approx([0.5, home, 0.2], abs=0.02)
    assert node.refused == 0


def test_reset_clears_no_emergency_stop_and_moves_no_real_robot() -> None:
    node = RobotNode(robots.robot(), RobotSettings(sim_time=True))
    target = RobotTarget.of(node, is_real_time=False)
    with Session(target, serve=ServerOptions(port=0)) as session:
        assert target.restart_refusal() == ""
        node.commander.stop("pressed")
        with pytest.raises(RejectedCommandError, match="clear"):
            session.reset(keeps_clock=True)
        assert node.commander.is_stopped
        node.has_driver = True
        assert "real robot" in target.restart_refusal()
        node.has_driver = False


def test_clock_cannot_go_on_where_restart_is_run_of_its_own() -> None:
    session = Session(Cell(WHOLE), options=RunOptions(until=0.1))
    with session, pytest.raises(RejectedCommandError, match="without an agent of this process only"):
        session.reset(keeps_clock=True)
