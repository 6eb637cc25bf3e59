"""ROS 2 transport: the relay of a program without rclpy, in lockstep and in real time."""

from contextlib import closing

import pytest

import cellwright
from cellwright.clients.client.client import Client
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.middleware.messages import TYPES
from cellwright.util.errors import UnknownNameError, UsageError
from tests.ros2.ground import Ground
from tests.ros2.requirement import installation

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2


def transport(domain: Ground, timeout: float = 60.0) -> Ros2Transport:
    found = installation()
    assert found is not None
    return Ros2Transport(found.python, environment={**found.environment, **domain.ros}, timeout=timeout)


def work(client: Client) -> None:
    """Start the competition, move the arm and switch the gripper, and wait."""
    client.start_competition()
    for rail in (0.3, -0.2):
        client.send_arm([[rail, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0]], [0.5])
        client.control_gripper(rail > 0.0)
        client.sleep(0.6)


@pytest.mark.slow
def test_lockstep_has_state_hash_of_run_in_one_process(domain: Ground) -> None:
    with cellwright.Session("lesson", options=cellwright.RunOptions(until=2.0)) as session:
        session.client()
        work(Client(session.transport("/agent")))
        expected = session.result_by_now()
    cell = domain.serve("lesson", "--lockstep")
    with closing(transport(domain)) as over:
        work(Client(over))
    assert f"state hash  {expected.state_hash}" in domain.stop(cell)


@pytest.mark.slow
def test_state_of_arm_and_awaited_topic_pass_in_real_time(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    states: list[object] = []
    with closing(transport(domain)) as over:
        over.subscribe("/ariac/arm/state", states.append)
        over.subscribe("/nothing/yet", states.append)
        over.advance(over.now() + 10**9)
        types = over.call("/cellwright/part_types", TYPES.service("std_srvs/Trigger").request())
        with pytest.raises(UnknownNameError, match="/nothing"):
            over.call("/nothing", TYPES.service("std_srvs/Trigger").request())
    assert states
    assert all(isinstance(each, TYPES.message("control_msgs/JointTrajectoryControllerState")) for each in states)
    assert types.success


def test_domain_without_simulator_is_refused(domain: Ground) -> None:
    with pytest.raises(UsageError, match="no simulator in this domain of ROS 2"):
        transport(domain, timeout=0.5)
