import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import ARM_JOINTS, Client, trajectory_message
from cellwright.clients.client.in_process import InProcess
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.util.errors import RejectedCommandError, UnknownNameError, UsageError
from tests.support.cells import ABOVE_THE_ROD, ARM_ONLY, BARE, INITIAL, JOINTS, KITTING, WHOLE, order

START = dict(zip(JOINTS, INITIAL, strict=True))
NEAR = {name: value + 0.1 for name, value in START.items()}


def client_of(cell: Cell) -> Client:
    return Client(InProcess(cell, node="/agent"))


def in_order(positions: dict[str, float]) -> list[float]:
    return [positions[name] for name in ARM_JOINTS]


def test_client_before_first_message_has_default_values() -> None:
    client = client_of(Cell(WHOLE))
    assert (client.competition_state, client.score, client.orders) == ("", 0.0, [])
    assert (client.joint_positions, client.joint_velocities) == ({}, {})
    assert (client.gripper_enabled, client.gripper_attached) == (False, False)


def test_client_works_kit_from_order_to_score() -> None:
    client = client_of(Cell(KITTING))
    client.sleep(0.1)
    assert client.competition_state == "init"
    assert client.start_competition()
    assert not client.start_competition()
    announced = client.wait_for_order(1.0)
    assert announced is not None
    assert announced.order_id == "order_0"
    assert client.orders == [announced]
    client.sleep(1.0)
    assert client.competition_state == "go"
    assert client.control_agv(1, announced.kits[0].kit_type)
    assert not client.control_agv(1, announced.kits[0].kit_type)
    assert client.wait_until(lambda: client.competition_state == "done", 5.0)
    assert client.score == 6.0


def test_wait_for_order_returns_orders_in_turn() -> None:
    client = client_of(Cell(replace(KITTING, orders=(order(), order(1, start_time=1.0)), extra_parts=())))
    client.start_competition()
    assert [each.order_id for each in (client.wait_for_order(), client.wait_for_order()) if each] == [
        "order_0",
        "order_1",
    ]
    assert client.time == pytest.approx(1.0, abs=0.01)
    assert client.wait_for_order(0.5) is None


def test_end_competition_ends_it_for_good() -> None:
    client = client_of(Cell(KITTING))
    assert client.end_competition()
    client.sleep(0.2)
    assert client.competition_state == "done"
    assert not client.start_competition()


def test_material_locations_name_storage_units() -> None:
    client = client_of(Cell(WHOLE))
    assert client.material_locations("gear_part") == ("belt", "bin8")
    assert client.material_locations("gear_prat") == ()


def test_joint_positions_match_initial_posture() -> None:
    client = client_of(Cell(ARM_ONLY))
    client.sleep(0.1)
    assert client.joint_positions.keys() == {*ARM_JOINTS, "vacuum_gripper_joint"}
    assert client.joint_positions == pytest.approx({**START, "vacuum_gripper_joint": 0.0}, abs=0.02)
    assert client.joint_velocities.keys() == client.joint_positions.keys()


def test_move_arm_returns_when_arm_stands_at_goal() -> None:
    for servo, close in (("original", 0.003), ("precise", 0.001)):
        client = client_of(Cell(ARM_ONLY, servo=servo))  # type: ignore[arg-type]
        assert client.move_arm([in_order(START), in_order(NEAR)], [0.5, 1.5])
        assert 1.5 <= client.time < 3.0
        assert all(abs(client.joint_positions[name] - NEAR[name]) < close for name in JOINTS)
        assert all(abs(client.joint_velocities[name]) < 0.02 for name in JOINTS)


def test_move_arm_with_tight_tolerance_times_out() -> None:
    client = client_of(Cell(ARM_ONLY))
    assert not client.move_arm([in_order(NEAR)], tolerance=0.0001, timeout=0.5)  # the arm sags by more
    assert client.time == 1.5
    assert client.move_arm([in_order(NEAR)])


def test_move_arm_to_unreachable_goal_times_out() -> None:
    client = client_of(Cell(ARM_ONLY))
    far = {**START, "linear_arm_actuator_joint": 2.5}  # beyond the end of the rail
    assert not client.move_arm([in_order(far)], timeout=0.5)
    assert client.time == 1.5


def test_send_arm_without_times_spaces_waypoints_by_1_s() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    assert cell.arm is not None
    client.send_arm([in_order(NEAR), in_order(START)])
    client.sleep(1.0)
    assert cell.arm.controller.positions(cell.simulation.now) == pytest.approx(list(NEAR.values()))
    assert cell.arm.controller.end == 2_000_000_000


def test_send_arm_with_velocities_follows_cubic() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    client.send_arm([in_order(NEAR)], [1.0], velocities=[[0.0] * 7])
    assert cell.arm is not None
    # a cubic from rest to rest is half-way there in the middle, at one and a half times the mean speed
    assert cell.arm.controller.positions(500_000_000) == pytest.approx([v + 0.05 for v in INITIAL])
    assert cell.arm.controller.velocities(500_000_000) == pytest.approx([0.15] * 7)


@pytest.mark.parametrize("duration", [0.0, 0.03, 0.0513, 0.5, 0.777])
def test_idle_leaves_same_state_as_sleep(duration: float) -> None:
    awake, idle_client = client_of(Cell(ARM_ONLY)), client_of(Cell(ARM_ONLY))
    for client, pass_time in ((awake, awake.sleep), (idle_client, idle_client.idle)):
        client.sleep(0.123)
        client.send_arm([in_order(NEAR)], [1.0])
        client.control_gripper(True)
        pass_time(duration)
    assert idle_client.transport.now() == awake.transport.now()
    assert idle_client.joint_positions == awake.joint_positions
    assert idle_client.gripper_enabled is awake.gripper_enabled


def test_idle_pauses_subscriptions_until_shortly_before_its_end() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    subscribed_at: dict[str, list[float]] = {"/ariac/joint_states": [], "/ariac/gripper/state": []}

    def record_subscribed(_score: object) -> None:
        for topic, times in subscribed_at.items():
            if cell.bus.topic(topic).subscribers:
                times.append(round(client.time, 3))

    client.subscribe("/ariac/current_score", record_subscribed)
    client.idle(1.02)
    assert subscribed_at == {"/ariac/joint_states": [1.0], "/ariac/gripper/state": [1.0]}
    assert client.joint_states.count > 0
    client.sleep(0.2)
    assert subscribed_at["/ariac/gripper/state"] == [1.0, 1.1, 1.2]


def test_refused_idle_leaves_subscriptions_on() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    for duration in (-1.0, math.nan, math.inf):
        with pytest.raises(UsageError):
            client.idle(duration)
    refused: list[str] = []

    def idle(_score: object) -> None:
        with pytest.raises(UsageError, match="callback"):
            client.idle(1.0)
        refused.append("idle")

    client.subscribe("/ariac/current_score", idle)
    client.sleep(0.15)
    assert refused == ["idle"]
    assert cell.bus.topic("/ariac/gripper/state").subscribers == ("/agent",)


def test_send_arm_accepts_joints_in_given_order() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    client.send_arm([tuple(NEAR.values())], joints=JOINTS)
    assert cell.arm is not None
    assert cell.arm.controller.positions(10**9) == pytest.approx(list(NEAR.values()))


def test_send_arm_without_waypoints_stops_arm() -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    client.send_arm([in_order(NEAR)], [10.0])
    client.sleep(1.0)
    client.send_arm([])
    client.sleep(1.0)
    assert cell.arm is not None
    assert max(map(abs, cell.arm.controller.velocities(cell.simulation.now))) == 0.0


@pytest.mark.parametrize(
    ("act", "error", "reason"),
    [
        (lambda c: c.send_arm([INITIAL], [1.0, 2.0]), UsageError, "one entry for each waypoint"),
        (lambda c: c.send_arm([INITIAL], [1.0], velocities=[]), UsageError, "one entry for each waypoint"),
        (lambda c: c.send_arm([INITIAL], [math.nan]), UsageError, "times must be finite"),
        (lambda c: c.move_arm([]), UsageError, "at least one waypoint"),
        (lambda c: c.send_arm([INITIAL, INITIAL], [2.0, 1.0]), RejectedCommandError, "times must increase"),
        (lambda c: c.send_arm([INITIAL[:6]]), RejectedCommandError, "6 positions for 7 joints"),
        (
            lambda c: c.send_arm([(math.nan, *INITIAL[1:])]),
            RejectedCommandError,
            r"position of elbow_joint must be finite \(got nan\)",
        ),
        (lambda c: c.send_arm([INITIAL], joints=("rail",) * 7), RejectedCommandError, "unknown joint 'rail'"),
        (lambda c: c.send_arm([INITIAL], [1e30]), RejectedCommandError, "sec must be from"),
    ],
)
def test_invalid_arm_command_is_refused_without_effect(
    act: Callable[[Client], object], error: type[Exception], reason: str
) -> None:
    cell = Cell(ARM_ONLY)
    client = client_of(cell)
    before = cell.state_hash()
    with pytest.raises(error, match=reason):
        act(client)
    assert cell.state_hash() == before


def test_trajectory_message_has_positions_times_and_velocities() -> None:
    message = trajectory_message(("a", "b"), [(1.0, 2.0), (3.0, 4.0)], [0.5, 1.25], [(0.1, 0.2), (0.3, 0.4)])
    assert message.joint_names == ["a", "b"]
    assert nanoseconds(message.header.stamp) == 0
    assert [nanoseconds(point.time_from_start) for point in message.points] == [500_000_000, 1_250_000_000]
    np.testing.assert_array_equal(message.points[1].positions, [3.0, 4.0])
    np.testing.assert_array_equal(message.points[0].velocities, [0.1, 0.2])


def test_gripper_picks_and_releases_rod() -> None:
    cell = Cell(WHOLE)
    client = client_of(cell)
    assert client.control_gripper(True)
    assert client.wait_until(lambda: client.gripper_attached, 1.0)
    assert client.gripper_enabled
    assert client.move_arm([ABOVE_THE_ROD], joints=JOINTS)
    assert client.gripper_attached
    assert client.control_gripper(False)
    client.sleep(0.1)
    assert (client.gripper_enabled, client.gripper_attached) == (False, False)


def test_sensor_is_subscribed_on_first_request() -> None:
    cell = Cell(WHOLE)
    client = client_of(cell)
    assert cell.bus.topic("/ariac/logical_camera_1").subscribers == ()
    camera = client.sensor("logical_camera_1")
    assert client.sensor("logical_camera_1") is camera
    assert [model.type for model in camera.wait(1.0).models] == ["piston_rod_part"]
    got: list[bool] = []
    leave = client.on_sensor("break_beam_1", lambda message: got.append(message.object_detected))
    client.sleep(0.2)
    leave()
    client.sleep(0.2)
    assert got == [False] * 5  # the newest one at once, then four in 0.2 s


def test_client_of_bare_cell_refuses_arm_and_agv_commands() -> None:
    client = client_of(Cell(BARE))
    client.sleep(0.2)
    assert client.competition_state == "init"
    assert client.joint_positions == {}
    with pytest.raises(UnknownNameError, match="unknown service '/ariac/agv1'"):
        client.control_agv(1, "order_0_kit_0")
    with pytest.raises(UnknownNameError, match="unknown topic to publish on '/ariac/arm/command'"):
        client.send_arm([INITIAL])


@pytest.mark.parametrize("name", ["break_beam_l", "logical_camera", "", "arm/stat", "../clock"])
def test_unknown_sensor_is_refused_with_known_ones(name: str) -> None:
    client = Client(InProcess(Cell(WHOLE)))
    for ask in (client.sensor, lambda each: client.on_sensor(each, print)):
        with pytest.raises(UnknownNameError) as caught:
            ask(name)
        assert caught.value.valid == (
            "break_beam_1",
            "break_beam_1_change",
            "laser_profiler_1",
            "logical_camera_1",
            "logical_camera_2",
            "proximity_sensor_1",
            "quality_control_sensor_1",
            "quality_control_sensor_2",
        )
    assert client.sensor("break_beam_1").wait(1.0) is not None


def test_unknown_sensor_over_open_transport_is_awaited(caplog: pytest.LogCaptureFixture) -> None:
    class Growing(InProcess):
        knows_all_topics = False

    client = Client(Growing(Cell(BARE)))
    assert client.sensor("break_beam_1").wait(0.1) is None
    assert "unknown sensor 'break_beam_1' (known: none); waiting for it" in caplog.text
