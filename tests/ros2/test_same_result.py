"""One scenario in one process, over the socket, over ROS 1 and over ROS 2: same orders, score and state hash."""

from collections.abc import Callable
from contextlib import closing

import pytest

import cellwright
from cellwright.clients.client.client import Client
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


def in_one_process() -> tuple[list[str], str]:
    """Return what a client saw, and the state hash."""
    with cellwright.Session("lesson", options=cellwright.RunOptions(until=5.0)) as session:
        session.client()
        seen = work(Client(session.transport("/agent")))
        return seen, str(session.result_by_now().state_hash)


def over(transport: Callable[[], SocketTransport], cell: Process) -> tuple[list[str], str]:
    """Return the same of a client of a served cell, which ends then."""
    with closing(transport()) as opened:
        seen = work(Client(opened))
    cell.interrupt()
    return seen, cell.wait_for(r"^state hash +([0-9a-f]{64})$")[1]


@pytest.mark.slow
@pytest.mark.ros1
@pytest.mark.ros2
def test_scenario_has_same_result_over_each_transport(master: Master, domain: Ground) -> None:
    expected = in_one_process()
    cell = domain.cellwright("serve", "lesson", "--lockstep", "--port", "0")
    port = int(cell.wait_for(r"^ready: lesson at 127.0.0.1:(\d+)")[1])
    assert over(lambda: SocketTransport(("127.0.0.1", port), node="/agent"), cell) == expected
    cell = master.serve("lesson", "--lockstep")
    assert over(lambda: Ros1Transport(environment=master.environment), cell) == expected
    cell = domain.serve("lesson", "--lockstep")
    found = installation()
    assert found is not None
    environment = {**found.environment, **domain.ros}
    assert over(lambda: Ros2Transport(found.python, environment=environment), cell) == expected
