"""Scenarios in one process, over the socket, over ROS 1 and over ROS 2: same orders, score and state hash."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

import cellwright
from cellwright.clients.client import Client
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.clients.client.socket_transport import SocketTransport
from tests.ros1.ground import Ground as Master
from tests.ros2.ground import Ground
from tests.ros2.requirement import installation
from tests.support.processes import Process

pytest_plugins = ["tests.ros1.fixtures", "tests.ros2.fixtures"]


def work(client: Client) -> list[str]:
    """Start the competition, take an order, and press the gripper into a bin; return what was seen."""
    seen = [f"started {client.start_competition()}"]
    order = client.wait_for_order(2.0)
    assert order is not None
    seen += [order.order_id, *(each.type for kit in order.kits for each in kit.objects)]
    seen += client.material_locations("gear_part")
    beam = client.sensor("break_beam")
    for rail, lift in ((0.2, -1.13), (-0.1, -0.9)):
        client.send_arm([[rail, 3.14, lift, 1.51, 3.77, -1.51, 0.0]], [0.5])
        client.control_gripper(rail > 0.0)
        client.sleep(0.6)
        seen.append(f"{client.time:.3f} {client.joint_positions['shoulder_lift_joint']!r} {client.gripper_enabled}")
    seen += [str(beam.message is None), f"score {client.score}", f"ended {client.end_competition()}"]
    return seen


def work_with_two(client: Client) -> list[str]:
    """Move two arms of six joints, each by a command before it was heard of; return what was seen of both."""
    seen = [f"started {client.start_competition()}"]
    arms = {name: client.arm(name) for name in ("arm1", "arm2")}
    for arm, pan in zip(arms.values(), (1.4, 1.7), strict=True):
        arm.send_arm([[1.6, -1.2, pan, -2.0, -1.57, 0.0]], [0.5])
        arm.control_gripper(pan > 1.5)
    client.sleep(0.8)
    for name, arm in arms.items():
        seen += [name, f"{arm.joint_positions['shoulder_pan_joint']!r} {arm.gripper_enabled}"]
    return [*seen, f"ended {client.end_competition()}"]


def work_with_fingers(client: Client) -> list[str]:
    """Open and close the fingers of a parallel gripper, which grip a part; return what was seen."""
    seen = [f"started {client.start_competition()}"]
    client.sleep(0.1)
    for width, effort in ((0.08, 0.0), (0.0, 12.0), (0.05, 0.0)):
        reached = client.move_gripper(width, effort)
        seen.append(f"{client.time:.3f} {reached} {client.gripper_width!r} {client.gripper_attached}")
    return [*seen, f"ended {client.end_competition()}"]


Work = Callable[[Client], list[str]]
TESTS = Path(__file__).parents[1]
SCENARIOS: dict[str, Work] = {
    "lesson": work,
    str(TESTS.parent / "examples" / "cells" / "two_arms.yaml"): work_with_two,
    str(TESTS / "data" / "fingers.yaml"): work_with_fingers,
}


def in_one_process(trial: str) -> tuple[list[str], str]:
    """Return what a client saw, and the state hash."""
    with cellwright.Session(trial, options=cellwright.RunOptions(until=5.0)) as session:
        session.client()
        seen = SCENARIOS[trial](Client(session.transport("/agent")))
        return seen, str(session.result_by_now().state_hash)


def over(transport: Callable[[], SocketTransport], cell: Process, act: Work) -> tuple[list[str], str]:
    """Return the same of a client of a served cell, which ends then."""
    with closing(transport()) as opened:
        seen = act(Client(opened))
    cell.interrupt()
    return seen, cell.wait_for(r"^state hash +([0-9a-f]{64})$")[1]


@pytest.mark.slow
@pytest.mark.ros1
@pytest.mark.ros2
@pytest.mark.filterwarnings("ignore:.*no shapes in the file")
@pytest.mark.parametrize("trial", SCENARIOS)
def test_scenario_has_same_result_over_each_transport(master: Master, domain: Ground, trial: str) -> None:
    expected, act = in_one_process(trial), SCENARIOS[trial]
    cell = domain.cellwright("serve", trial, "--lockstep", "--port", "0")
    port = int(cell.wait_for(r"^ready: \w+ at 127.0.0.1:(\d+)")[1])
    assert over(lambda: SocketTransport(("127.0.0.1", port), node="/agent"), cell, act) == expected
    cell = master.serve(trial, "--lockstep")
    assert over(lambda: Ros1Transport(environment=master.environment), cell, act) == expected
    cell = domain.serve(trial, "--lockstep")
    found = installation()
    assert found is not None
    environment = {**found.environment, **domain.ros}
    assert over(lambda: Ros2Transport(found.python, environment=environment), cell, act) == expected
